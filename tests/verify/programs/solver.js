// A right solver of the lab in JavaScript with faults planted in it: node solver.js --fault NAME.
// The step is ten local/global iterations from y (Liu et al. 2013); a damper is a spring of
// stiffness c/h whose length at rest is the one before the step; pins are eliminated.
const readline = require("node:readline");
const send = process.stdout.write.bind(process.stdout);
process.stdout.write = process.stderr.write.bind(process.stderr);

const FAULT = process.argv[2] === "--fault" ? process.argv[3] : "";
const planted = (name) => name === FAULT;
const ITERATIONS = 10;

const add = (a, b) => a.map((one, i) => one + b[i]);
const sub = (a, b) => a.map((one, i) => one - b[i]);
const times = (s, a) => a.map((one) => s * one);
const dot = (a, b) => a.reduce((sum, one, i) => sum + one * b[i], 0);
const norm = (a) => Math.sqrt(dot(a, a));
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];

function multiply([a, b, c, d], [e, f, g, h]) {
  return [
    a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
  ];
}
const inverse = ([w, x, y, z]) => [w, -x, -y, -z];
const unit = (a) => times(1 / norm(a), a);

function rotate(rotation, v) {
  const q = planted("fk_inverse_rotation") ? inverse(rotation) : rotation;
  return multiply(multiply(q, [0, ...v]), inverse(q)).slice(1);
}

function perpendicular(a) {
  const sizes = a.map(Math.abs);
  const axis = [0, 0, 0];
  axis[sizes.indexOf(Math.min(...sizes))] = 1;
  return unit(cross(a, axis));
}

// The smallest rotation from one direction to another.
function between(from, to) {
  if (norm(from) === 0 || norm(to) === 0) return [1, 0, 0, 0];
  const a = unit(from);
  const b = unit(to);
  const half = add(a, b);
  if (norm(half) < 1e-14) return [0, ...perpendicular(a)];
  const h = unit(half);
  return unit([dot(a, h), ...cross(a, h)]);
}

class Arm {
  constructor({ parents, offsets, local_rotations }) {
    this.parents = parents;
    this.offsets = offsets;
    this.local = local_rotations.map((q) => [...q]);
    this.forward();
  }

  forward() {
    this.rotations = [];
    this.positions = [];
    this.parents.forEach((parent, joint) => {
      const [offset, q] = [this.offsets[joint], this.local[joint]];
      if (parent < 0) {
        this.rotations.push(q);
        this.positions.push(offset);
        return;
      }
      this.rotations.push(multiply(this.rotations[parent], q));
      let link = rotate(this.rotations[parent], offset);
      if (planted("fk_local_rotation")) link = rotate(this.local[parent], offset);
      if (planted("fk_offset_unrotated")) link = offset;
      this.positions.push(add(this.positions[parent], link));
    });
  }

  chain(effector) { // from the root
    const joints = [];
    for (let j = effector; j >= 0; j = this.parents[j]) joints.unshift(j);
    return joints;
  }

  above(joint) {
    const parent = this.parents[joint];
    return parent < 0 ? [1, 0, 0, 0] : this.rotations[parent];
  }

  turn(joint, world) { // about global axes
    const parent = this.above(joint);
    const local = multiply(inverse(parent), multiply(world, parent));
    this.local[joint] = unit(multiply(local, this.local[joint]));
    this.forward();
  }

  reach(joints) {
    return joints.slice(1).reduce((sum, joint) => sum + norm(this.offsets[joint]), 0);
  }

  // Bend a chain that lies on one line with a target within reach: it would be stuck.
  unstick(joints, target) {
    const root = this.positions[joints[0]];
    const tip = this.positions[joints[joints.length - 1]];
    const to = sub(target, root);
    const line = norm(to) > 0 ? to : sub(tip, root);
    if (norm(line) === 0 || norm(to) >= this.reach(joints)) return;
    const off = joints.map((j) => norm(cross(unit(line), sub(this.positions[j], root))));
    if (Math.max(...off) > 1e-12 * this.reach(joints)) return;
    const axis = times(Math.sin(0.1), perpendicular(line));
    joints.slice(0, -1).forEach((joint) => this.turn(joint, [Math.cos(0.1), ...axis]));
  }
}

