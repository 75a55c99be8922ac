// Curves over the clock, with a line where the slider is and the values there.
const SVG = "http://www.w3.org/2000/svg";
const DASHES = ["", "", "6 3", "2 2"];

function element(parent, name, attributes = {}, space) {
  const made = space ? document.createElementNS(space, name) : document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  parent.appendChild(made);
  return made;
}

function degrees(value, digits = 1) {
  const fixed = value.toFixed(digits);
  return `${Number(fixed) === 0 ? (0).toFixed(digits) : fixed.replace("-", "\u2212")}\u00b0`;
}

// Panels and the series in them; a series has a value for each sample of its clip.
function panels() {
  const main = data.clips[0], robot = data.robots[main.robot];
  const told = [{ title: "Base orientation [deg]", series: [] }];
  data.clips.forEach((clip, c) => data.angle_names.forEach((name, i) =>
    told[0].series.push({ name, colour: data.axis_colours[i], clip, c, values: clip.angles, k: i, dash: "" })));
  if (data.target) {
    told.push({
      title: "Angle to the target [deg]", zero: true,
      series: data.clips.map((clip, c) => ({ name: "left", colour: "#d55e00", clip, c, values: clip.left, dash: "" })),
    });
  }
  const joints = { title: "Joint angles [deg]", series: [] };
  data.clips.forEach((clip, c) => data.robots[clip.robot].joints.forEach((joint, k) => joints.series.push({
    name: joint.name, colour: data.joint_colours[k % data.joint_colours.length], clip, c, k, dash: DASHES[k % DASHES.length],
    values: clip.theta.map((row) => row.map((x) => (x * 180) / Math.PI)),
  })));
  if (robot.joints.length) told.push(joints);
  return told;
}

function makeCurves(holder, end, scrub) {
  const drawn = panels().map((panel) => makePanel(holder, panel, end, scrub));
  return {
    resize: () => drawn.forEach((panel) => panel.resize()),
    show: (clock, states) => drawn.forEach((panel) => panel.show(clock, states)),
  };
}

