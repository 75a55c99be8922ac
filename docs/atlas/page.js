
(() => {
"use strict";
// Poses of a robot: forward kinematics, and states between the samples of a clip.
const data = JSON.parse(document.getElementById("data").textContent);

// Matrices of all link frames in the base frame, shifted so that the whole robot's centre of mass is the origin.
function linkMatrices(robot, theta) {
  const frames = [new THREE.Matrix4()];
  const turn = new THREE.Quaternion(), one = new THREE.Vector3(1, 1, 1);
  robot.joints.forEach((joint, k) => {
    turn.setFromAxisAngle(new THREE.Vector3(...joint.axis), theta[k]);
    const step = new THREE.Matrix4().compose(new THREE.Vector3(...joint.anchor), turn, one);
    frames.push(new THREE.Matrix4().multiplyMatrices(frames[joint.parent], step));
  });
  const centre = new THREE.Vector3();
  let mass = 0;
  robot.links.forEach((link, k) => {
    centre.addScaledVector(new THREE.Vector3(...link.com).applyMatrix4(frames[k]), link.mass);
    mass += link.mass;
  });
  centre.divideScalar(mass);
  const shift = new THREE.Matrix4().makeTranslation(-centre.x, -centre.y, -centre.z);
  return frames.map((frame) => frame.premultiply(shift));
}

// State of a clip at a value of its clock: held before the first and after the last sample.
function stateAt(clip, clock) {
  const times = clip.clock, last = times.length - 1;
  let low = 0, high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= clock) low = middle; else high = middle;
  }
  const span = times[high] - times[low];
  const share = span > 0 ? Math.min(1, Math.max(0, (clock - times[low]) / span)) : 0;
  const theta = clip.theta[low].map((angle, k) => angle + share * (clip.theta[high][k] - angle));
  const rotation = new THREE.Quaternion(...clip.quaternion[low]).slerp(new THREE.Quaternion(...clip.quaternion[high]), share);
  return { theta, rotation, low, high, share };
}

function between(values, state, k) {
  const pick = (row) => (k === undefined ? row : row[k]);
  return pick(values[state.low]) * (1 - state.share) + pick(values[state.high]) * state.share;
}

// The robots in space: links, axes of base, target and inertial space, and the track of a body axis on a sphere.
const GHOST = "#4d5a63";
const NEAR = "#d4006a";

function makeStage(canvas, holder) {
  const clips = data.clips;
  const bodies = clips.map((clip) => makeBody(data.robots[clip.robot], clip));
  const reach = Math.max(...bodies.map((body) => body.reach));
  const rooms = clips.filter((clip) => !clip.ghost).map((clip) => makeRoom(reach));
  let solid = -1;
  clips.forEach((clip, k) => {
    if (!clip.ghost) solid += 1;
    bodies[k].room = rooms[clip.ghost ? 0 : solid];
    bodies[k].room.scene.add(bodies[k].root);
    bodies[k].axes = addTriad(bodies[k].root, reach, clip.ghost);
    bodies[k].tracks = makeTracks(clip, reach, bodies[k].room.scene);
  });

  let renderer = null;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    renderer.setScissorTest(true);
  } catch (error) {
    document.getElementById("missing").hidden = false;
    document.getElementById("legend").hidden = true;
    canvas.hidden = true;
  }

  const camera = new THREE.PerspectiveCamera(28, 1, reach / 100, reach * 100);
  const [, , eye] = data.camera;
  camera.up.set(...[0, 1, 2].map((i) => ("xyz"[i] === data.up ? 1 : 0)));
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.enablePan = false;
  controls.minDistance = reach * 1.2;
  controls.maxDistance = reach * 30;
  let dirty = true;
  controls.addEventListener("change", () => { dirty = true; });

  // Each motion has a room of its own beside or below the others, seen by one camera.
  function layout() {
    const width = holder.clientWidth, height = holder.clientHeight;
    const across = width >= height * 0.9 ? rooms.length : 1, down = rooms.length / across;
    return { width, height, w: width / across, h: height / down, across };
  }
  function lookHome() {
    const { w, h } = layout();
    const fit = (reach * (w < h ? 1.28 : 1.2)) / Math.sin((camera.fov * Math.PI) / 360) / Math.min(1, w / h);
    camera.position.set(...eye).multiplyScalar(fit);
    controls.target.set(0, 0, 0);
    controls.update();
    dirty = true;
  }
  function resize() {
    const { width, height, w, h, across } = layout();
    if (renderer) {
      renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      renderer.setSize(width, height, false);
    }
    camera.aspect = w / h;
    camera.updateProjectionMatrix();
    const labels = document.getElementById("labels");
    [...labels.children].forEach((label, k) => {
      label.style.left = `${((k % across) + 0.5) * w}px`;
      label.style.top = `${Math.floor(k / across) * h + 10}px`;
    });
    dirty = true;
  }
  function draw() {
    if (!dirty || !renderer) return;
    dirty = false;
    const { height, w, h, across } = layout();
    rooms.forEach((room, k) => {
      const x = (k % across) * w, y = height - (Math.floor(k / across) + 1) * h;
      renderer.setViewport(x, y, w, h);
      renderer.setScissor(x, y, w, h);
      room.light.position.copy(camera.position).addScaledVector(camera.up, reach * 3);
      renderer.render(room.scene, camera);
    });
  }
  let axis = longestTrack(clips[0]);
  function show(states) {
    bodies.forEach((body, k) => {
      body.pose(states[k]);
      body.tracks.forEach((track, i) => track.show(i === axis, states[k]));
    });
    dirty = true;
  }
  return {
    show, draw, resize, lookHome, bodies,
    get axis() { return axis; },
    set axis(value) { axis = value; },
  };
}

