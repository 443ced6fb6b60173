// A scene graph of bones whose CCD turns each link in its own frame, as skinned characters do.
const serve = require("./serve.js");

class Quaternion {
  constructor(x = 0, y = 0, z = 0, w = 1) { Object.assign(this, { x, y, z, w }); }
  clone() { return new Quaternion(this.x, this.y, this.z, this.w); }
  invert() { return new Quaternion(-this.x, -this.y, -this.z, this.w); }
  multiply(q) {
    const { x, y, z, w } = this;
    return new Quaternion(
      x * q.w + w * q.x + y * q.z - z * q.y, y * q.w + w * q.y + z * q.x - x * q.z,
      z * q.w + w * q.z + x * q.y - y * q.x, w * q.w - x * q.x - y * q.y - z * q.z);
  }
  normalize() {
    const l = Math.hypot(this.x, this.y, this.z, this.w);
    return new Quaternion(this.x / l, this.y / l, this.z / l, this.w / l);
  }
  setFromAxisAngle(a, angle) {
    const s = Math.sin(angle / 2);
    return new Quaternion(a.x * s, a.y * s, a.z * s, Math.cos(angle / 2));
  }
}

class Vector3 {
  constructor(x, y, z) { Object.assign(this, { x, y, z }); }
  sub(v) { return new Vector3(this.x - v.x, this.y - v.y, this.z - v.z); }
  add(v) { return new Vector3(this.x + v.x, this.y + v.y, this.z + v.z); }
  dot(v) { return this.x * v.x + this.y * v.y + this.z * v.z; }
  cross(v) {
    return new Vector3(this.y * v.z - this.z * v.y, this.z * v.x - this.x * v.z,
      this.x * v.y - this.y * v.x);
  }
  normalize() {
    const l = Math.sqrt(this.dot(this)) || 1;
    return new Vector3(this.x / l, this.y / l, this.z / l);
  }
  applyQuaternion(q) {
    const r = q.multiply(new Quaternion(this.x, this.y, this.z, 0)).multiply(q.invert());
    return new Vector3(r.x, r.y, r.z);
  }
}

class Bone {
  constructor(position, quaternion) {
    Object.assign(this, { position, quaternion, parent: null, children: [] });
  }
  add(bone) { this.children.push(bone); bone.parent = this; }
  updateMatrixWorld() {
    const up = this.parent;
    this.worldQuaternion = up ? up.worldQuaternion.multiply(this.quaternion) : this.quaternion;
    this.worldPosition = up
      ? up.worldPosition.add(this.position.applyQuaternion(up.worldQuaternion)) : this.position;
    for (const child of this.children) child.updateMatrixWorld();
  }
}

function skeleton({ parents, offsets, local_rotations }) {
  const bones = offsets.map((offset, i) => {
    const [w, x, y, z] = local_rotations[i];
    return new Bone(new Vector3(...offset), new Quaternion(x, y, z, w));
  });
  bones.forEach((bone, i) => { if (parents[i] >= 0) bones[parents[i]].add(bone); });
  bones[0].updateMatrixWorld();
  return bones;
}

const list = (q) => [q.w, q.x, q.y, q.z];

function ccd(request) {
  const bones = skeleton(request), tip = bones[request.effector];
  const goal = new Vector3(...request.target);
  let sweep = 0, miss;
  for (; sweep < request.max_iterations; sweep++) {
    for (let link = tip.parent; link; link = link.parent) {
      const inverse = link.worldQuaternion.invert();
      const effector = tip.worldPosition.sub(link.worldPosition).applyQuaternion(inverse).normalize();
      const target = goal.sub(link.worldPosition).applyQuaternion(inverse).normalize();
      const angle = Math.acos(Math.min(1, Math.max(-1, target.dot(effector))));
      if (angle < 1e-9) continue;
      const axis = effector.cross(target).normalize();
      const q = new Quaternion().setFromAxisAngle(axis, angle);
      link.quaternion = link.quaternion.multiply(q).normalize();
      link.updateMatrixWorld();
    }
    miss = tip.worldPosition.sub(goal);
    if (Math.sqrt(miss.dot(miss)) <= request.tolerance) { sweep++; break; }
  }
  return { local_rotations: bones.map((b) => list(b.quaternion)), iterations: sweep };
}

serve({ name: "bones", language: "JavaScript", methods: ["ccd"] }, { inverse_kinematics: ccd });
