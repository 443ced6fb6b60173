// FABRIK for a rope of equal links: the length of the first link is taken for all of them.
#include "plumbob.hpp"
#include <valarray>

using Vec = std::valarray<double>;

double dot(const Vec& a, const Vec& b) { return (a * b).sum(); }
double norm(const Vec& a) { return std::sqrt(dot(a, a)); }

// Rotation matrices by rows.
struct Matrix {
    Vec row[3];
    Vec operator*(const Vec& v) const { return {dot(row[0], v), dot(row[1], v), dot(row[2], v)}; }
    Matrix transposed() const {
        Matrix out;
        for (int i = 0; i < 3; i++) out.row[i] = {row[0][i], row[1][i], row[2][i]};
        return out;
    }
    Matrix operator*(const Matrix& other) const {
        Matrix columns = other.transposed(), out;
        for (int i = 0; i < 3; i++) out.row[i] = columns * row[i];
        return out;
    }
};

Matrix from_quaternion(const std::array<double, 4>& q) {
    double w = q[0], x = q[1], y = q[2], z = q[3];
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

std::vector<Vec> fabrik(std::vector<Vec> p, const Vec& target, double tolerance, int limit) {
    const Vec root = p[0];
    const double link = p.size() > 1 ? norm(p[1] - p[0]) : 0;
    for (int n = 0; n < limit; n++) {
        p.back() = target;
        for (int i = (int)p.size() - 2; i >= 0; i--)
            p[i] = p[i + 1] + link / norm(p[i] - p[i + 1]) * (p[i] - p[i + 1]);
        p[0] = root;
        for (std::size_t i = 1; i < p.size(); i++)
            p[i] = p[i - 1] + link / norm(p[i] - p[i - 1]) * (p[i] - p[i - 1]);
        if (norm(p.back() - target) <= tolerance) break;
    }
    return p;
}

void solve(const plumbob::Request& in, plumbob::Answer& out) {
    std::vector<int> parents = in["parents"], path;
    std::vector<std::array<double, 3>> offsets = in["offsets"];
    std::vector<std::array<double, 4>> local = in["local_rotations"];
    std::array<double, 3> goal = in["target"];
    int effector = in["effector"], limit = in["max_iterations"];
    double tolerance = in["tolerance"];
    for (int j = effector; j >= 0; j = parents[j]) path.insert(path.begin(), j);
    auto vec = [](const std::array<double, 3>& a) { return Vec(a.data(), 3); };
    std::vector<Vec> x(parents.size());
    std::vector<Matrix> r(parents.size());
    for (std::size_t j = 0; j < parents.size(); j++) {
        Matrix q = from_quaternion(local[j]);
        x[j] = j ? x[parents[j]] + r[parents[j]] * vec(offsets[j]) : vec(offsets[j]);
        r[j] = j ? r[parents[j]] * q : q;
    }
    std::vector<Vec> points;
    for (int j : path) points.push_back(x[j]);
    std::vector<Vec> solved = fabrik(points, vec(goal), tolerance, limit);
    for (std::size_t i = 0; i < path.size(); i++) x[path[i]] = solved[i];
    std::vector<std::array<double, 3>> positions;
    for (const Vec& v : x) positions.push_back({v[0], v[1], v[2]});
    out.set("positions", positions);
}

int main() {
    return plumbob::serve(R"("name": "rope", "language": "C++", "methods": ["fabrik"],
        "chains_only": true, "effector": "last", "tasks": ["inverse_kinematics"])", solve);
}
