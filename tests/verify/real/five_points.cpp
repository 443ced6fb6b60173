// FABRIK in single precision, then one arc a link, in one pass; MISTAKE is 0 or 1 to 5.
#include "glm_like.hpp"
#include "plumbob.hpp"

using glm::quat;
using glm::vec3;
const int MISTAKE = std::getenv("MISTAKE") ? std::atoi(std::getenv("MISTAKE")) : 0;

struct Chain {
    std::vector<int> joints;
    std::vector<vec3> points;
    std::vector<float> lengths;

    float reach() const {
        float sum = 0;
        for (float d : lengths) sum += d;
        return sum;
    }

    void stretch(vec3 target) {
        for (std::size_t i = 0; i < lengths.size(); i++) {
            vec3 from = MISTAKE == 4 ? points[0] : points[i];  // 4: from the root every time
            points[i + 1] = from + lengths[i] * glm::normalize(target - points[i]);
        }
    }

    void backward(vec3 target) {
        points.back() = target;
        for (int i = (int)lengths.size() - 1; i >= 0; i--)
            points[i] = points[i + 1] + lengths[i] * glm::normalize(points[i] - points[i + 1]);
    }

    void forward(vec3 root) {
        points[0] = root;
        std::size_t end = lengths.size() - (MISTAKE == 5 ? 1 : 0);  // 5: the effector stays
        for (std::size_t i = 0; i < end; i++) {
            std::size_t k = MISTAKE == 1 && i + 1 < lengths.size() ? i + 1 : i;  // 1: next link's
            points[i + 1] = points[i] + lengths[k] * glm::normalize(points[i + 1] - points[i]);
        }
    }

    void solve(vec3 target, float tolerance, int limit) {
        vec3 root = points[0];
        if (glm::distance(root, target) > reach()) return stretch(target);
        for (int n = 0; n < limit; n++) {
            backward(target);
            forward(root);
            vec3 miss = points.back() - target;
            float distance = MISTAKE == 3 ? glm::dot(miss, miss) : glm::length(miss);  // 3: squared
            if (distance <= tolerance) break;
        }
    }
};

quat arc(vec3 a, vec3 b) {
    vec3 c = glm::cross(a, b);
    float w = glm::length(a) * glm::length(b) + glm::dot(a, b);
    return w * w + glm::dot(c, c) > 1e-14f ? glm::normalize(quat{w, c.x, c.y, c.z}) : quat{1, 0, 0, 0};
}

void solve(const plumbob::Request& in, plumbob::Answer& out) {
    std::vector<int> parents = in["parents"];
    std::vector<vec3> offsets = in["offsets"], x = offsets;
    std::vector<quat> local = in["local_rotations"], global = local;
    for (std::size_t j = 1; j < parents.size(); j++) {
        x[j] = x[parents[j]] + global[parents[j]] * offsets[j];
        global[j] = global[parents[j]] * local[j];
    }
    Chain chain;
    int effector = in["effector"], limit = in["max_iterations"];
    float tolerance = in["tolerance"];
    vec3 target = in["target"];
    for (int j = effector; j >= 0; j = parents[j]) chain.joints.insert(chain.joints.begin(), j);
    for (int j : chain.joints) chain.points.push_back(x[j]);
    for (std::size_t i = 1; i < chain.points.size(); i++)
        chain.lengths.push_back(glm::distance(chain.points[i], chain.points[i - 1]));
    chain.solve(target, tolerance, limit);
    quat above{1, 0, 0, 0};
    for (std::size_t i = 0; i + 1 < chain.joints.size(); i++) {
        int j = chain.joints[i], next = chain.joints[i + 1];
        vec3 line = chain.points[i + 1] - chain.points[i];
        vec3 now = (above * local[j]) * offsets[next];
        quat world = arc(now, line) * (above * local[j]);
        if (MISTAKE == 2) {
            local[j] = arc(offsets[next], line);  // 2: a direction of the world in a local frame
        } else {
            local[j] = glm::normalize(glm::conjugate(above) * world);
        }
        above = glm::normalize(above * local[j]);
    }
    out.set("local_rotations", local);
}

int main() {
    return plumbob::serve(R"("name": "points", "language": "C++", "precision": "single",
        "methods": ["fabrik"], "tasks": ["inverse_kinematics"])", solve);
}
