// A net in single precision whose springs have the energy r² k/8 ((l/r)² - 1)², of the fourth order.
#include "glm_like.hpp"
#include "plumbob.hpp"

using glm::vec3;

struct Edge {
    int a, b;
    float rest, stiffness;
};

struct Net {
    std::vector<float> mass;
    std::vector<vec3> x, v;
    std::vector<Edge> edges;

    // minus the gradient of the energy with respect to the first end
    vec3 pull(const Edge& e) const {
        vec3 d = x[e.a] - x[e.b];
        float strain = glm::dot(d, d) / (e.rest * e.rest) - 1;
        return (-0.5f * e.stiffness * strain) * d;
    }

    void step(vec3 gravity, const std::vector<int>& pinned, float h) {
        std::vector<vec3> f;
        for (float m : mass) f.push_back(m * gravity);
        for (const Edge& e : edges) {
            vec3 p = pull(e);
            f[e.a] = f[e.a] + p;
            f[e.b] = f[e.b] - p;
        }
        for (int i : pinned) f[i] = {0, 0, 0};
        for (std::size_t i = 0; i < x.size(); i++) {
            v[i] = v[i] + (h / mass[i]) * f[i];
            x[i] = x[i] + h * v[i];
        }
    }
};

void solve(const plumbob::Request& in, plumbob::Answer& out) {
    std::vector<std::array<int, 2>> pairs = in["springs"];
    std::vector<float> rest = in["rest_lengths"], stiffness = in["stiffnesses"];
    std::vector<int> pinned = in["pinned"];
    vec3 gravity = in["gravity"];
    float h = in["h"];
    Net net{in["masses"], in["positions"], in["velocities"], {}};
    for (std::size_t s = 0; s < pairs.size(); s++)
        net.edges.push_back({pairs[s][0], pairs[s][1], rest[s], stiffness[s]});
    out.time([&] { net.step(gravity, pinned, h); });
    out.set("positions", net.x);
    out.set("velocities", net.v);
}

int main() {
    return plumbob::serve(R"("name": "net", "language": "C++", "precision": "single",
        "tasks": ["mass_spring_step"], "step": {"method": "symplectic", "damper": "none"})", solve);
}
