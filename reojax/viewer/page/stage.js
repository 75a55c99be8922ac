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
