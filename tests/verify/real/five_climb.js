// CCD on joints that climb to the root whenever their place is asked; MISTAKE is 0 or 1 to 5.
const serve = require("./serve.js");
const MISTAKE = Number(process.env.MISTAKE || 0);

const quat = {
  mul(a, b) {
    return { w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
      x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
      z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w };
  },
  inv: (q) => ({ w: q.w, x: -q.x, y: -q.y, z: -q.z }),
  act(q, v) {
    const { x, y, z } = quat.mul(quat.mul(q, { w: 0, ...v }), quat.inv(q));
    return { x, y, z };
  },
  about(axis, angle) {
    const half = MISTAKE === 1 ? angle : angle / 2; // 1: the angle is not halved
    const s = Math.sin(half);
    return { w: Math.cos(half), x: axis.x * s, y: axis.y * s, z: axis.z * s };
  },
};
const minus = (a, b) => ({ x: a.x - b.x, y: a.y - b.y, z: a.z - b.z });
const plus = (a, b) => ({ x: a.x + b.x, y: a.y + b.y, z: a.z + b.z });
const dot = (a, b) => a.x * b.x + a.y * b.y + a.z * b.z;
const cross = (a, b) => ({
  x: a.y * b.z - a.z * b.y, y: a.z * b.x - a.x * b.z, z: a.x * b.y - a.y * b.x });
const over = (a, s) => ({ x: a.x / s, y: a.y / s, z: a.z / s });
const size = (a) => Math.sqrt(dot(a, a));

class Joint {
  constructor(parent, [x, y, z], [w, i, j, k]) {
    Object.assign(this, { parent, offset: { x, y, z }, local: { w, x: i, y: j, z: k } });
  }
  turn() { return this.parent ? quat.mul(this.parent.turn(), this.local) : this.local; }
  place() {
    if (!this.parent) return this.offset;
    return plus(this.parent.place(), quat.act(this.parent.turn(), this.offset));
  }
}

function aim(joint, tip, goal) {
  const pivot = joint.place();
  const a = minus(tip, pivot), b = minus(goal, pivot), axis = cross(a, b), n = size(axis);
  if (n < 1e-10) return;
  const q = quat.about(over(axis, n), Math.atan2(n, dot(a, b)));
  if (MISTAKE === 2) { // 2: the axis of the world is used in the joint's own frame
    joint.local = quat.mul(joint.local, q);
  } else {
    const world = quat.mul(q, joint.turn());
    joint.local = joint.parent ? quat.mul(quat.inv(joint.parent.turn()), world) : world;
  }
}

function inverse_kinematics({ parents, offsets, local_rotations, target, ...rest }) {
  const joints = [];
  parents.forEach((p, i) => joints.push(new Joint(joints[p], offsets[i], local_rotations[i])));
  const tip = joints[rest.effector], path = [];
  let goal = { x: target[0], y: target[1], z: target[2] };
  if (MISTAKE === 3) goal = plus(goal, joints[0].offset); // 3: the target is taken from the root
  for (let j = tip.parent; j; j = j.parent) path.push(j);
  if (MISTAKE === 4) path.reverse(); // 4: the root is turned first
  for (let sweep = 0; sweep < rest.max_iterations; sweep++) {
    const old = tip.place();
    for (const joint of path) aim(joint, MISTAKE === 5 ? old : tip.place(), goal); // 5: stale
    if (size(minus(tip.place(), goal)) <= rest.tolerance) break;
  }
  return { local_rotations: joints.map(({ local: { w, x, y, z } }) => [w, x, y, z]) };
}

serve({ name: "climbing", language: "JavaScript", methods: ["ccd"] }, { inverse_kinematics });
