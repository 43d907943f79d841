"use strict";
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const scene = document.getElementById("scene");
  const state = { mode: "drawing", view: "front" };
  const names = { distance: "Distance of the scan to the registered skin (mm)",
    sd: "Standard deviation of the registered skin (mm)" };

  const layer = (name) => document.querySelector('[data-layer="' + name + '"]');

  function surface(name, plain, mode) {
    const own = data[name], coloured = state.mode === mode && own.values;
    const scale = { colorscale: page.ramp, cmin: 0, cmax: data.most[mode] };
    if (!own.triangles) {
      const [x, y, z] = page.columns(page.floats(own.points));
      const marker = Object.assign({ size: 1.8, color: coloured ? page.floats(own.values) : plain }, scale);
      return { type: "scatter3d", mode: "markers", x, y, z, marker, hoverinfo: "skip" };
    }
    const colour = coloured
      ? Object.assign({ intensity: page.floats(own.values), showscale: false, hoverinfo: "all", hovertemplate: "%{intensity:.1f} mm<extra></extra>" }, scale)
      : { color: plain };
    return page.mesh(own.points, own.triangles, Object.assign({ name }, colour));
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

  const box = page.boxOf([data.skin.points], 30);

  function besides() {
    const letters = page.letters(box, (p, c, far) => {
      if (c === 1) { p[0] = box.hi[0] - (far ? 6 : 28); p[2] = box.lo[2] + 6; }
    });
    return [letters].concat(page.scaleBar([box.lo[0] + 4, box.lo[1] + 4, box.lo[2] + 8], 1));
  }

  function traces() {
    const out = [];
    if (layer("scan").checked) out.push(surface("scan", "#e3c8b6", "distance"));
    if (layer("skin").checked) out.push(surface("skin", "#9fb8c8", "sd"));
    if (layer("curves").checked) data.curves.forEach((line) => out.push(...curve(line)));
    if (layer("landmarks").checked) out.push(landmarks());
    return out.concat(besides());
  }
  function camera() {
    const far = 1.6, cameras = {
      front: { eye: { x: 0, y: -far, z: 0.05 } }, right: { eye: { x: -far, y: -0.25, z: 0.05 } },
      left: { eye: { x: far, y: -0.25, z: 0.05 } }, below: { eye: { x: 0, y: -far, z: -0.9 } } };
    return Object.assign({ projection: { type: "orthographic" }, up: { x: 0, y: 0, z: 1 } }, cameras[state.view]);
  }
  function scale() {
    const most = data.most[state.mode];
    document.getElementById("scale").style.visibility = most ? "visible" : "hidden";
    document.getElementById("scale-name").textContent = names[state.mode] || "";
    document.getElementById("ticks").innerHTML = most ? [0, 1, 2, 3, 4].map((n) => "<span>" + (n * most) / 4 + "</span>").join("") : "";
  }
  function draw(reset) {
    const current = page.seen(scene), look = reset || !current ? camera() : current;
    page.press("mode", state.mode);
    page.press("view", state.view);
    scale();
    return Plotly.react(scene, traces(), page.layout(scene, box, look, { tall: 1.7, wide: 1.6 }), page.settings);
  }
  function mode(name) {
    state.mode = name;
    layer("scan").checked = name !== "sd";
    layer("skin").checked = name === "sd";
  }

  page.onClick("mode", (name) => {
    mode(name);
    draw(false);
  });
  page.onClick("view", (name) => {
    state.view = name;
    draw(true).then(() => Plotly.relayout(scene, { "scene.camera": camera() }));
  });
  document.querySelectorAll("[data-layer]").forEach((box) => box.addEventListener("change", () => draw(false)));

  const wanted = new URLSearchParams(location.hash.slice(1));
  if (["front", "left", "right", "below"].includes(wanted.get("view"))) state.view = wanted.get("view");
  mode(names[wanted.get("mode")] ? wanted.get("mode") : "drawing");
  page.begin(scene, () => draw(true), "picture.png does not.");
})();
