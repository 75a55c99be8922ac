// The page: texts, the slider, playing, and keys.
const RATES = [1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4, 8, 16];
const SECONDS = 7; // that a motion lasts at the speed one begins with, about
const PAUSE = 1; // at the end, before it starts again [s]

const find = (id) => document.getElementById(id);
const end = Math.max(...data.clips.map((clip) => clip.clock[clip.clock.length - 1])) || 1;
const realTime = data.timed ? 1 : end / SECONDS; // clock units in a second at speed 1
let rate = data.timed ? nearestRate(end / SECONDS) : RATES.indexOf(1);
let clock = 0, playing = false, before = 0, waited = 0;

const stage = makeStage(find("scene"), find("stage"));
const curves = makeCurves(find("curves"), end, (share) => { stop(); go(share * end); });
writeTexts();
resize();
stage.lookHome();
const asked = /[#&]at=([0-9.]+)/.exec(location.hash);
go(asked ? Math.min(1, Number(asked[1])) * end : 0);
new ResizeObserver(resize).observe(find("stage"));
new ResizeObserver(resize).observe(find("side"));
requestAnimationFrame(frame);

function nearestRate(wanted) {
  const far = RATES.map((one) => Math.abs(Math.log(one / wanted)));
  return far.indexOf(Math.min(...far));
}

function go(to) {
  clock = Math.min(end, Math.max(0, to));
  const states = data.clips.map((clip) => stateAt(clip, clock));
  stage.show(states);
  curves.show(clock, states);
  find("slider").value = clock / end;
  const there = data.timed ? `${clock.toFixed(digitsOf(end))} of ${+end.toPrecision(4)} s` : `${clock.toFixed(2)} of ${+end.toPrecision(4)} edges`;
  find("clock").textContent = there;
  find("slider").setAttribute("aria-valuetext", there);
}

function digitsOf(span) {
  return Math.max(0, 3 - Math.floor(Math.log10(span)));
}

function frame(now) {
  if (playing) {
    const passed = Math.min(0.1, (now - before) / 1000);
    if (clock >= end) {
      waited += passed;
      if (waited >= PAUSE) { waited = 0; go(0); }
    } else {
      go(clock + passed * realTime * RATES[rate]);
    }
  }
  before = now;
  stage.draw();
  requestAnimationFrame(frame);
}

function play() {
  if (clock >= end) go(0);
  waited = 0;
  playing = true;
  mark();
}
function stop() {
  playing = false;
  mark();
}
function mark() {
  find("play").textContent = playing ? "\u275a\u275a" : "\u25b6";
  find("play").setAttribute("aria-label", playing ? "Pause" : "Play");
}
function setRate(to) {
  rate = Math.min(RATES.length - 1, Math.max(0, to));
  const value = RATES[rate];
  find("speed").textContent = value < 1 ? `1/${Math.round(1 / value)} \u00d7` : `${value} \u00d7`;
}

function resize() {
  stage.resize();
  curves.resize();
  const states = data.clips.map((clip) => stateAt(clip, clock));
  curves.show(clock, states);
}

function writeTexts() {
  find("title").textContent = data.title;
  const first = data.clips[0], ghosts = data.clips.filter((clip) => clip.ghost);
  find("caption").textContent = [
    data.robots.map((robot) => `${robot.name}: ${robot.links.length} links, ${robot.joints.length} joints`).join("; "),
    data.timed ? `${+end.toPrecision(4)} s` : `${+end.toPrecision(4)} edges of a path, which has no time`,
    "free fall, centre of mass at rest",
    ...data.clips.slice(0, 1).filter((clip) => clip.nearest).map((clip) => `least clearance: ${clip.nearest.text}`),
  ].join(" \u00b7 ");
  const solid = data.clips.filter((clip) => !clip.ghost);
  if (solid.length > 1) solid.forEach((clip) => { element(find("labels"), "span").textContent = clip.label; });

  const legend = (style, colour, words) => {
    const row = element(find("legend"), "div");
    const sign = element(row, "i", { class: style });
    if (style === "box") sign.style.background = colour; else sign.style.borderColor = colour;
    element(row, "span").textContent = words;
    return row;
  };
  legend("box", data.robots[first.robot].links[0].colour, "base, " + data.robots[first.robot].links[0].name);
  legend("line", "#8b979f", "inertial X, Y, Z");
  if (first.nearest) legend("line", NEAR, "nearest parts");
  if (data.target) legend("ring", "#555", "target of the base's axes");
  ghosts.forEach((clip) => legend("box", "#b8bec2", `translucent: ${clip.label}`));

  const tools = find("tools");
  element(tools, "span").textContent = "track of";
  const buttons = data.axis_colours.map((colour, i) => {
    const button = element(tools, "button", { type: "button", "aria-pressed": "false" });
    button.textContent = "xyz"[i];
    button.style.color = colour;
    button.addEventListener("click", () => chooseAxis(i));
    return button;
  });
  function chooseAxis(i) {
    stage.axis = i;
    buttons.forEach((button, k) => button.setAttribute("aria-pressed", k === i));
    go(clock);
  }
  buttons[stage.axis].setAttribute("aria-pressed", "true");

  const table = find("numbers");
  if (data.clips.length > 1) {
    const head = element(element(table, "thead"), "tr");
    element(head, "th");
    data.clips.forEach((clip) => { element(head, "th").textContent = clip.label; });
  }
  const body = element(table, "tbody");
  data.table.forEach(([name, ...values]) => {
    const row = element(body, "tr");
    element(row, "th", { scope: "row" }).textContent = name;
    values.forEach((value) => { element(row, "td").textContent = value; });
  });
  data.notes.forEach((note) => { element(find("notes"), "li").textContent = note; });
  const help = [
    ["space", "play or pause"], ["\u2190 \u2192", "a hundredth back or on; with shift a tenth"], ["home, end", "first and last posture"],
    ["+ \u2212", "faster, slower"], ["x y z", "which axis of the base draws its track"], ["r", "look from where one began"],
    ["drag, scroll", "turn the view, zoom; drag in a curve to move along"],
    ["axes", "coloured: of the base, from the robot's centre of mass, which rests; grey: inertial. All on the sphere are directions, not places."],
    ["tilt, roll", "R = exp(tilt x, tilt y, 0) Rz(roll): a roll about z, then the shortest turn that brings z where it is"],
  ];
  if (data.timed) help.push(["speed", "1 \u00d7 is real time"]);
  help.forEach(([name, words]) => {
    element(find("help"), "dt").textContent = name;
    element(find("help"), "dd").textContent = words;
  });

  find("slider").addEventListener("input", (event) => { stop(); go(event.target.value * end); });
  find("play").addEventListener("click", () => (playing ? stop() : play()));
  find("slower").addEventListener("click", () => setRate(rate - 1));
  find("faster").addEventListener("click", () => setRate(rate + 1));
  setRate(rate);
  const step = (share) => { stop(); go(clock + share * end); };
  const keys = {
    " ": () => (playing ? stop() : play()),
    ArrowLeft: (event) => step(event.shiftKey ? -0.1 : -0.01),
    ArrowRight: (event) => step(event.shiftKey ? 0.1 : 0.01),
    Home: () => { stop(); go(0); },
    End: () => { stop(); go(end); },
    "+": () => setRate(rate + 1),
    "=": () => setRate(rate + 1),
    "-": () => setRate(rate - 1),
    r: () => stage.lookHome(),
    x: () => chooseAxis(0),
    y: () => chooseAxis(1),
    z: () => chooseAxis(2),
  };
  document.addEventListener("keydown", (event) => {
    const act = keys[event.key];
    const pressed = event.target.closest("button, summary") && (event.key === " " || event.key === "Enter");
    if (!act || pressed || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act(event);
  });
}

// For tests and for the console: what the scene shows, read back from it.
window.reojax = {
  samples: (clip = 0) => data.clips[clip].clock.length,
  clock: () => clock,
  playing: () => playing,
  // Distance of the two marked points of a clip, now.
  gap: (clip = 0) => stage.bodies[clip].nearest.gap(),
  speed: () => RATES[rate],
  // Move to sample i of a clip; its base's rotation and its links' frames, about the robot's centre of mass.
  poses(i, clip = 0) {
    if (Number.isInteger(i)) go(data.clips[clip].clock[i]);
    const body = stage.bodies[clip];
    body.root.updateMatrixWorld(true);
    const rows = (matrix) => [0, 1, 2].map((r) => [0, 1, 2].map((c) => matrix.elements[4 * c + r]));
    return {
      base: rows(body.root.matrixWorld),
      links: body.frames.map(({ matrixWorld }) => ({
        rotation: rows(matrixWorld), position: [12, 13, 14].map((k) => matrixWorld.elements[k]),
      })),
    };
  },
};