function ccdJoint(arm, joint, effector, target, seen) {
  const from = sub(seen, arm.positions[joint]);
  const to = sub(target, arm.positions[joint]);
  const world = planted("ccd_backwards") ? between(to, from) : between(from, to);
  const child = arm.chain(effector).find((one) => arm.parents[one] === joint);
  if (planted("ccd_world_left")) arm.local[joint] = unit(multiply(world, arm.local[joint]));
  else if (planted("ccd_world_right")) arm.local[joint] = unit(multiply(arm.local[joint], world));
  else if (planted("ccd_child")) arm.turn(child, world);
  else arm.turn(joint, world);
  arm.forward();
}

function ccd(arm, target, effector, tolerance, most) {
  const joints = arm.chain(effector);
  const order = planted("ccd_root_to_tip") ? joints.slice(0, -1) : joints.slice(0, -1).reverse();
  if (most > 1) arm.unstick(joints, target);
  for (let iterations = 0; ; ++iterations) {
    const residual = norm(sub(target, arm.positions[effector]));
    if (residual <= tolerance || iterations === most) {
      return { residual, iterations, converged: residual <= tolerance };
    }
    const start = arm.positions[effector];
    if (planted("ccd_tip")) { // the direction from the tip to itself is 0/0
      const none = unit(sub(start, start));
      arm.local[effector] = multiply([1, ...none], arm.local[effector]);
    }
    for (const joint of order) {
      ccdJoint(arm, joint, effector, target, planted("ccd_stale") ? start : arm.positions[effector]);
    }
  }
}

function toward(from, to, length) {
  const apart = sub(to, from);
  return add(from, norm(apart) > 0 ? times(length / norm(apart), apart) : [0, length, 0]);
}

function fabrik(arm, target, effector, tolerance, most) {
  const joints = arm.chain(effector);
  if (most > 1) arm.unstick(joints, target);
  const p = joints.map((joint) => arm.positions[joint]);
  const length = joints.map((joint) => norm(arm.offsets[joint]));
  const root = p[0];
  const tip = p.length - 1;
  let [iterations, residual] = [0, norm(sub(p[tip], target))];
  for (; residual > tolerance && iterations < most && tip > 0; ++iterations) {
    p[tip] = target;
    for (let i = tip - 1; i >= 0; --i) p[i] = toward(p[i + 1], p[i], length[i + 1]);
    if (!planted("fabrik_root")) p[0] = root;
    for (let i = 1; i <= tip; ++i) {
      p[i] = toward(p[i - 1], p[i], length[planted("fabrik_link") ? Math.max(1, i - 1) : i]);
    }
    residual = norm(sub(p[tip], target));
  }
  for (let i = 0; i < tip; ++i) {
    const wanted = sub(p[i + 1], p[i]);
    if (planted("fabrik_global_rotations")) {
      arm.local[joints[i]] = between(arm.offsets[joints[i + 1]], wanted);
    } else {
      arm.turn(joints[i], between(sub(arm.positions[joints[i + 1]], arm.positions[joints[i]]), wanted));
    }
  }
  joints.forEach((joint, i) => { arm.positions[joint] = p[i]; });
  return { residual, iterations, converged: residual <= tolerance };
}

function solveTarget(arm, request, target) {
  const solver = request.method === "fabrik" ? fabrik : ccd;
  return solver(arm, target, request.effector, request.tolerance, request.max_iterations);
}

function resample({ curve, closed, count, spacing }) {
  const points = closed ? [...curve, curve[0]] : curve;
  const s = [0];
  for (let i = 1; i < points.length; ++i) s.push(s[i - 1] + norm(sub(points[i], points[i - 1])));
  const total = s[s.length - 1];
  const many = count ?? Math.ceil(total / spacing - 1e-12) + (closed ? 0 : 1);
  const pieces = closed || planted("resample_end_missing") ? many : Math.max(1, many - 1);
  return Array.from({ length: many }, (_, i) => {
    const at = (total * i) / pieces;
    let j = 0;
    while (j + 2 < s.length && s[j + 1] < at) ++j;
    const piece = s.length > 1 ? s[j + 1] - s[j] : 0;
    if (piece === 0) return points[j];
    const part = Math.min(1, (at - s[j]) / piece);
    return add(times(1 - part, points[j]), times(part, points[j + 1]));
  });
}