// A scene with light, the sphere on which tracks are drawn, inertial directions and the target.
function makeRoom(reach) {
  const scene = new THREE.Scene();
  scene.add(new THREE.HemisphereLight("#ffffff", "#9aa7b1", 2.1));
  const light = new THREE.DirectionalLight("#ffffff", 1.9);
  scene.add(light);
  const ball = new THREE.Mesh(
    new THREE.SphereGeometry(reach, 48, 32),
    new THREE.MeshBasicMaterial({ color: "#7f9db3", transparent: true, opacity: 0.07, depthWrite: false }),
  );
  scene.add(ball);
  scene.add(graticule(reach));
  [0, 1, 2].forEach((i) => {
    const along = new THREE.Vector3().setComponent(i, reach);
    scene.add(rod(along.clone().multiplyScalar(-1), along, reach * 0.004, "#8b979f"));
    const letter = text("XYZ"[i], "#6b7780", reach * 0.13);
    letter.position.copy(along).multiplyScalar(1.1);
    scene.add(letter);
  });
  if (data.target) addTarget(scene, reach);
  return { scene, light };
}

function graticule(radius) {
  const points = [];
  const up = "xyz".indexOf(data.up);
  const add = (from, to) => {
    for (let k = 0; k < 72; k += 1) points.push(from(k / 72, to), from((k + 1) / 72, to));
  };
  const place = (lift, around) => {
    const p = [0, 0, 0];
    p[up] = Math.sin(lift) * radius;
    p[(up + 1) % 3] = Math.cos(lift) * Math.cos(around) * radius;
    p[(up + 2) % 3] = Math.cos(lift) * Math.sin(around) * radius;
    return new THREE.Vector3(...p);
  };
  [-60, -30, 0, 30, 60].forEach((lift) => add((s, l) => place((l * Math.PI) / 180, 2 * Math.PI * s), lift));
  [0, 30, 60, 90, 120, 150].forEach((a) => add((s, t) => place(2 * Math.PI * s, (t * Math.PI) / 180), a));
  const lines = new THREE.BufferGeometry().setFromPoints(points);
  return new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ color: "#8aa3b5", transparent: true, opacity: 0.28 }));
}

function rod(start, end, radius, colour, opacity = 1) {
  const along = new THREE.Vector3().subVectors(end, start), length = along.length();
  const mesh = new THREE.Mesh(
    new THREE.CylinderGeometry(radius, radius, length, 10),
    new THREE.MeshBasicMaterial({ color: colour, transparent: opacity < 1, opacity }),
  );
  mesh.position.addVectors(start, end).multiplyScalar(0.5);
  if (length > 0) mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.divideScalar(length));
  return mesh;
}

function text(letter, colour, size) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 96;
  const pen = canvas.getContext("2d");
  pen.font = "bold 68px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.lineWidth = 10;
  pen.strokeStyle = "rgba(255,255,255,.9)";
  pen.strokeText(letter, 48, 50);
  pen.fillStyle = colour;
  pen.fillText(letter, 48, 50);
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = "srgb";
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false }));
  sprite.scale.setScalar(size);
  sprite.renderOrder = 10;
  return sprite;
}

