// Right forward kinematics in four forms; FORM is "climb", "matrix", "rodrigues" or "single".
const serve = require("./serve.js");
const FORM = process.env.FORM || "climb";
const round = FORM === "single" ? Math.fround : (x) => x;

const mul = ([a, b, c, d], [e, f, g, h]) => [
  a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
  a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e].map(round);

function rotate(q, v) {
  if (FORM === "matrix") {
    const [w, x, y, z] = q;
    return [
      (1 - 2 * (y * y + z * z)) * v[0] + 2 * (x * y - w * z) * v[1] + 2 * (x * z + w * y) * v[2],
      2 * (x * y + w * z) * v[0] + (1 - 2 * (x * x + z * z)) * v[1] + 2 * (y * z - w * x) * v[2],
      2 * (x * z - w * y) * v[0] + 2 * (y * z + w * x) * v[1] + (1 - 2 * (x * x + y * y)) * v[2]];
  }
  if (FORM === "rodrigues") {
    const s = Math.hypot(q[1], q[2], q[3]), angle = 2 * Math.atan2(s, q[0]);
    if (s < 1e-300) return [...v];
    const k = [q[1] / s, q[2] / s, q[3] / s], c = Math.cos(angle), n = Math.sin(angle);
    const kv = k[0] * v[0] + k[1] * v[1] + k[2] * v[2];
    const x = [k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]];
    return v.map((p, i) => p * c + x[i] * n + k[i] * kv * (1 - c));
  }
  return mul(mul(q, [0, ...v]), [q[0], -q[1], -q[2], -q[3]]).slice(1).map(round);
}

function climb(joint, { parents, offsets, local_rotations: q }) {
  let place = [0, 0, 0], turn = [1, 0, 0, 0];
  for (let j = joint; j >= 0; j = parents[j]) {
    place = rotate(j === joint ? [1, 0, 0, 0] : q[j], place).map((x, i) => x + offsets[j][i]);
    turn = mul(q[j], turn);
  }
  return [place, turn];
}

function forward_kinematics(request) {
  const { parents, offsets, local_rotations } = request, positions = [], rotations = [];
  parents.forEach((p, j) => {
    if (FORM === "climb") {
      [positions[j], rotations[j]] = climb(j, request);
    } else {
      const moved = p < 0 ? [0, 0, 0] : rotate(rotations[p], offsets[j].map(round));
      positions[j] = (p < 0 ? offsets[j] : moved.map((x, i) => x + positions[p][i])).map(round);
      rotations[j] = p < 0 ? local_rotations[j].map(round) : mul(rotations[p], local_rotations[j]);
    }
  });
  return { positions, rotations };
}

const precision = FORM === "single" ? "single" : "double";
serve({ name: FORM, language: "JavaScript", precision }, { forward_kinematics });