function forces(system) {
  const { masses, springs, rest_lengths, stiffnesses, dampings, gravity } = system;
  const { positions: x, velocities: v } = system;
  const f = masses.map((m) => times(planted("forces_mass_twice") ? m * m : m, gravity));
  springs.forEach(([i, j], s) => {
    const apart = sub(x[i], x[j]);
    const length = norm(apart);
    if (length === 0) return;
    const u = times(1 / length, apart);
    let damping = dampings[s] * dot(sub(v[i], v[j]), u);
    if (planted("forces_damping_absent")) damping = 0;
    const pull = times(stiffnesses[s] * (length - rest_lengths[s]) + damping, u);
    f[i] = sub(f[i], pull);
    f[j] = add(f[j], pull);
  });
  return { forces: f };
}

function energy(system) {
  const { masses, springs, rest_lengths, stiffnesses, gravity, positions, velocities } = system;
  const sum = (list) => list.reduce((total, one) => total + one, 0);
  const kinetic = sum(masses.map((m, i) => (m / 2) * dot(velocities[i], velocities[i])));
  const sign = planted("energy_gravity_sign") ? 1 : -1;
  const gravitational = sign * sum(masses.map((m, i) => m * dot(gravity, positions[i])));
  const elastic = sum(springs.map(([i, j], s) =>
    (stiffnesses[s] / 2) * (norm(sub(positions[i], positions[j])) - rest_lengths[s]) ** 2));
  const potential = elastic + gravitational;
  return { total: kinetic + potential, kinetic, potential, elastic, gravitational };
}

// The lower Cholesky factor of M + h^2 L between free particles, rows from their first entry.
function factorise(A) {
  A.forEach((row, i) => {
    let first = 0;
    while (first < i && row[first] === 0) ++first;
    for (let j = first; j <= i; ++j) {
      let sum = row[j];
      for (let k = first; k < j; ++k) sum -= row[k] * A[j][k];
      row[j] = i === j ? Math.sqrt(sum) : sum / A[j][j];
    }
  });
  return A;
}

function substitute(factor, b) {
  const x = [...b];
  factor.forEach((row, i) => {
    for (let k = 0; k < i; ++k) x[i] -= row[k] * x[k];
    x[i] /= row[i];
  });
  for (let i = x.length - 1; i >= 0; --i) {
    x[i] /= factor[i][i];
    for (let k = 0; k < i; ++k) x[k] -= factor[i][k] * x[i];
  }
  return x;
}

const factors = new Map();

function factorOf(system, h, free, k) {
  const { masses, springs, stiffnesses, dampings } = system;
  const step = planted("step_stale_factor") ? 0 : h;
  const key = JSON.stringify([masses, springs, stiffnesses, dampings, step, free]);
  if (factors.has(key)) return factors.get(key);
  const row = new Map(free.map((particle, i) => [particle, i]));
  const A = free.map((i) => new Float64Array(free.length));
  free.forEach((particle, i) => { A[i][i] = planted("step_laplacian") ? 0 : masses[particle]; });
  springs.forEach(([i, j], s) => {
    const [a, b, stiffness] = [row.get(i), row.get(j), h * h * k[s]];
    if (a !== undefined) A[a][a] += stiffness;
    if (b !== undefined) A[b][b] += stiffness;
    if (a === undefined || b === undefined) return;
    A[a][b] -= stiffness;
    A[b][a] -= stiffness;
  });
  factors.clear();
  factors.set(key, factorise(A));
  return factors.get(key);
}

