"use strict";
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const scene = document.getElementById("scene");
  const caption = document.getElementById("caption");
  const captions = {
    prone: "Prone: as in the MRI, the breast hangs towards the floor.",
    rest: "Rest: the shape without gravity, computed from the prone image.",
    supine: "Supine: predicted. Dashed red: shortest way to the skin. Dotted: shift of the tumour from prone (open circle).",
  };
  const state = { pose: "supine", view: "front" };

  function bytes(text) {
    const raw = atob(text), out = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) out[k] = raw.charCodeAt(k);
    return out.buffer;
  }
  function columns(flat) {
    const n = flat.length / 3, out = [0, 1, 2].map(() => new flat.constructor(n));
    for (let k = 0; k < n; k++) for (let c = 0; c < 3; c++) out[c][k] = flat[3 * k + c];
    return out;
  }
  const floats = (text) => new Float32Array(bytes(text));
  const points = (layer) => columns(floats(data[layer][state.pose]));
  const shown = (layer) => {
    const box = document.querySelector('[data-layer="' + layer + '"]');
    return Boolean(box && box.checked);
  };

  function surface(layer, style) {
    const [x, y, z] = points(layer);
    const [i, j, k] = columns(new Uint32Array(bytes(data[layer].triangles)));
    return Object.assign({ type: "mesh3d", name: layer, x, y, z, i, j, k, hoverinfo: "skip",
      visible: shown(layer), flatshading: false, lightposition: lamp }, style);
  }
  const scale = [[0, "#f7e8da"], [0.25, "#bfdccb"], [0.5, "#74b3bd"], [0.75, "#3b7ba6"], [1, "#26407a"]];
  const light = { ambient: 0.5, diffuse: 0.65, specular: 0.12, roughness: 0.8, fresnel: 0.1 };

  const lamp = { x: 6e4, y: 9e4, z: -1e5 };

  function ball(centre, radius, colour) {
    const x = [], y = [], z = [], i = [], j = [], k = [], m = 24, n = 12;
    for (let a = 0; a <= n; a++) for (let b = 0; b < m; b++) {
      const t = (Math.PI * a) / n, p = (2 * Math.PI * b) / m;
      x.push(centre[0] + radius * Math.sin(t) * Math.cos(p));
      y.push(centre[1] + radius * Math.sin(t) * Math.sin(p));
      z.push(centre[2] + radius * Math.cos(t));
    }
    for (let a = 0; a < n; a++) for (let b = 0; b < m; b++) {
      const q = a * m + b, r = a * m + ((b + 1) % m);
      i.push(q, q); j.push(r, r + m); k.push(r + m, q + m);
    }
    return { type: "mesh3d", name: "tumour", x, y, z, i, j, k, color: colour, hoverinfo: "name", lighting: light, lightposition: lamp };
  }
  function line(a, b, dash, width) {
    return { type: "scatter3d", mode: "lines", x: [a[0], b[0]], y: [a[1], b[1]], z: [a[2], b[2]],
      line: { color: "#b3122b", width, dash }, hoverinfo: "skip" };
  }

  const box = (function () {
    const lo = [Infinity, Infinity, Infinity], hi = [-Infinity, -Infinity, -Infinity];
    for (const pose of ["prone", "rest", "supine"]) for (const layer of ["skin", "chest"]) {
      if (!data[layer]) continue;
      columns(floats(data[layer][pose])).forEach((values, c) => values.forEach((v) => {
        lo[c] = Math.min(lo[c], v); hi[c] = Math.max(hi[c], v);
      }));
    }
    return { lo: lo.map((v) => v - 22), hi: hi.map((v) => v + 22) };
  })();
  const middle = box.lo.map((v, c) => (v + box.hi[c]) / 2);

  function axes() {
    const letters = ["R", "L", "A", "P", "I", "S"], x = [], y = [], z = [];
    letters.forEach((_, n) => {
      const p = middle.slice(), c = n >> 1;
      if (c === 2) { p[0] += n % 2 ? 9 : -9; p[1] = box.lo[1]; } // side by side when seen from the feet
      if (c === 1) { p[0] = box.hi[0] - 6; p[2] = box.lo[2] + 6; }
      p[c] = n % 2 ? box.hi[c] - 6 : box.lo[c] + 6;
      x.push(p[0]); y.push(p[1]); z.push(p[2]);
    });
    return { type: "scatter3d", mode: "text", x, y, z, text: letters.map((t) => "<b>" + t + "</b>"),
      textfont: { size: 20, color: "#0b5c8a" }, hoverinfo: "skip" };
  }
  function triad() {
    const at = [box.lo[0] + 4, box.hi[1] - 4, box.lo[2] + 4], x = [], y = [], z = [];
    [[50, 0, 0], [0, -50, 0], [0, 0, 50]].forEach((d) => {
      x.push(at[0], at[0] + d[0], null); y.push(at[1], at[1] + d[1], null); z.push(at[2], at[2] + d[2], null);
    });
    return [{ type: "scatter3d", mode: "lines", x, y, z, line: { color: "#14232e", width: 5 }, hoverinfo: "skip" },
      { type: "scatter3d", mode: "text", x: [at[0] + 25], y: [at[1]], z: [at[2] - 9], text: ["50 mm"],
        textfont: { size: 12, color: "#14232e" }, hoverinfo: "skip" }];
  }

  function traces() {
    const out = [], tumour = data.tumour[state.pose];
    if (data.chest) out.push(surface("chest", { color: "#9aa7b0", opacity: 1, lighting: light }));
    if (shown("tumour")) {
      out.push(ball(tumour, data.radius, "#d0102f"));
      if (state.pose === "supine") {
        out.push(line(tumour, data.foot, "dash", 5), line(data.tumour.prone, tumour, "dot", 4));
        const p = data.tumour.prone;
        out.push({ type: "scatter3d", mode: "markers", x: [p[0]], y: [p[1]], z: [p[2]], name: "tumour, prone",
          marker: { size: 7, symbol: "circle-open", color: "#b3122b", line: { width: 2 } }, hoverinfo: "name" });
      }
    }
    if (data.gland) out.push(surface("gland", { color: "#e08bc0", opacity: 0.25, lighting: light }));
    const colour = floats(data.skin.colour);
    out.push(surface("skin", { intensity: colour, colorscale: scale, cmin: 0, cmax: data.most, lightposition: lamp, opacity: opacity(), lighting: light,
      showscale: false }));
    const n = data.nipple[state.pose];
    out.push({ type: "scatter3d", mode: "markers", x: [n[0]], y: [n[1]], z: [n[2]], name: "nipple",
      marker: { size: 6, color: "#6b3218" }, hoverinfo: "name" });
    if (data.scan && shown("scan") && state.pose === "supine") {
      const [x, y, z] = columns(floats(data.scan));
      out.push({ type: "scatter3d", mode: "markers", x, y, z, marker: { size: 1.6, color: "#17633a" }, hoverinfo: "skip" });
    }
    return out.concat([axes()], triad());
  }
  const opacity = () => Number(document.getElementById("opacity").value) / 100;

  function camera() {
    const down = state.pose === "prone" ? 1 : -1, far = 1.5;
    const cameras = {
      front: { eye: { x: 0, y: -far, z: 0.12 }, up: { x: 0, y: 0, z: 1 } },
      side: { eye: { x: far, y: 0, z: 0.1 }, up: { x: 0, y: down, z: 0 } },
      feet: { eye: { x: 0, y: 0.001, z: -far }, up: { x: 0, y: down, z: 0 } },
    };
    return Object.assign({ projection: { type: "orthographic" } }, cameras[state.view]);
  }
  function layout(look) {
    const none = { visible: false };
    const size = box.hi.map((v, c) => v - box.lo[c]), tall = scene.clientHeight * 0.85,
      zoom = Math.min(1.65 / size[2], (1.5 * scene.clientWidth) / tall / size[0]);
    const axis = (c) => Object.assign({ range: [box.lo[c], box.hi[c]] }, none);
    return { margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, paper_bgcolor: "#fff", uirevision: "keep",
      font: { color: "#14232e" },
      scene: { xaxis: axis(0), yaxis: axis(1), zaxis: axis(2), camera: look, aspectmode: "manual",
        aspectratio: { x: zoom * size[0], y: zoom * size[1], z: zoom * size[2] } } };
  }
  function press(kind) {
    document.querySelectorAll("[data-" + kind + "]").forEach((button) =>
      button.setAttribute("aria-pressed", String(button.dataset[kind] === state[kind])));
  }
  function draw(reset) {
    const current = scene._fullLayout && scene._fullLayout.scene && scene._fullLayout.scene.camera;
    press("pose"); press("view");
    caption.textContent = captions[state.pose] + " Drag to turn, scroll or pinch to zoom.";
    return Plotly.react(scene, traces(), layout(reset || !current ? camera() : current),
      { displaylogo: false, displayModeBar: false, responsive: true, scrollZoom: true, plotlyServerURL: "" });
  }

  document.querySelectorAll("[data-pose]").forEach((button) => button.addEventListener("click", () => {
    state.pose = button.dataset.pose;
    draw(state.view !== "front");
  }));
  document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
    state.view = button.dataset.view;
    draw(true).then(() => Plotly.relayout(scene, { "scene.camera": camera() }));
  }));
  document.querySelectorAll("[data-layer]").forEach((box) => box.addEventListener("change", () => draw(false)));
  document.getElementById("opacity").addEventListener("change", () => draw(false));

  const wanted = new URLSearchParams(location.hash.slice(1));
  if (wanted.get("pose") in captions) state.pose = wanted.get("pose");
  if (["front", "side", "feet"].includes(wanted.get("view"))) state.view = wanted.get("view");
  try {
    draw(true);
  } catch (error) {
    scene.textContent = "The 3-D view needs WebGL, which this browser does not offer; the drawings below do not.";
  }
})();
