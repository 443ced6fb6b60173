// Nodes with translation and rotation (x, y, z, w), and world matrices of 16 numbers by columns.
const serve = require("./serve.js");

function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return out;
}

function fromTranslation([x, y, z]) {
  return new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1]);
}

function fromRotation([x, y, z, w]) {
  return new Float32Array([
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0,
    0, 0, 0, 1,
  ]);
}

function getRotation(m) {
  const s = [m[0] + m[5] + m[10], m[0] - m[5] - m[10], m[5] - m[0] - m[10], m[10] - m[0] - m[5]];
  const largest = s.indexOf(Math.max(...s));
  const a = m[6] - m[9], b = m[8] - m[2], c = m[1] - m[4];
  const d = m[1] + m[4], e = m[8] + m[2], f = m[6] + m[9];
  const table = [[1 + s[0], a, b, c], [a, 1 + s[1], d, e], [b, d, 1 + s[2], f], [c, e, f, 1 + s[3]]];
  const q = table[largest], norm = Math.hypot(...q);
  return q.map((component) => Math.fround(component / norm));
}

class Node {
  constructor(index, translation, rotation) {
    Object.assign(this, { index, translation, rotation, children: [] });
  }
  get matrix() {
    return multiply(fromRotation(this.rotation), fromTranslation(this.translation));
  }
  traverse(parentMatrix, visit) {
    const world = multiply(parentMatrix, this.matrix);
    visit(this, world);
    this.children.forEach((child) => child.traverse(world, visit));
  }
}

function forward_kinematics({ parents, offsets, local_rotations }) {
  const nodes = offsets.map((offset, i) => {
    const [w, x, y, z] = local_rotations[i];
    return new Node(i, offset, [x, y, z, w]);
  });
  parents.forEach((parent, i) => parent >= 0 && nodes[parent].children.push(nodes[i]));
  const positions = [], rotations = [];
  nodes[0].traverse(fromTranslation([0, 0, 0]), (node, world) => {
    positions[node.index] = Array.from(world.slice(12, 15));
    rotations[node.index] = getRotation(world);
  });
  return { positions, rotations };
}

serve({ name: "nodes", language: "JavaScript", precision: "single" }, { forward_kinematics });
