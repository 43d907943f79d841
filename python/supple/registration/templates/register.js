"use strict";
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const scene = document.getElementById("scene");
  const state = { mode: "drawing", view: "front" };
  const names = { distance: "Distance of the scan to the registered skin (mm)",
    sd: "Standard deviation of the registered skin (mm)" };

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
  const layer = (name) => document.querySelector('[data-layer="' + name + '"]');
  const ramp = [[0, "#f7e8da"], [0.25, "#bfdccb"], [0.5, "#74b3bd"], [0.75, "#3b7ba6"], [1, "#26407a"]];
  const light = { ambient: 0.5, diffuse: 0.65, specular: 0.1, roughness: 0.8, fresnel: 0.1 };
  const lamp = { x: 6e4, y: 9e4, z: -1e5 }; // as plotly.js turns it: from the front, above

  function surface(name, plain, mode) {
    const own = data[name], [x, y, z] = columns(floats(own.points));
    const coloured = state.mode === mode && own.values;
    if (!own.triangles) {
      const marker = { size: 1.8, color: coloured ? floats(own.values) : plain, colorscale: ramp, cmin: 0, cmax: data.most[mode] };
      return { type: "scatter3d", mode: "markers", x, y, z, marker, hoverinfo: "skip" };
    }
    const [i, j, k] = columns(new Uint32Array(bytes(own.triangles)));
    const colour = coloured
      ? { intensity: floats(own.values), colorscale: ramp, cmin: 0, cmax: data.most[mode], showscale: false, hovertemplate: "%{intensity:.1f} mm<extra></extra>" }
      : { color: plain, hoverinfo: "skip" };
    return Object.assign({ type: "mesh3d", name, x, y, z, i, j, k, lighting: light, lightposition: lamp }, colour);
  }
  const raised = (p) => [p[0], p[1] - 1.2, p[2]]; // towards the front, so that the skin does not hide it

  function curve(line) {
    const points = line.points.map(raised), on = line.on.slice();
    if (line.closed) { points.push(points[0]); on.push(on[0]); }
    return [true, false].map((solid) => {
      const xyz = [0, 1, 2].map((c) => points.map((p, n) => (on[n] === solid || (n && on[n - 1] === solid) ? p[c] : null)));
      return { type: "scatter3d", mode: "lines", name: line.name, x: xyz[0], y: xyz[1], z: xyz[2],
        line: { color: "#7a1fa2", width: solid ? 7 : 4, dash: solid ? "solid" : "dot" }, hoverinfo: "name" };
    }).concat(line.arrow ? [tip(points)] : []);
  }
  function tip(points) {
    const end = points[points.length - 1], from = points[Math.max(0, points.length - 5)];
    return { type: "cone", x: [end[0]], y: [end[1]], z: [end[2]], u: [end[0] - from[0]], v: [end[1] - from[1]], w: [end[2] - from[2]],
      anchor: "tip", sizemode: "absolute", sizeref: 12, showscale: false, colorscale: [[0, "#7a1fa2"], [1, "#7a1fa2"]], hoverinfo: "skip" };
  }
  function landmarks() {
    const at = data.landmarks.map((l) => raised(raised(l.point)));
    return { type: "scatter3d", mode: "markers", x: at.map((p) => p[0]), y: at.map((p) => p[1]), z: at.map((p) => p[2]),
      text: data.landmarks.map((l) => l.name + (l.on ? "" : " (on the fitted skin)") + (l.given ? ", given" : "")),
      marker: { size: 5, color: data.landmarks.map((l) => (l.on ? "#0b5c8a" : "#c27a00")), line: { color: "#fff", width: 1 } }, hoverinfo: "text" };
  }

  const box = (function () {
    const lo = [Infinity, Infinity, Infinity], hi = [-Infinity, -Infinity, -Infinity];
    columns(floats(data.skin.points)).forEach((values, c) => values.forEach((v) => {
      lo[c] = Math.min(lo[c], v); hi[c] = Math.max(hi[c], v);
    }));
    return { lo: lo.map((v) => v - 30), hi: hi.map((v) => v + 30) };
  })();
  const middle = box.lo.map((v, c) => (v + box.hi[c]) / 2);

  function letters() {
    const x = [], y = [], z = [], text = ["R", "L", "A", "P", "I", "S"];
    text.forEach((_, n) => {
      const p = middle.slice(), c = n >> 1;
      if (c === 1) { p[0] = box.hi[0] - (n % 2 ? 6 : 28); p[2] = box.lo[2] + 6; }
      p[c] = n % 2 ? box.hi[c] - 6 : box.lo[c] + 6;
      x.push(p[0]); y.push(p[1]); z.push(p[2]);
    });
    return { type: "scatter3d", mode: "text", x, y, z, text: text.map((t) => "<b>" + t + "</b>"),
      textfont: { size: 20, color: "#0b5c8a" }, hoverinfo: "skip" };
  }
  function triad() {
    const at = [box.lo[0] + 4, box.lo[1] + 4, box.lo[2] + 8], x = [], y = [], z = [];
    [[50, 0, 0], [0, 50, 0], [0, 0, 50]].forEach((d) => {
      x.push(at[0], at[0] + d[0], null); y.push(at[1], at[1] + d[1], null); z.push(at[2], at[2] + d[2], null);
    });
    return [{ type: "scatter3d", mode: "lines", x, y, z, line: { color: "#14232e", width: 5 }, hoverinfo: "skip" },
      { type: "scatter3d", mode: "text", x: [at[0] + 30], y: [at[1]], z: [at[2] + 9], text: ["50 mm"],
        textfont: { size: 12, color: "#14232e" }, hoverinfo: "skip" }];
  }

  function traces() {
    const out = [];
    if (layer("scan").checked) out.push(surface("scan", "#e3c8b6", "distance"));
    if (layer("skin").checked) out.push(surface("skin", "#9fb8c8", "sd"));
    if (layer("curves").checked) data.curves.forEach((line) => out.push(...curve(line)));
    if (layer("landmarks").checked) out.push(landmarks());
    return out.concat([letters()], triad());
  }
  function camera() {
    const far = 1.6, cameras = {
      front: { eye: { x: 0, y: -far, z: 0.05 } }, right: { eye: { x: -far, y: -0.25, z: 0.05 } },
      left: { eye: { x: far, y: -0.25, z: 0.05 } }, below: { eye: { x: 0, y: -far, z: -0.9 } } };
    return Object.assign({ projection: { type: "orthographic" }, up: { x: 0, y: 0, z: 1 } }, cameras[state.view]);
  }
  function layout(look) {
    const size = box.hi.map((v, c) => v - box.lo[c]), tall = scene.clientHeight * 0.85,
      zoom = Math.min(1.7 / size[2], (1.6 * scene.clientWidth) / tall / size[0]);
    const axis = (c) => ({ range: [box.lo[c], box.hi[c]], visible: false });
    return { margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, paper_bgcolor: "#fff", uirevision: "keep",
      scene: { xaxis: axis(0), yaxis: axis(1), zaxis: axis(2), camera: look, aspectmode: "manual",
        aspectratio: { x: zoom * size[0], y: zoom * size[1], z: zoom * size[2] } } };
  }
  function press(kind) {
    document.querySelectorAll("[data-" + kind + "]").forEach((button) =>
      button.setAttribute("aria-pressed", String(button.dataset[kind] === state[kind])));
  }
  function scale() {
    const most = data.most[state.mode];
    document.getElementById("scale").style.visibility = most ? "visible" : "hidden";
    document.getElementById("scale-name").textContent = names[state.mode] || "";
    document.getElementById("ticks").innerHTML = most ? [0, 1, 2, 3, 4].map((n) => "<span>" + (n * most) / 4 + "</span>").join("") : "";
  }
  function draw(reset) {
    const current = scene._fullLayout && scene._fullLayout.scene && scene._fullLayout.scene.camera;
    press("mode"); press("view"); scale();
    return Plotly.react(scene, traces(), layout(reset || !current ? camera() : current),
      { displaylogo: false, displayModeBar: false, responsive: true, scrollZoom: true, plotlyServerURL: "" });
  }
  function mode(name) {
    state.mode = name;
    layer("scan").checked = name !== "sd";
    layer("skin").checked = name === "sd";
  }

  document.querySelectorAll("[data-mode]").forEach((button) => button.addEventListener("click", () => {
    mode(button.dataset.mode);
    draw(false);
  }));
  document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
    state.view = button.dataset.view;
    draw(true).then(() => Plotly.relayout(scene, { "scene.camera": camera() }));
  }));
  document.querySelectorAll("[data-layer]").forEach((box) => box.addEventListener("change", () => draw(false)));

  const wanted = new URLSearchParams(location.hash.slice(1));
  if (["front", "left", "right", "below"].includes(wanted.get("view"))) state.view = wanted.get("view");
  mode(names[wanted.get("mode")] ? wanted.get("mode") : "drawing");
  try {
    draw(true);
  } catch (error) {
    scene.textContent = "The 3-D view needs WebGL, which this browser does not offer; picture.png does not.";
  }
})();
