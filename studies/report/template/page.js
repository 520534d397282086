"use strict";
// Draws the charts that stand as JSON beside their still pictures, in the colours of the theme.
(() => {
  const root = document.documentElement;
  const css = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const wants = window.matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme || (wants.matches ? "dark" : "light")) === "dark";
  const hasWebGL = (() => {
    try { return Boolean(document.createElement("canvas").getContext("webgl")); } catch { return false; }
  })();

  const named = (key, value) =>
    typeof value === "string" && value.startsWith("var(--") ? css(value.slice(6, -1)) : value;

  function layoutOf(own, solid) {
    const clear = "rgba(0,0,0,0)";
    return {
      ...own,
      autosize: true,
      uirevision: "keep", // a change of theme leaves zoom and camera as they are
      margin: solid ? { l: 0, r: 0, t: 0, b: 0 } : { l: 46, r: 10, t: 30, b: 42 },
      paper_bgcolor: clear,
      plot_bgcolor: clear,
      font: { family: css("sans"), size: 12, color: css("soft") },
      // below the chart: the tool bar covers what stands above it
      legend: { orientation: "h", x: 0, y: 0, yref: "container", yanchor: "bottom", bgcolor: clear, font: { size: 11 } },
      hoverlabel: { bgcolor: css("card"), bordercolor: css("line"), font: { color: css("ink") } },
    };
  }

  const config = {
    displaylogo: false,
    responsive: true,
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "hoverClosest3d", "tableRotation"],
  };

  function draw(chart) {
    const solid = chart.classList.contains("solid");
    if (solid && !hasWebGL) return Promise.resolve(); // the still picture stays
    const spec = JSON.parse(chart.querySelector("script").textContent, named);
    const live = chart.querySelector(".live");
    const choice = chart.querySelector("select");
    if (choice) spec.data.forEach((trace, i) => { trace.visible = i === choice.selectedIndex; });
    chart.classList.add("drawn");
    return Plotly.react(live, spec.data, layoutOf(spec.layout, solid), config).then(() => {
      live.dataset.drawn = "yes";
      if (!chart.dataset.wired) wire(chart, live, spec);
    });
  }

  function wire(chart, live, spec) {
    chart.dataset.wired = "yes";
    chart.querySelectorAll("button[data-view]").forEach((button) =>
      button.addEventListener("click", () => Plotly.relayout(live, {
        "scene.camera": { ...spec.layout.scene.camera, center: { x: 0, y: 0, z: 0 }, ...spec.views[button.dataset.view] },
      })));
    const choice = chart.querySelector("select");
    if (choice) choice.addEventListener("change", () => draw(chart));
    if (chart.classList.contains("solid")) live.addEventListener("keydown", (event) => turn(event, live));
  }

  // arrow keys turn the view about its upright axis and tip it
  function turn(event, live) {
    const camera = live._fullLayout.scene.camera;
    const up = camera.up.y > 0.5 ? "y" : "z";
    const [a, b] = up === "y" ? ["z", "x"] : ["x", "y"];
    const step = Math.PI / 24;
    const eye = { ...camera.eye };
    const flat = Math.hypot(eye[a], eye[b]);
    const size = Math.hypot(flat, eye[up]);
    const around = Math.atan2(eye[b], eye[a]);
    const above = Math.atan2(eye[up], flat);
    const place = (angle, height, reach) => ({
      [a]: reach * Math.cos(height) * Math.cos(angle),
      [b]: reach * Math.cos(height) * Math.sin(angle),
      [up]: reach * Math.sin(height),
    });
    const limit = (height) => Math.max(-1.5, Math.min(1.5, height));
    const moves = {
      ArrowLeft: () => place(around - step, above, size),
      ArrowRight: () => place(around + step, above, size),
      ArrowUp: () => place(around, limit(above + step), size),
      ArrowDown: () => place(around, limit(above - step), size),
    };
    if (!(event.key in moves)) return;
    event.preventDefault();
    Plotly.relayout(live, { "scene.camera.eye": moves[event.key]() });
  }

  const charts = [...document.querySelectorAll(".chart")];
  const drawAll = () => charts.reduce((before, chart) => before.then(() => draw(chart)), Promise.resolve());
  const button = document.getElementById("theme");
  const label = () => { button.textContent = isDark() ? "Light" : "Dark"; button.setAttribute("aria-pressed", isDark()); };
  button.hidden = false;
  button.addEventListener("click", () => { root.dataset.theme = isDark() ? "light" : "dark"; label(); drawAll(); });
  wants.addEventListener("change", () => { label(); drawAll(); });
  label();
  drawAll().then(() => { root.dataset.ready = "yes"; });
})();
