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

  const shown = (layer) => {
    const box = document.querySelector('[data-layer="' + layer + '"]');
    return Boolean(box && box.checked);
  };

  function surface(layer, style) {
    const own = data[layer], how = { name: layer, visible: shown(layer), flatshading: false };
    return page.mesh(own[state.pose], own.triangles, Object.assign(how, style));
  }
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
    return { type: "mesh3d", name: "tumour", x, y, z, i, j, k, color: colour, hoverinfo: "name", lighting: page.light, lightposition: page.lamp };
  }
  function line(a, b, dash, width) {
    return { type: "scatter3d", mode: "lines", x: [a[0], b[0]], y: [a[1], b[1]], z: [a[2], b[2]],
      line: { color: "#b3122b", width, dash }, hoverinfo: "skip" };
  }

  const poses = ["prone", "rest", "supine"], whole = ["skin", "chest"].filter((layer) => data[layer]);
  const box = page.boxOf(whole.flatMap((layer) => poses.map((pose) => data[layer][pose])), 22);

  function besides() {
    const letters = page.letters(box, (p, c, far) => {
      if (c === 2) { p[0] += far ? 9 : -9; p[1] = box.lo[1]; } // side by side when seen from the feet
      if (c === 1) { p[0] = box.hi[0] - 6; p[2] = box.lo[2] + 6; }
    });
    return [letters].concat(page.scaleBar([box.lo[0] + 4, box.hi[1] - 4, box.lo[2] + 4], -1));
  }

  function traces() {
    const out = [], tumour = data.tumour[state.pose];
    if (data.chest) out.push(surface("chest", { color: "#9aa7b0", opacity: 1 }));
    if (shown("tumour")) {
      out.push(ball(tumour, data.radius, "#d0102f"));
      if (state.pose === "supine") {
        out.push(line(tumour, data.foot, "dash", 5), line(data.tumour.prone, tumour, "dot", 4));
        const p = data.tumour.prone;
        out.push({ type: "scatter3d", mode: "markers", x: [p[0]], y: [p[1]], z: [p[2]], name: "tumour, prone",
          marker: { size: 7, symbol: "circle-open", color: "#b3122b", line: { width: 2 } }, hoverinfo: "name" });
      }
    }
    if (data.gland) out.push(surface("gland", { color: "#e08bc0", opacity: 0.25 }));
    out.push(surface("skin", { intensity: page.floats(data.skin.colour), colorscale: page.ramp, cmin: 0, cmax: data.most,
      opacity: opacity(), showscale: false }));
    const n = data.nipple[state.pose];
    out.push({ type: "scatter3d", mode: "markers", x: [n[0]], y: [n[1]], z: [n[2]], name: "nipple",
      marker: { size: 6, color: "#6b3218" }, hoverinfo: "name" });
    if (data.scan && shown("scan") && state.pose === "supine") {
      const [x, y, z] = page.columns(page.floats(data.scan));
      out.push({ type: "scatter3d", mode: "markers", x, y, z, marker: { size: 1.6, color: "#17633a" }, hoverinfo: "skip" });
    }
    return out.concat(besides());
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
  function draw(reset) {
    const current = page.seen(scene), look = reset || !current ? camera() : current;
    page.press("pose", state.pose);
    page.press("view", state.view);
    caption.textContent = captions[state.pose] + " Drag to turn, scroll or pinch to zoom.";
    return Plotly.react(scene, traces(), page.layout(scene, box, look, { tall: 1.65, wide: 1.5 }), page.settings);
  }

  page.onClick("pose", (name) => {
    state.pose = name;
    draw(state.view !== "front");
  });
  page.onClick("view", (name) => {
    state.view = name;
    draw(true).then(() => Plotly.relayout(scene, { "scene.camera": camera() }));
  });
  document.querySelectorAll("[data-layer]").forEach((box) => box.addEventListener("change", () => draw(false)));
  document.getElementById("opacity").addEventListener("change", () => draw(false));

  const wanted = new URLSearchParams(location.hash.slice(1));
  if (wanted.get("pose") in captions) state.pose = wanted.get("pose");
  if (["front", "side", "feet"].includes(wanted.get("view"))) state.view = wanted.get("view");
  page.begin(scene, () => draw(true), "the drawings below do not.");
})();