// The base's axes x, y, z from the centre of mass to the sphere.
function addTriad(root, reach, ghost) {
  return data.axis_colours.map((colour, i) => {
    const along = new THREE.Vector3().setComponent(i, reach);
    const tone = ghost ? GHOST : colour;
    root.add(rod(new THREE.Vector3(), along, reach * (ghost ? 0.006 : 0.009), tone, ghost ? 0.55 : 1));
    const tip = new THREE.Mesh(
      new THREE.ConeGeometry(reach * 0.028, reach * 0.09, 16),
      new THREE.MeshBasicMaterial({ color: tone, transparent: ghost, opacity: ghost ? 0.6 : 1 }),
    );
    tip.position.copy(along).multiplyScalar(0.955);
    tip.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.clone().normalize());
    root.add(tip);
    if (!ghost) {
      const letter = text("xyz"[i], colour, reach * 0.16);
      letter.position.copy(along).multiplyScalar(1.1);
      root.add(letter);
    }
    return along;
  });
}

// Rings on the sphere where the target wants the tips of the base's axes.
function addTarget(scene, reach) {
  data.axis_colours.forEach((colour, i) => {
    const tip = new THREE.Vector3(...data.target.map((row) => row[i])).multiplyScalar(reach);
    const ring = new THREE.Mesh(
      new THREE.TorusGeometry(reach * 0.06, reach * 0.01, 10, 40),
      new THREE.MeshBasicMaterial({ color: colour }),
    );
    ring.position.copy(tip);
    ring.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), tip.clone().normalize());
    scene.add(ring);
    scene.add(rod(tip.clone().multiplyScalar(0.86), tip, reach * 0.005, colour));
  });
}

// A robot: link shapes in frames that `pose` sets.
function makeBody(robot, clip) {
  const root = new THREE.Group(), frames = [];
  robot.links.forEach((link, k) => {
    const frame = new THREE.Group();
    frame.matrixAutoUpdate = false;
    const skin = clip.ghost
      ? new THREE.MeshStandardMaterial({ color: GHOST, transparent: true, opacity: 0.3, depthWrite: false, roughness: 0.8,
          polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 })
      : new THREE.MeshStandardMaterial({ color: link.colour, roughness: 0.55, metalness: 0.05,
          polygonOffset: true, polygonOffsetFactor: 0.5 * k, polygonOffsetUnits: 8 * k }); // links may fill the same space
    link.capsules.forEach(([start, end, radius]) => frame.add(capsule(start, end, radius, skin)));
    if (link.faces.length) frame.add(new THREE.Mesh(quads(link.faces), skin));
    if (link.pin.length && !link.capsules.length && !clip.ghost) {
      frame.add(new THREE.Mesh(quads(link.pin), new THREE.MeshStandardMaterial({ color: robot.ink, roughness: 0.5 })));
    }
    root.add(frame);
    frames.push(frame);
  });
  const nearest = clip.nearest ? makeNearest(root, clip.nearest, robot.size) : null;
  function pose(state) {
    root.quaternion.copy(state.rotation);
    linkMatrices(robot, state.theta).forEach((matrix, k) => {
      frames[k].matrix.copy(matrix);
      frames[k].matrixWorldNeedsUpdate = true;
    });
    if (nearest) nearest.pose(frames);
  }
  // How far the robot reaches from its centre of mass in any sampled posture.
  let reach = 0;
  const corner = new THREE.Vector3();
  const every = Math.max(1, Math.floor(clip.theta.length / 40));
  for (let i = 0; i < clip.theta.length; i += every) {
    linkMatrices(robot, clip.theta[i]).forEach((matrix, k) => {
      frames[k].children.forEach((mesh) => {
        mesh.updateMatrix();
        const points = mesh.geometry.getAttribute("position");
        for (let at = 0; at < points.count; at += 3) {
          reach = Math.max(reach, corner.fromBufferAttribute(points, at).applyMatrix4(mesh.matrix).applyMatrix4(matrix).length());
        }
      });
    });
  }
  return { root, frames, pose, nearest, reach: reach * 1.02 || robot.size };
}

// The two points of the surfaces that come nearest to each other in this motion, on their links, joined by a line.
function makeNearest(root, nearest, size) {
  const skin = new THREE.MeshBasicMaterial({ color: NEAR, depthTest: false, transparent: true });
  const dots = nearest.points.map(() => new THREE.Mesh(new THREE.SphereGeometry(size * 0.012, 16, 12), skin));
  const line = new THREE.Line(
    new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(1, 0, 0)]),
    new THREE.LineBasicMaterial({ color: NEAR, depthTest: false, transparent: true }),
  );
  line.frustumCulled = false;
  [line, ...dots].forEach((part) => { part.renderOrder = 5; root.add(part); });
  function pose(frames) {
    const ends = line.geometry.getAttribute("position");
    dots.forEach((dot, i) => {
      dot.position.set(...nearest.points[i]).applyMatrix4(frames[nearest.links[i]].matrix);
      ends.setXYZ(i, dot.position.x, dot.position.y, dot.position.z);
    });
    ends.needsUpdate = true;
  }
  return { pose, gap: () => dots[0].position.distanceTo(dots[1].position) };
}

