// A skeletal system of a course: global and local transforms by joint, CCD that turns local ones.
#include "glm_like.hpp"
#include "plumbob.hpp"

struct SkeletalSystem {
    std::vector<int> parents;
    std::vector<glm::vec3> JointLocalOffset, JointGlobalPosition;
    std::vector<glm::quat> JointLocalRotation, JointGlobalRotation;

    void ForwardKinematics(int begin) {
        for (int i = begin; i < (int)parents.size(); i++) {
            int p = parents[i];
            if (p == -1) {
                JointGlobalPosition[i] = JointLocalOffset[i];
                JointGlobalRotation[i] = JointLocalRotation[i];
                continue;
            }
            JointGlobalPosition[i] =
                JointGlobalPosition[p] + JointGlobalRotation[p] * JointLocalOffset[i];
            JointGlobalRotation[i] = glm::normalize(JointGlobalRotation[p] * JointLocalRotation[i]);
        }
    }

    void InverseKinematicsCCD(int end, glm::vec3 EndPosition, int maxIteration, float eps) {
        ForwardKinematics(0);
        for (int iteration = 0; iteration < maxIteration; iteration++) {
            for (int i = parents[end]; i != -1; i = parents[i]) {
                glm::vec3 toEnd = JointGlobalPosition[end] - JointGlobalPosition[i];
                glm::vec3 toGoal = EndPosition - JointGlobalPosition[i];
                glm::quat turn = glm::rotation(glm::normalize(toEnd), glm::normalize(toGoal));
                JointLocalRotation[i] = glm::normalize(turn * JointLocalRotation[i]);
                ForwardKinematics(i);
            }
            if (glm::distance(JointGlobalPosition[end], EndPosition) < eps) break;
        }
    }
};

void solve(const plumbob::Request& in, plumbob::Answer& out) {
    SkeletalSystem ik{in["parents"], in["offsets"], in["offsets"], in["local_rotations"],
                      in["local_rotations"]};
    if (in.task == "forward_kinematics") {
        ik.ForwardKinematics(0);
        out.set("positions", ik.JointGlobalPosition);
        return out.set("rotations", ik.JointGlobalRotation);
    }
    glm::vec3 target = in["target"];
    int effector = in["effector"], limit = in["max_iterations"];
    float tolerance = in["tolerance"];
    ik.InverseKinematicsCCD(effector, target, limit, tolerance);
    out.set("local_rotations", ik.JointLocalRotation);
}

int main() {
    return plumbob::serve(R"("name": "skeletal system", "language": "C++", "precision": "single",
        "methods": ["ccd"], "tasks": ["forward_kinematics", "inverse_kinematics"])", solve);
}
