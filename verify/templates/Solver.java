// A starter for `plumbob verify -- java Solver`; Plumbob.java speaks the protocol.
// Build, with Java 17 or newer: javac Solver.java Plumbob.java
// Offer only what you have: see main.
import java.util.*;

class Solver {
    // Parents precede children, the root's is -1. An offset {x, y, z} is in the parent's frame,
    // the root's is its global position; rotations are unit quaternions {w, x, y, z}.
    // Put "positions" and "rotations", global, of all joints, as double[][].
    static void forwardKinematics(Request input, Map<String, Object> answer) {
        int[] parents = input.integers("parents");
        double[][] offsets = input.rows("offsets"), localRotations = input.rows("local_rotations");
        throw new RuntimeException("forward_kinematics is not written yet");
    }

    // Put "local_rotations" with which the joint `effector` is within `tolerance` of the target.
    static void inverseKinematics(Request input, Map<String, Object> answer) {
        int[] parents = input.integers("parents");
        double[][] offsets = input.rows("offsets"), localRotations = input.rows("local_rotations");
        double[] target = input.numbers("target");
        int effector = input.integer("effector"), maxIterations = input.integer("max_iterations");
        double tolerance = input.number("tolerance");
        String method = input.text("method"); // "ccd", "fabrik", or one of the "methods" of main
        throw new RuntimeException("inverse_kinematics is not written yet");
    }

    // Put "positions" and "velocities" a time h later.
    static void massSpringStep(Request input, Map<String, Object> answer) {
        double[] masses = input.numbers("masses"), restLengths = input.numbers("rest_lengths");
        double[] stiffnesses = input.numbers("stiffnesses"), dampings = input.numbers("dampings");
        int[][] springs = input.pairs("springs"); // the two particles of each
        int[] pinned = input.integers("pinned"); // particles that do not move
        double[] gravity = input.numbers("gravity"); // an acceleration
        double[][] positions = input.rows("positions"), velocities = input.rows("velocities");
        double h = input.number("h");
        throw new RuntimeException("mass_spring_step is not written yet");
    }

    // Put "q", coordinates within lower and upper that bring the tool to the target.
    static void robotInverseKinematics(Request input, Map<String, Object> answer) {
        int[] parents = input.integers("parents"); // -1 is the base
        double[][] origins = input.rows("origins"), orientations = input.rows("orientations");
        double[][] axes = input.rows("axes"); // in the joint's frame
        boolean[] slides = input.flags("slides"); // along its axis; else the joint rotates about it
        int effector = input.integer("effector"); // carries the tool
        double[] toolPosition = input.numbers("tool_position"), start = input.numbers("start");
        double[] toolRotation = input.numbers("tool_rotation");
        double[] lower = input.numbers("lower"), upper = input.numbers("upper");
        double[] position = input.numbers("target_position"); // and target_rotation, tolerance,
        // tolerance_rotation, max_iterations; urdf is the same robot as a text
        throw new RuntimeException("robot_inverse_kinematics is not written yet");
    }

    // Put "jacobian", the tool's linear and angular velocity by joint, as 6 rows double[][].
    static void robotJacobian(Request input, Map<String, Object> answer) {
        double[] q = input.numbers("q"); // the robot is as above
        throw new RuntimeException("robot_jacobian is not written yet");
    }

    // GREETING_FIELDS
    public static void main(String[] arguments) throws Exception {
        Plumbob.serve(
            "\"name\": \"my solver\", \"language\": \"Java\", \"precision\": \"double\"",
            Map.of(
                "forward_kinematics", Solver::forwardKinematics,
                "inverse_kinematics", Solver::inverseKinematics,
                "mass_spring_step", Solver::massSpringStep,
                "robot_inverse_kinematics", Solver::robotInverseKinematics,
                "robot_jacobian", Solver::robotJacobian));
    }
}