function capsule(start, end, radius, skin) {
  const a = new THREE.Vector3(...start), b = new THREE.Vector3(...end);
  const along = new THREE.Vector3().subVectors(b, a), length = along.length();
  const mesh = new THREE.Mesh(new THREE.CapsuleGeometry(radius, length, 12, 28), skin);
  mesh.position.addVectors(a, b).multiplyScalar(0.5);
  if (length > 0) mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.divideScalar(length));
  return mesh;
}

// Quadrilaterals as triangles, round parts shaded round.
function quads(corners) {
  const points = [];
  for (let at = 0; at < corners.length; at += 12) {
    [0, 1, 2, 0, 2, 3].forEach((k) => points.push(...corners.slice(at + 3 * k, at + 3 * k + 3)));
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  geometry.computeBoundingSphere();
  const unit = 1000 / Math.max(geometry.boundingSphere.radius, 1e-12); // what follows takes points within 0.01 for one
  return THREE.toCreasedNormals(geometry.scale(unit, unit, unit), Math.PI / 5).scale(1 / unit, 1 / unit, 1 / unit);
}

// Of each body axis, the way its tip goes on the sphere: pale all along, strong as far as it has come.
function makeTracks(clip, reach, scene) {
  return data.axis_colours.map((colour, i) => {
    const points = clip.quaternion.map((q) =>
      new THREE.Vector3().setComponent(i, reach).applyQuaternion(new THREE.Quaternion(...q)));
    const tone = clip.ghost ? GHOST : colour;
    const whole = new THREE.Line(
      new THREE.BufferGeometry().setFromPoints(points),
      new THREE.LineBasicMaterial({ color: tone, transparent: true, opacity: 0.45 }),
    );
    const tube = ribbon(points, reach * (clip.ghost ? 0.006 : 0.011), tone, clip.ghost ? 0.6 : 1);
    scene.add(whole, tube);
    return {
      show(visible, state) {
        whole.visible = tube.visible = visible;
        tube.geometry.setDrawRange(0, tube.perStep * (state.low + state.share));
      },
    };
  });
}

// A six-sided tube along points on a sphere about the origin.
function ribbon(points, radius, colour, opacity) {
  const sides = 6, corners = [], index = [];
  points.forEach((point, k) => {
    const ahead = points[Math.min(k + 1, points.length - 1)], behind = points[Math.max(k - 1, 0)];
    const outward = point.clone().normalize();
    const side = new THREE.Vector3().subVectors(ahead, behind).cross(outward);
    if (side.length() > 1e-9 * point.length()) side.normalize();
    else side.set(outward.y, outward.z, outward.x).cross(outward).normalize();
    for (let s = 0; s < sides; s += 1) {
      const turn = (2 * Math.PI * s) / sides;
      const corner = point.clone().addScaledVector(outward, radius * Math.cos(turn));
      corners.push(...corner.addScaledVector(side, radius * Math.sin(turn)).toArray());
    }
    if (k) {
      for (let s = 0; s < sides; s += 1) {
        const a = (k - 1) * sides + s, b = (k - 1) * sides + ((s + 1) % sides);
        index.push(a, b, a + sides, b, b + sides, a + sides);
      }
    }
  });
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  geometry.setIndex(index);
  const tube = new THREE.Mesh(geometry,
    new THREE.MeshBasicMaterial({ color: colour, side: THREE.DoubleSide, transparent: opacity < 1, opacity }));
  tube.perStep = sides * 6;
  tube.frustumCulled = false;
  return tube;
}

// The body axis whose tip goes farthest.
function longestTrack(clip) {
  const lengths = [0, 1, 2].map((i) => {
    let length = 0, last = null;
    clip.quaternion.forEach((q) => {
      const tip = new THREE.Vector3().setComponent(i, 1).applyQuaternion(new THREE.Quaternion(...q));
      if (last) length += tip.distanceTo(last);
      last = tip;
    });
    return length;
  });
  return lengths.indexOf(Math.max(...lengths));
}

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

})();
