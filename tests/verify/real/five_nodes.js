// Nodes with x, y, z, w quaternions: world transforms and FABRIK; MISTAKE is 0 or 1 to 5.
const serve = require("./serve.js");
const MISTAKE = Number(process.env.MISTAKE || 0);

const sub = ([a, b, c], [d, e, f]) => [a - d, b - e, c - f];
const sum = ([a, b, c], [d, e, f]) => [a + d, b + e, c + f];
const times = (s, v) => v.map((x) => s * x);
const dot = (u, v) => u.reduce((t, x, i) => t + x * v[i], 0);
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const norm = (v) => Math.sqrt(dot(v, v));

function product([a, b, c, d], [e, f, g, h]) { // x, y, z, w
  const v = sum(sum(times(d, [e, f, g]), times(h, [a, b, c])), cross([a, b, c], [e, f, g]));
  return [...v, d * h - dot([a, b, c], [e, f, g])];
}
const inverse = ([x, y, z, w]) => [-x, -y, -z, w];
const rotate = (q, v) => product(product(q, [...v, 0]), inverse(q)).slice(0, 3);
const read = ([w, x, y, z]) => [x, y, z, w];
const write = (q) => (MISTAKE === 1 ? q : [q[3], q[0], q[1], q[2]]); // 1: x, y, z, w is answered

function worlds(nodes) {
  const done = [];
  for (const { parent, translation, rotation } of nodes) {
    const up = done[parent];
    if (!up) {
      done.push({ place: translation, turn: rotation });
    } else {
      const q = MISTAKE === 2 ? inverse(up.turn) : up.turn; // 2: offsets are turned back
      done.push({ place: sum(up.place, rotate(q, translation)), turn: product(up.turn, rotation) });
    }
  }
  return done;
}

const nodesOf = ({ parents, offsets, local_rotations }) => parents.map((parent, i) => (
  { parent, translation: offsets[i], rotation: read(local_rotations[i]) }));

function forward_kinematics(request) {
  const world = worlds(nodesOf(request));
  return { positions: world.map((w) => w.place), rotations: world.map((w) => write(w.turn)) };
}

function pull(still, moved, length) {
  const line = sub(moved, still);
  return sum(still, times(length / norm(line), line));
}

function fabrik(points, target, tolerance, limit) {
  const [root] = points, d = points.slice(1).map((p, i) => norm(sub(p, points[i])));
  let p = points;
  for (let n = 0; n < limit; n++) {
    p = p.reduceRight((back, q, i) => [i === d.length ? target : pull(back[0], q, d[i]), ...back], []);
    p = p.reduce((out, q, i) => [...out, i ? pull(out[i - 1], q, d[i - 1]) : root], []);
    if (norm(sub(p[d.length], target)) <= tolerance) break;
  }
  return p;
}

function arc(a, b) {
  const q = [...cross(a, b), norm(a) * norm(b) + dot(a, b)], n = norm(q);
  return n < 1e-12 ? [0, 0, 0, 1] : times(1 / n, q);
}

function inverse_kinematics(request) {
  const nodes = nodesOf(request), { effector, target, tolerance, max_iterations } = request;
  let path = [];
  for (let j = effector; j >= 0; j = nodes[j].parent) path.unshift(j);
  if (MISTAKE === 3) path = Array.from({ length: effector + 1 }, (_, i) => i); // 3: no tree
  const before = worlds(nodes);
  const points = fabrik(path.map((j) => before[j].place), target, tolerance, max_iterations);
  for (let i = 0; i + 1 < path.length; i++) {
    const world = worlds(nodes), node = nodes[path[i]];
    const now = sub(world[path[i + 1]].place, world[path[i]].place);
    const then = sub(points[i + 1], points[i]);
    const turn = MISTAKE === 4 ? arc(then, now) : arc(now, then); // 4: from the new to the old
    const wanted = product(turn, world[path[i]].turn);
    node.rotation = i ? product(inverse(world[node.parent].turn), wanted) : wanted;
  }
  const after = worlds(nodes).map((w) => w.place);
  if (MISTAKE === 5) before.forEach((w, j) => { if (!path.includes(j)) after[j] = w.place; }); // 5
  return { local_rotations: nodes.map((n) => write(n.rotation)), positions: after };
}

serve({ name: "nodes", language: "JavaScript", methods: ["fabrik"] },
  { forward_kinematics, inverse_kinematics });