function localGlobal(system, h, y) {
  const { masses, springs, rest_lengths, stiffnesses, dampings, pinned, positions } = system;
  const held = new Set(planted("step_pins_free") || planted("step_pins_overwritten") ? [] : pinned);
  const free = masses.map((_, i) => i).filter((i) => !held.has(i));
  const more = planted("step_damping_twice") ? 2 : 1;
  const c = dampings.map((one) => (planted("step_damping_absent") ? 0 : (more * one) / h));
  const k = stiffnesses.map((one, s) => one + c[s]);
  const before = springs.map(([i, j]) => norm(sub(positions[i], positions[j])));
  const factor = factorOf(system, h, free, k);
  const fall = planted("step_gravity_h") ? h : h * h;
  let x = y.map((one, i) => (held.has(i) ? positions[i] : one));
  if (planted("step_from_x_n")) x = positions;
  if (planted("step_random_start")) {
    x = x.map((p, i) => (held.has(i) ? p : p.map((one) => one + 0.01 * (Math.random() - 0.5))));
  }
  for (let n = planted("step_one_iteration") ? ITERATIONS - 1 : 0; n < ITERATIONS; ++n) {
    const b = masses.map((m, i) => times(m, add(y[i], times(fall, system.gravity))));
    springs.forEach(([i, j], s) => {
      const apart = sub(x[i], x[j]);
      const rest = stiffnesses[s] * rest_lengths[s] + c[s] * before[s];
      const d = norm(apart) > 0 ? times((h * h * rest) / norm(apart), apart) : [0, 0, 0];
      b[i] = add(b[i], d);
      b[j] = sub(b[j], d);
      if (held.has(j)) b[i] = add(b[i], times(h * h * k[s], positions[j]));
      if (held.has(i)) b[j] = add(b[j], times(h * h * k[s], positions[i]));
    });
    const columns = [0, 1, 2].map((axis) => substitute(factor, free.map((i) => b[i][axis])));
    const solved = [...x];
    free.forEach((particle, i) => { solved[particle] = columns.map((column) => column[i]); });
    x = solved;
  }
  return planted("step_pins_overwritten")
    ? x.map((one, i) => (pinned.includes(i) ? positions[i] : one)) : x;
}

function step(system) {
  const { positions, pinned, h } = system;
  const still = new Set(planted("step_pins_free") ? [] : pinned);
  const velocities = system.velocities.map((v, i) => (still.has(i) ? [0, 0, 0] : v));
  const y = positions.map((x, i) => add(x, times(h, velocities[i])));
  const x = localGlobal(system, h, y);
  const past = planted("step_velocity_from_y") ? y : positions;
  return { positions: x, velocities: x.map((one, i) => times(1 / h, sub(one, past[i]))) };
}

const tasks = {
  forward_kinematics(request) {
    const { positions, rotations } = new Arm(request);
    return { positions, rotations };
  },
  inverse_kinematics(request) {
    const arm = new Arm(request);
    const found = solveTarget(arm, request, request.target);
    return { local_rotations: arm.local, positions: arm.positions, ...found };
  },
  track(request) {
    const arm = new Arm(request);
    const frames = { local_rotations: [], positions: [] };
    for (const target of request.curve) {
      solveTarget(arm, request, target);
      frames.local_rotations.push([...arm.local]);
      frames.positions.push([...arm.positions]);
      arm.forward();
    }
    return frames;
  },
  resample: (request) => ({ points: resample(request) }),
  mass_spring_forces: forces,
  energy,
  mass_spring_step: step,
  mass_spring_motion(request) {
    const frames = { positions: [], velocities: [] };
    let state = { positions: request.positions, velocities: request.velocities };
    for (let n = 0; n < request.steps; ++n) {
      const next = step({ ...request, ...state });
      state = planted("motion_velocity_kept") ? { ...next, velocities: request.velocities } : next;
      frames.positions.push(next.positions);
      frames.velocities.push(next.velocities);
    }
    return frames;
  },
  greeting: () => ({
    protocol: 1, name: "lab in JavaScript", language: "JavaScript", precision: "double",
    methods: ["ccd", "fabrik"], tasks: Object.keys(tasks).filter((name) => name !== "greeting"),
    step: {
      method: "local_global", start: "y", iterations: ITERATIONS, substeps: 1,
      damper: "length_rate", pins: "eliminated", velocity: "displacement",
    },
  }),
};

function answer(request) {
  try {
    return tasks[request.task](request);
  } catch (error) {
    return { error: error.message };
  }
}

readline.createInterface({ input: process.stdin }).on("line", (line) => {
  const request = JSON.parse(line);
  send(JSON.stringify({ id: request.id, ...answer(request) }) + "\n");
});
