// Limbs of pointers; the rotation of the tip is set to none when the path is written back.
#include "plumbob.hpp"
#include <memory>

struct Q {
    double w, x, y, z;
};
struct V {
    double x, y, z;
};
V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
double dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Q operator*(Q p, Q q) {
    return {p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
            p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
            p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
            p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}
Q bar(Q q) { return {q.w, -q.x, -q.y, -q.z}; }
V spin(Q q, V v) {
    Q p = q * Q{0, v.x, v.y, v.z} * bar(q);
    return {p.x, p.y, p.z};
}
Q unit(Q q) {
    double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return n > 1e-14 ? Q{q.w / n, q.x / n, q.y / n, q.z / n} : Q{1, 0, 0, 0};
}
Q arc(V a, V b) {
    double n = std::sqrt(dot(a, a) * dot(b, b));
    return unit({n + dot(a, b), a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x});
}

struct Limb {
    Limb* above;
    V offset;
    Q local;
    Q global() const { return above ? above->global() * local : local; }
    V place() const { return above ? above->place() + spin(above->global(), offset) : offset; }
};

void reach(Limb* tip, V target, double tolerance, int sweeps) {
    for (; sweeps > 0; sweeps--) {
        for (Limb* limb = tip->above; limb; limb = limb->above) {
            V pivot = limb->place();
            Q world = arc(tip->place() - pivot, target - pivot) * limb->global();
            limb->local = unit(limb->above ? bar(limb->above->global()) * world : world);
        }
        V miss = tip->place() - target;
        if (dot(miss, miss) <= tolerance * tolerance) break;
    }
    tip->local = {1, 0, 0, 0};
}

void solve(const plumbob::Request& in, plumbob::Answer& out) {
    std::vector<int> parents = in["parents"];
    std::vector<std::array<double, 3>> offsets = in["offsets"];
    std::vector<std::array<double, 4>> local = in["local_rotations"];
    std::array<double, 3> target = in["target"];
    int effector = in["effector"], sweeps = in["max_iterations"];
    std::vector<std::unique_ptr<Limb>> limbs;
    for (std::size_t j = 0; j < parents.size(); j++) {
        auto [x, y, z] = offsets[j];
        auto [a, b, c, d] = local[j];
        Limb* above = parents[j] < 0 ? nullptr : limbs[parents[j]].get();
        limbs.push_back(std::make_unique<Limb>(Limb{above, {x, y, z}, {a, b, c, d}}));
    }
    double tolerance = in["tolerance"];
    reach(limbs[effector].get(), {target[0], target[1], target[2]}, tolerance, sweeps);
    for (std::size_t j = 0; j < limbs.size(); j++) {
        Q q = limbs[j]->local;
        local[j] = {q.w, q.x, q.y, q.z};
    }
    out.set("local_rotations", local);
}

int main() {
    return plumbob::serve(R"("name": "limbs", "language": "C++", "methods": ["ccd"],
        "tasks": ["inverse_kinematics"])", solve);
}
