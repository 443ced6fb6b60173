// A character with links in a list of the path; CCD by global rotations, locals afterwards.
#include "glm_like.hpp"
#include "plumbob.hpp"

struct Link {
    int index;
    glm::vec3 offset, position;
    glm::quat global;
};

using Path = std::vector<Link>;

Path path_to(int effector, const std::vector<int>& parents, const std::vector<glm::vec3>& offsets,
             const std::vector<glm::quat>& local) {
    Path path;
    for (int j = effector; j >= 0; j = parents[j])
        path.insert(path.begin(), {j, offsets[j], offsets[j], local[j]});
    for (std::size_t i = 1; i < path.size(); i++) {
        path[i].position = path[i - 1].position + path[i - 1].global * path[i].offset;
        path[i].global = path[i - 1].global * path[i].global;
    }
    return path;
}

void turn_from(Path& path, std::size_t i, glm::quat turn) {
    path[i].global = glm::normalize(turn * path[i].global);
    for (std::size_t k = i + 1; k < path.size(); k++) {
        path[k].position = path[k - 1].position + path[k - 1].global * path[k].offset;
        path[k].global = glm::normalize(turn * path[k].global);
    }
}

void ccd(Path& path, glm::vec3 target, float tolerance, int sweeps) {
    for (int sweep = 0; sweep < sweeps; sweep++) {
        for (int i = (int)path.size() - 2; i >= 0; i--) {
            glm::vec3 now = glm::normalize(path.back().position - path[i].position);
            glm::vec3 then = glm::normalize(target - path[i].position);
            turn_from(path, i, glm::rotation(now, then));
        }
        if (glm::distance(path.back().position, target) <= tolerance) return;
    }
}

void solve(const plumbob::Request& in, plumbob::Answer& out) {
    std::vector<int> parents = in["parents"];
    std::vector<glm::vec3> offsets = in["offsets"];
    std::vector<glm::quat> local = in["local_rotations"];
    glm::vec3 target = in["target"];
    int effector = in["effector"], sweeps = in["max_iterations"];
    float tolerance = in["tolerance"];
    Path path = path_to(effector, parents, offsets, local);
    out.time([&] { ccd(path, target, tolerance, sweeps); });
    for (std::size_t i = 0; i + 1 < path.size(); i++)
        local[path[i].index] =
            i ? glm::conjugate(path[i - 1].global) * path[i].global : path[i].global;
    out.set("local_rotations", local);
}

int main() {
    return plumbob::serve(R"("name": "character", "language": "C++", "precision": "single",
        "methods": ["ccd"], "tasks": ["inverse_kinematics"])", solve);
}
