// A chain of segments in typed arrays; CCD turns segments by an angle about an axis in the world.
const serve = require("./serve.js");

class Chain {
  constructor({ parents, offsets, local_rotations, effector }) {
    this.parents = parents;
    this.offsets = offsets.map((o) => Float64Array.from(o));
    this.local = local_rotations.map((q) => Float64Array.from(q));
    this.path = [];
    for (let j = effector; j !== -1; j = parents[j]) this.path.push(j);
    this.path.reverse();
    this.update();
  }

  update() {
    this.position = [];
    this.world = [];
    for (let j = 0; j < this.parents.length; j++) {
      const parent = this.parents[j];
      if (parent === -1) {
        this.position.push(this.offsets[j]);
        this.world.push(this.local[j]);
        continue;
      }
      const moved = rotated(this.offsets[j], this.world[parent]);
      this.position.push(this.position[parent].map((x, k) => x + moved[k]));
      this.world.push(hamilton(this.world[parent], this.local[j]));
    }
  }

  turn(j, axis, angle) {
    const s = Math.sin(angle / 2);
    const q = [Math.cos(angle / 2), axis[0] * s, axis[1] * s, axis[2] * s];
    const world = hamilton(q, this.world[j]);
    const above = this.world[this.parents[j]];
    this.local[j] = hamilton([above[0], -above[1], -above[2], -above[3]], world);
    this.update();
  }
}

function hamilton(a, b) {
  return Float64Array.of(
    a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
    a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
    a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
    a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]);
}

function rotated(v, q) {
  const p = hamilton(hamilton(q, [0, ...v]), [q[0], -q[1], -q[2], -q[3]]);
  return p.slice(1);
}

function unit(v) {
  const n = Math.hypot(...v);
  return v.map((x) => x / n);
}

function inverse_kinematics(request) {
  const chain = new Chain(request), { target, tolerance, effector } = request;
  const distance = () => Math.hypot(...chain.position[effector].map((x, k) => x - target[k]));
  let iterations = 0;
  while (iterations < request.max_iterations && (iterations === 0 || distance() > tolerance)) {
    for (let i = chain.path.length - 2; i > 0; i--) {
      const pivot = chain.position[chain.path[i]];
      const e = unit(chain.position[effector].map((x, k) => x - pivot[k]));
      const t = unit(Float64Array.from(target).map((x, k) => x - pivot[k]));
      const axis = [e[1] * t[2] - e[2] * t[1], e[2] * t[0] - e[0] * t[2], e[0] * t[1] - e[1] * t[0]];
      const sine = Math.hypot(...axis), cosine = e[0] * t[0] + e[1] * t[1] + e[2] * t[2];
      if (sine > 1e-9) chain.turn(chain.path[i], unit(axis), Math.atan2(sine, cosine));
    }
    iterations++;
  }
  return { local_rotations: chain.local, positions: chain.position, iterations };
}

serve({ name: "segments", language: "JavaScript", methods: ["ccd"] }, { inverse_kinematics });