function makePanel(holder, panel, end, scrub) {
  const box = element(holder, "div", { class: "panel" });
  element(box, "h2").textContent = panel.title;
  const keys = element(box, "div", { class: "keys" });
  const outputs = panel.series.filter((one) => one.c === 0).map((one) => {
    const key = element(keys, "span");
    const swatch = element(element(key, "svg", { width: 22, height: 8 }, SVG), "line",
      { x1: 0, x2: 22, y1: 4, y2: 4, stroke: one.colour, "stroke-width": 3, "stroke-dasharray": one.dash }, SVG);
    swatch.setAttribute("aria-hidden", "true");
    element(key, "span").textContent = one.name;
    return [one, element(key, "output")];
  });
  data.clips.slice(1).forEach((clip) => {
    const key = element(keys, "span");
    element(element(key, "svg", { width: 22, height: 8 }, SVG), "line",
      { x1: 0, x2: 22, y1: 4, y2: 4, stroke: "#555", "stroke-width": 1.4, "stroke-dasharray": "1.5 2.5" }, SVG);
    element(key, "span").textContent = `dotted: ${clip.label}`;
  });
  const svg = element(box, "svg", { role: "img", "aria-label": panel.title }, SVG);
  const values = panel.series.flatMap((one) => one.values.map((row) => (one.k === undefined ? row : row[one.k])));
  let low = values.reduce((a, b) => Math.min(a, b), panel.zero ? 0 : Infinity);
  let high = values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (high - low < 1e-6) { low -= 1; high += 1; }
  const pad = 0.06 * (high - low);
  low -= panel.zero ? 0 : pad;
  high += pad;
  const left = 44, right = 8, top = 6, bottom = 20, height = 150;
  let width = 0, cursor = null;
  const x = (clock) => left + ((width - left - right) * clock) / end;
  const y = (value) => top + (height - top - bottom) * (1 - (value - low) / (high - low));

  function resize() {
    width = Math.max(200, box.clientWidth);
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.replaceChildren();
    const line = (x1, y1, x2, y2, stroke) => element(svg, "line", { x1, y1, x2, y2, stroke }, SVG);
    const label = (at, level, words, anchor) => {
      element(svg, "text", { x: at, y: level, "text-anchor": anchor }, SVG).textContent = words;
    };
    ticks(low, high, 5, [1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1800]).forEach((value) => {
      line(left, y(value), width - right, y(value), value === 0 ? "#9aa5ad" : "#e3e7ea");
      label(left - 6, y(value) + 4, `${+value.toPrecision(6)}`.replace("-", "\u2212"), "end");
    });
    const corners = data.clips[0].corners;
    if (!data.timed && corners.length <= 41) corners.slice(1, -1).forEach((at) => line(x(at), top, x(at), height - bottom, "#c5ccd1"));
    data.clips.filter((clip) => clip.nearest).forEach((clip) => {
      const at = x(clip.nearest.clock);
      element(svg, "line", { x1: at, x2: at, y1: top, y2: height - bottom, stroke: NEAR, "stroke-dasharray": "4 2" }, SVG);
    });
    const marks = data.timed ? ticks(0, end, 6, [1, 2, 5, 10]) : ticks(0, end, 10, [1, 2, 5, 10]).filter(Number.isInteger);
    marks.forEach((at) => {
      const last = at === marks[marks.length - 1];
      const unit = last ? (data.timed ? " s" : " edges") : "";
      label(x(at), height - 5, `${+at.toPrecision(6)}${unit}`, last && x(at) > width - 40 ? "end" : "middle");
    });
    [...panel.series].reverse().forEach((one) => {
      const points = one.clip.clock.map((at, i) => `${x(at).toFixed(1)},${y(one.k === undefined ? one.values[i] : one.values[i][one.k]).toFixed(1)}`);
      const style = one.c === 0 ? { "stroke-width": 2, "stroke-dasharray": one.dash } : { "stroke-width": 1.7, "stroke-dasharray": "1.5 2.5" };
      element(svg, "polyline", { points: points.join(" "), fill: "none", stroke: one.colour, ...style }, SVG);
    });
    cursor = element(svg, "line", { y1: top, y2: height - bottom, stroke: "#222", "stroke-width": 1.5 }, SVG);
    dots = panel.series.map((one) => element(svg, "circle", { r: one.c === 0 ? 4 : 2.5, fill: one.colour, stroke: "#fff" }, SVG));
  }
  let dots = [];
  function show(clock, states) {
    if (!cursor) return;
    cursor.setAttribute("x1", x(clock));
    cursor.setAttribute("x2", x(clock));
    panel.series.forEach((one, i) => {
      dots[i].setAttribute("cx", x(clock));
      dots[i].setAttribute("cy", y(between(one.values, states[one.c], one.k)));
    });
    outputs.forEach(([one, output]) => { output.textContent = degrees(between(one.values, states[0], one.k)); });
  }
  const drag = (event) => {
    const bounds = svg.getBoundingClientRect();
    const share = (event.clientX - bounds.left - left) / (bounds.width - left - right);
    scrub(Math.min(1, Math.max(0, share)));
  };
  svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); drag(event); });
  svg.addEventListener("pointermove", (event) => { if (event.buttons) drag(event); });
  return { resize, show };
}

// Round values from low to high, at most `most` steps.
function ticks(low, high, most, steps) {
  const span = high - low;
  let step = steps.find((one) => span / one <= most);
  if (step === undefined || span < steps[0] * 2) {
    const decade = 10 ** Math.floor(Math.log10(span / most));
    step = [1, 2, 5, 10].map((one) => one * decade).find((one) => span / one <= most);
  }
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; k += 1) found.push(k * step);
  return found;
}
