// A starter for `plumbob verify -- ./solver`; plumbob.hpp speaks the protocol.
// Build: g++ -std=c++17 -O2 solver.cpp -o solver     Offer only what you have: see main.
// With glm, include it above plumbob.hpp: <glm/glm.hpp> and <glm/gtc/quaternion.hpp>; then
//   using Vec3 = glm::vec3; using Quat = glm::quat;    and declare "precision": "single".
// With Eigen likewise: <Eigen/Geometry>; then
//   using Vec3 = Eigen::Vector3d; using Quat = Eigen::Quaterniond;
#include "plumbob.hpp"
using Vec3 = std::array<double, 3>;  // [m]
using Quat = std::array<double, 4>;  // unit quaternion, w first
using Positions = std::vector<Vec3>;
using Rotations = std::vector<Quat>;

// Parents precede children, the root's is -1. An offset is in the parent's frame, the root's is
// its global position. Fill in the global positions and rotations of all joints.
void forward_kinematics(const std::vector<int>& parents, const Positions& offsets,
                        const Rotations& local_rotations, Positions& x, Rotations& r) {
    throw plumbob::missing("forward_kinematics");
}

// Change local_rotations so that the joint `effector` comes within `tolerance` of the target, by
// the method "ccd", "fabrik" or another one of the "methods" that main declares, if any.
void inverse_kinematics(const std::vector<int>& parents, const Positions& offsets,
                        Rotations& local_rotations, const Vec3& target, int effector,
                        double tolerance, int max_iterations, const std::string& method) {
    throw plumbob::missing("inverse_kinematics");
}

struct System {
    std::vector<double> masses, rest_lengths, stiffnesses, dampings;
    std::vector<std::array<int, 2>> springs;  // the two particles of each
    std::vector<int> pinned;                  // particles that do not move
    Vec3 gravity;                             // an acceleration
};

// Replace positions and velocities by those a time h later.
void mass_spring_step(const System& system, Positions& x, Positions& v, double h) {
    throw plumbob::missing("mass_spring_step");
}

struct Robot {
    std::vector<int> parents;  // -1 is the base
    Positions origins;         // of each joint's frame, in its parent's
    Rotations orientations;    // of that frame, likewise
    Positions axes;            // in the joint's frame
    std::vector<bool> slides;  // along its axis; else the joint rotates about it
    std::vector<double> lower, upper;
    int effector;              // the joint that carries the tool
    Vec3 tool_position;
    Quat tool_rotation;
    std::string urdf;          // the same robot
};

// Change the coordinates q within their limits so that the tool has a position and a rotation.
void robot_inverse_kinematics(const Robot& robot, std::vector<double>& q, const Vec3& position,
                              const Quat& rotation, double tolerance, double tolerance_rotation,
                              int max_iterations) {
    throw plumbob::missing("robot_inverse_kinematics");
}

// Fill in the tool's linear and angular velocity by joint: 6 rows.
void robot_jacobian(const Robot& robot, const std::vector<double>& q,
                    std::vector<std::vector<double>>& jacobian) {
    throw plumbob::missing("robot_jacobian");
}

void solve_robot(const plumbob::Request& in, plumbob::Answer& out) {
    Robot robot{in["parents"], in["origins"], in["orientations"], in["axes"], in["slides"],
                in["lower"], in["upper"], in["effector"], in["tool_position"],
                in["tool_rotation"], in.text("urdf")};
    if (in.task == "robot_jacobian") {
        std::vector<double> q = in["q"];
        std::vector<std::vector<double>> jacobian(6, std::vector<double>(q.size()));
        out.time([&] { robot_jacobian(robot, q, jacobian); });
        return out.set("jacobian", jacobian);
    }
    std::vector<double> q = in["start"];
    Vec3 position = in["target_position"];
    Quat rotation = in["target_rotation"];
    double tolerance = in["tolerance"], tolerance_rotation = in["tolerance_rotation"];
    int limit = in["max_iterations"];
    out.time([&] {
        robot_inverse_kinematics(robot, q, position, rotation, tolerance, tolerance_rotation,
                                 limit);
    });
    out.set("q", q);
}

void solve(const plumbob::Request& in, plumbob::Answer& out) {
    if (in.task.rfind("robot", 0) == 0) return solve_robot(in, out);
    if (in.task == "mass_spring_step") {
        System s{in["masses"], in["rest_lengths"], in["stiffnesses"], in["dampings"],
                 in["springs"], in["pinned"], in["gravity"]};
        Positions x = in["positions"], v = in["velocities"];
        double h = in["h"];
        out.time([&] { mass_spring_step(s, x, v, h); });
        return out.set("positions", x), out.set("velocities", v);
    }
    std::vector<int> parents = in["parents"];
    Positions offsets = in["offsets"], x(parents.size());
    Rotations q = in["local_rotations"], r(parents.size());
    if (in.task == "forward_kinematics") {
        out.time([&] { forward_kinematics(parents, offsets, q, x, r); });
        return out.set("positions", x), out.set("rotations", r);
    }
    Vec3 target = in["target"];
    double tolerance = in["tolerance"];
    int effector = in["effector"], limit = in["max_iterations"];
    std::string method = in["method"];
    out.time([&] {
        inverse_kinematics(parents, offsets, q, target, effector, tolerance, limit, method);
    });
    out.set("local_rotations", q);
}

// GREETING_FIELDS
int main() {
    return plumbob::serve(R"("name": "my solver", "language": "C++", "precision": "double",
        "tasks": ["forward_kinematics", "inverse_kinematics", "mass_spring_step",
        "robot_inverse_kinematics", "robot_jacobian"])", solve);
}
