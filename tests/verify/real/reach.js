// FABRIK on plain arrays; whether a target is within reach is measured from the origin.
const serve = require("./serve.js");

const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.sqrt(dot(a, a));
const toward = (from, to, distance) => add(from, add(to, from, -1), distance / length(add(to, from, -1)));
const mul = ([w, ...v], [s, ...u]) => [w * s - dot(v, u), ...add(add(cross(v, u), u, w), v, s)];
const conj = ([w, x, y, z]) => [w, -x, -y, -z];
const rotate = (q, v) => mul(mul(q, [0, ...v]), conj(q)).slice(1);

function forward({ parents, offsets }, local) {
  const p = [], r = [];
  parents.forEach((parent, i) => {
    p[i] = parent < 0 ? offsets[i] : add(p[parent], rotate(r[parent], offsets[i]));
    r[i] = parent < 0 ? local[i] : mul(r[parent], local[i]);
  });
  return [p, r];
}

function solvePoints(points, target, tolerance, limit) {
  const lengths = points.slice(1).map((p, i) => length(add(p, points[i], -1)));
  const last = lengths.length;
  if (length(target) > lengths.reduce((a, b) => a + b, 0)) {
    for (let i = 0; i < last; i++) points[i + 1] = toward(points[i], target, lengths[i]);
    return 1;
  }
  const root = points[0];
  for (let iteration = 1; ; iteration++) {
    points[last] = target;
    for (let i = last - 1; i >= 0; i--) points[i] = toward(points[i + 1], points[i], lengths[i]);
    points[0] = root;
    for (let i = 0; i < last; i++) points[i + 1] = toward(points[i], points[i + 1], lengths[i]);
    if (length(add(points[last], target, -1)) <= tolerance || iteration >= limit) return iteration;
  }
}

function arc(a, b) {
  const q = [length(a) * length(b) + dot(a, b), ...cross(a, b)];
  const n = Math.hypot(...q);
  return n > 1e-12 ? q.map((x) => x / n) : [1, 0, 0, 0];
}

function inverse_kinematics(request) {
  const { parents, effector, target, tolerance, max_iterations } = request;
  const path = [];
  for (let j = effector; j >= 0; j = parents[j]) path.unshift(j);
  const local = request.local_rotations.map((q) => [...q]);
  const points = path.map((j) => forward(request, local)[0][j]);
  const iterations = solvePoints(points, target, tolerance, max_iterations);
  for (let i = 0; i + 1 < path.length; i++) {
    const [p, r] = forward(request, local), j = path[i];
    const turn = arc(add(p[path[i + 1]], p[j], -1), add(points[i + 1], points[i], -1));
    const world = mul(turn, r[j]);
    const q = i ? mul(conj(r[path[i - 1]]), world) : world;
    local[j] = q.map((x) => x / Math.hypot(...q));
  }
  return { local_rotations: local, positions: forward(request, local)[0], iterations };
}

serve({ name: "reach", language: "JavaScript", methods: ["fabrik"] }, { inverse_kinematics });
