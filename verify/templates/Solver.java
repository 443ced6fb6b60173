// A starter for `plumbob verify -- java Solver`; Plumbob.java speaks the protocol.
// Build, with Java 17 or newer: javac Solver.java Plumbob.java
// Offer only what you have: see main.
import java.util.*;

class Solver {
    // Parents precede children, the root's is -1. An offset {x, y, z} is in the parent's frame,
    // the root's is its global position; rotations are unit quaternions {w, x, y, z}.
    // Put "positions" and "rotations", global, of all joints, as double[][].
    static void forwardKinematics(Request ask, Map<String, Object> answer) {
        int[] parents = ask.integers("parents");
        double[][] offsets = ask.rows("offsets"), localRotations = ask.rows("local_rotations");
        throw new RuntimeException("forward_kinematics is not written yet");
    }

    // Put "local_rotations" with which the joint `effector` is within `tolerance` of the target.
    static void inverseKinematics(Request ask, Map<String, Object> answer) {
        int[] parents = ask.integers("parents");
        double[][] offsets = ask.rows("offsets"), localRotations = ask.rows("local_rotations");
        double[] target = ask.numbers("target");
        int effector = ask.integer("effector"), maxIterations = ask.integer("max_iterations");
        double tolerance = ask.number("tolerance");
        String method = ask.text("method"); // "ccd", "fabrik", or one of the "methods" of main
        throw new RuntimeException("inverse_kinematics is not written yet");
    }

    // Put "positions" and "velocities" a time h later.
    static void massSpringStep(Request ask, Map<String, Object> answer) {
        double[] masses = ask.numbers("masses"), restLengths = ask.numbers("rest_lengths");
        double[] stiffnesses = ask.numbers("stiffnesses"), dampings = ask.numbers("dampings");
        int[][] springs = ask.pairs("springs"); // the two particles of each
        int[] pinned = ask.integers("pinned"); // particles that do not move
        double[] gravity = ask.numbers("gravity"); // an acceleration
        double[][] positions = ask.rows("positions"), velocities = ask.rows("velocities");
        double h = ask.number("h");
        throw new RuntimeException("mass_spring_step is not written yet");
    }

    // Put "q", coordinates within lower and upper that bring the tool to the target.
    static void robotInverseKinematics(Request ask, Map<String, Object> answer) {
        int[] parents = ask.integers("parents"); // -1 is the base
        double[][] origins = ask.rows("origins"), orientations = ask.rows("orientations");
        double[][] axes = ask.rows("axes"); // in the joint's frame
        boolean[] slides = ask.flags("slides"); // along its axis; else the joint rotates about it
        int effector = ask.integer("effector"); // carries the tool
        double[] toolPosition = ask.numbers("tool_position"), start = ask.numbers("start");
        double[] toolRotation = ask.numbers("tool_rotation");
        double[] lower = ask.numbers("lower"), upper = ask.numbers("upper");
        double[] position = ask.numbers("target_position"); // and target_rotation, tolerance,
        // tolerance_rotation, max_iterations; urdf is the same robot as a text
        throw new RuntimeException("robot_inverse_kinematics is not written yet");
    }

    // Put "jacobian", the tool's linear and angular velocity by joint, as 6 rows double[][].
    static void robotJacobian(Request ask, Map<String, Object> answer) {
        double[] q = ask.numbers("q"); // the robot is as above
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
