// A starter for `plumbob verify -- node solver.js` (docs/protocol.md). Offer only what you have.
const readline = require("node:readline");
// GREETING_FIELDS
const greeting = {
  protocol: 1, name: "my solver", language: "JavaScript", precision: "double",
  tasks: ["forward_kinematics", "inverse_kinematics", "mass_spring_step",
    "robot_inverse_kinematics", "robot_jacobian"],
};

// Answers go where they are read; what else is printed goes to the errors and does no harm.
const send = process.stdout.write.bind(process.stdout);
process.stdout.write = process.stderr.write.bind(process.stderr);

function missing(what) {
  throw new Error(`${what} is not written yet`);
}

const tasks = {
  // Parents precede children, the root's is -1. An offset [x, y, z] is in the parent's frame, the
  // root's is its global position; rotations are unit quaternions [w, x, y, z].
  forward_kinematics({ parents, offsets, local_rotations }) {
    const positions = parents.map(() => new Float64Array(3)); // global, of all joints
    const rotations = parents.map(() => new Float64Array(4));
    missing("forward_kinematics");
    return { positions, rotations };
  },

  // Change local_rotations so that the joint `effector` comes within `tolerance` of the target.
  inverse_kinematics(request) {
    const { parents, offsets, local_rotations, target, effector } = request;
    const { tolerance, max_iterations, method } = request;
    missing("inverse_kinematics");
    return { local_rotations };
  },

  // Replace positions and velocities by those a time h later. Springs are pairs of particles,
  // pinned are particles that do not move, gravity is an acceleration.
  mass_spring_step(request) {
    const { masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity } = request;
    const { positions, velocities, h } = request;
    missing("mass_spring_step");
    return { positions, velocities };
  },

  // Return coordinates q of the joints, within lower and upper, that bring the tool to a position
  // and a rotation. Joint `effector` carries the tool; urdf is the same robot as a text.
  robot_inverse_kinematics(request) {
    const { parents, origins, orientations, axes, slides, lower, upper, effector } = request;
    const { tool_position, tool_rotation, urdf, start } = request;
    const { target_position, target_rotation } = request;
    const { tolerance, tolerance_rotation, max_iterations } = request;
    const q = Float64Array.from(start);
    missing("robot_inverse_kinematics");
    return { q };
  },

  // Return the tool's linear and angular velocity by joint: 6 rows, a column for each joint.
  robot_jacobian(request) {
    const { q, parents, origins, orientations, axes, slides, effector } = request;
    const { tool_position, tool_rotation, urdf } = request;
    const jacobian = Array.from({ length: 6 }, () => new Float64Array(q.length));
    missing("robot_jacobian");
    return { jacobian };
  },
};

function answer(request) {
  if (request.task === "greeting") return greeting;
  try {
    const start = performance.now(); // [ms]
    const outputs = tasks[request.task](request);
    return { seconds: (performance.now() - start) / 1000, ...outputs };
  } catch (error) {
    return { error: error.message };
  }
}

const plain = (key, value) => (ArrayBuffer.isView(value) ? Array.from(value) : value);
readline.createInterface({ input: process.stdin }).on("line", (line) => {
  const request = JSON.parse(line, (key, value) => (value === null ? NaN : value));
  send(JSON.stringify({ id: request.id, ...answer(request) }, plain) + "\n"); // NaN becomes null
});
