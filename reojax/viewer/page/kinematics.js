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
