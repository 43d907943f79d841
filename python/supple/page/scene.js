"use strict";
// What the 3-D views of the pages share: arrays from base64, the box, its letters and scale bar.
const page = (function () {
  function bytes(text) {
    const raw = atob(text), out = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) out[k] = raw.charCodeAt(k);
    return out.buffer;
  }
  const floats = (text) => new Float32Array(bytes(text));
  const ids = (text) => new Uint32Array(bytes(text));

  // Three arrays of a flat one of points or triangles.
  function columns(flat) {
    const n = flat.length / 3, out = [0, 1, 2].map(() => new flat.constructor(n));
    for (let k = 0; k < n; k++) for (let c = 0; c < 3; c++) out[c][k] = flat[3 * k + c];
    return out;
  }
  const ramp = [[0, "#f7e8da"], [0.25, "#bfdccb"], [0.5, "#74b3bd"], [0.75, "#3b7ba6"], [1, "#26407a"]];
  const light = { ambient: 0.5, diffuse: 0.65, specular: 0.1, roughness: 0.8, fresnel: 0.1 };
  const lamp = { x: 6e4, y: 9e4, z: -1e5 }; // as plotly.js turns it: from the front, above

  // A mesh of packed points and triangles.
  function mesh(points, triangles, style) {
    const [x, y, z] = columns(floats(points)), [i, j, k] = columns(ids(triangles));
    return Object.assign({ type: "mesh3d", x, y, z, i, j, k, hoverinfo: "skip", lighting: light, lightposition: lamp }, style);
  }
  // What packed layers of points span, with a margin, mm.
  function boxOf(layers, margin) {
    const lo = [Infinity, Infinity, Infinity], hi = [-Infinity, -Infinity, -Infinity];
    layers.forEach((points) => columns(floats(points)).forEach((values, c) => values.forEach((v) => {
      lo[c] = Math.min(lo[c], v); hi[c] = Math.max(hi[c], v);
    })));
    return { lo: lo.map((v) => v - margin), hi: hi.map((v) => v + margin) };
  }
  // The letters of the sides; `place(point, axis, far)` moves one of them out of the way.
  function letters(box, place) {
    const x = [], y = [], z = [], names = ["R", "L", "A", "P", "I", "S"];
    names.forEach((_, n) => {
      const p = box.lo.map((v, c) => (v + box.hi[c]) / 2), c = n >> 1;
      place(p, c, n % 2 === 1);
      p[c] = n % 2 ? box.hi[c] - 6 : box.lo[c] + 6;
      x.push(p[0]); y.push(p[1]); z.push(p[2]);
    });
    return { type: "scatter3d", mode: "text", x, y, z, text: names.map((t) => "<b>" + t + "</b>"),
      textfont: { size: 20, color: "#0b5c8a" }, hoverinfo: "skip" };
  }
  // A scale bar of 50 mm along each axis from `at`, y `ahead` (+1 or -1); its length stands above it.
  function scaleBar(at, ahead) {
    const x = [], y = [], z = [];
    [[50, 0, 0], [0, ahead * 50, 0], [0, 0, 50]].forEach((d) => {
      x.push(at[0], at[0] + d[0], null); y.push(at[1], at[1] + d[1], null); z.push(at[2], at[2] + d[2], null);
    });
    return [{ type: "scatter3d", mode: "lines", x, y, z, line: { color: "#14232e", width: 5 }, hoverinfo: "skip" },
      { type: "scatter3d", mode: "text", x: [at[0] + 30], y: [at[1]], z: [at[2] + 9], text: ["50 mm"],
        textfont: { size: 13, color: "#14232e" }, hoverinfo: "skip" }];
  }
  function layout(scene, box, look, fill) {
    const size = box.hi.map((v, c) => v - box.lo[c]), tall = scene.clientHeight * 0.85,
      zoom = Math.min(fill.tall / size[2], (fill.wide * scene.clientWidth) / tall / size[0]);
    const axis = (c) => ({ range: [box.lo[c], box.hi[c]], visible: false });
    return { margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, paper_bgcolor: "#fff", uirevision: "keep",
      font: { color: "#14232e" },
      scene: { xaxis: axis(0), yaxis: axis(1), zaxis: axis(2), camera: look, aspectmode: "manual",
        aspectratio: { x: zoom * size[0], y: zoom * size[1], z: zoom * size[2] } } };
  }
  const seen = (scene) => scene._fullLayout && scene._fullLayout.scene && scene._fullLayout.scene.camera;
  const settings = { displaylogo: false, displayModeBar: false, responsive: true, scrollZoom: true, plotlyServerURL: "" };

  // Buttons of a `kind` (data-KIND) show which of them holds.
  function press(kind, chosen) {
    document.querySelectorAll("[data-" + kind + "]").forEach((button) =>
      button.setAttribute("aria-pressed", String(button.dataset[kind] === chosen)));
  }
  function onClick(kind, act) {
    document.querySelectorAll("[data-" + kind + "]").forEach((button) =>
      button.addEventListener("click", () => act(button.dataset[kind])));
  }
  // The first picture, or why there is none.
  function begin(scene, draw, other) {
    try {
      draw();
    } catch (error) {
      scene.textContent = "The 3-D view needs WebGL, which this browser does not offer; " + other;
    }
  }
  return { floats, columns, ramp, light, lamp, mesh, boxOf, letters, scaleBar, layout, seen, settings, press, onClick, begin };
})();
