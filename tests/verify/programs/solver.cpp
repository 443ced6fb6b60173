// A right solver of the lab in C++ with faults planted in it: ./solver --fault NAME.
// The step is implicit Euler, solved by Newton's method from y until rounding; pins are eliminated.
// REAL is double or float. plumbob.hpp is the template's.
#include <algorithm>
#include <limits>
#include <numeric>

#include "plumbob.hpp"
#ifndef REAL
#define REAL double
#endif

using Real = REAL;
using Vec = std::array<Real, 3>;
using Quat = std::array<Real, 4>;
using Points = std::vector<Vec>;
using Numbers = std::vector<Real>;
const Real EPS = std::numeric_limits<Real>::epsilon();

static std::string fault;
static bool planted(const char* name) { return fault == name; }

static Vec operator+(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
static Vec operator-(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
static Vec operator*(Real s, const Vec& a) { return {s * a[0], s * a[1], s * a[2]}; }
static Real dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static Real norm(const Vec& a) { return std::sqrt(dot(a, a)); }
static Vec cross(const Vec& a, const Vec& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

static Quat operator*(const Quat& a, const Quat& b) {
    return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
static Quat conj(const Quat& q) { return {q[0], -q[1], -q[2], -q[3]}; }
static Quat unit(const Quat& q) {
    Real n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
}
static Vec rotate(const Quat& q, const Vec& v) {
    Vec u = {q[1], q[2], q[3]}, t = Real(2) * cross(u, v);
    return v + q[0] * t + cross(u, t);
}

static Vec perpendicular(const Vec& a) {
    Vec axis = std::abs(a[0]) < std::abs(a[1]) ? Vec{1, 0, 0} : Vec{0, 1, 0};
    Vec p = cross(a, axis);
    return (1 / norm(p)) * p;
}

// The smallest rotation from direction a to b, by the vector halfway.
static Quat between(Vec a, Vec b) {
    Real m = norm(a), n = norm(b);
    if (m == 0 || n == 0) return {1, 0, 0, 0};
    a = (1 / m) * a, b = (1 / n) * b;
    Vec half = a + b;
    Real l = norm(half);
    if (l < 8 * EPS) {
        Vec p = perpendicular(a);
        return {0, p[0], p[1], p[2]};
    }
    half = (1 / l) * half;
    Vec v = cross(a, half);
    return unit({dot(a, half), v[0], v[1], v[2]});
}

struct Arm {
    std::vector<int> parents;
    Points offsets;
    std::vector<Quat> local;
    Points x;
    std::vector<Quat> r;

    void forward() {
        x.resize(parents.size()), r.resize(parents.size());
        for (std::size_t j = 0; j < parents.size(); ++j) {
            int p = parents[j];
            if (p < 0) {
                x[j] = offsets[j], r[j] = local[j];
                continue;
            }
            r[j] = planted("fk_child_first") ? local[j] * r[p] : r[p] * local[j];
            Vec link = rotate(r[p], offsets[j]);
            if (planted("fk_own_rotation")) link = rotate(r[j], offsets[j]);
            if (planted("fk_offset_unrotated")) link = offsets[j];
            x[j] = x[p] + link;
        }
    }

    std::vector<int> chain(int effector) const {  // effector first, root last
        std::vector<int> joints;
        for (int j = effector; j >= 0; j = parents[j]) joints.push_back(j);
        return joints;
    }

    Real length(int joint) const { return norm(offsets[joint]); }

    void spin(int joint, const Quat& world) {  // by a rotation of global axes
        Quat above = parents[joint] < 0 ? Quat{1, 0, 0, 0} : r[parents[joint]];
        local[joint] = unit(conj(above) * world * above * local[joint]);
    }

    // A chain on one line with a target within reach is stuck: bend it.
    void bend(const std::vector<int>& joints, const Vec& target) {
        forward();
        Vec root = x[joints.back()], to = target - root;
        Real reach = 0, off = 0;
        for (std::size_t i = 0; i + 1 < joints.size(); ++i) reach += length(joints[i]);
        Vec line = norm(to) > 0 ? to : x[joints[0]] - root;
        if (norm(line) == 0 || norm(to) >= reach) return;
        line = (1 / norm(line)) * line;
        for (int j : joints) off = std::max(off, norm(cross(line, x[j] - root)));
        if (off > 100 * EPS * reach) return;
        Vec p = perpendicular(line);
        Real angle = Real(0.1);
        for (std::size_t i = joints.size(); i-- > 1;) {
            spin(joints[i], {std::cos(angle), std::sin(angle) * p[0], std::sin(angle) * p[1],
                             std::sin(angle) * p[2]});
            forward();
        }
    }
};

struct Solved {
    int iterations = 0;
    Real residual = 0;
    bool converged = false;
};

static void ccd_sweep(Arm& arm, const std::vector<int>& joints, const Vec& target) {
    for (std::size_t i = 1; i < joints.size(); ++i) {
        int j = joints[i], child = joints[i - 1];
        if (!planted("ccd_stale")) arm.forward();
        Quat d = between(arm.x[joints[0]] - arm.x[j], target - arm.x[j]);
        Quat above = arm.parents[j] < 0 ? Quat{1, 0, 0, 0} : arm.r[arm.parents[j]];
        Quat& q = arm.local[j];
        if (planted("ccd_world_left"))
            q = unit(d * q);
        else if (planted("ccd_world_right"))
            q = unit(q * d);
        else if (planted("ccd_conjugated"))
            q = unit(above * d * conj(above) * q);
        else if (planted("ccd_child"))
            arm.spin(child, d);
        else
            arm.spin(j, d);
    }
}

static Solved ccd(Arm& arm, const Vec& target, int effector, Real tolerance, int most) {
    std::vector<int> joints = arm.chain(effector);
    Solved out;
    if (most > 1) arm.bend(joints, target);
    for (;; ++out.iterations) {
        arm.forward();
        out.residual = norm(arm.x[effector] - target);
        Real left = planted("ccd_tolerance") ? out.residual * out.residual : out.residual;
        out.converged = left <= tolerance;
        if (out.converged || out.iterations == most) return out;
        ccd_sweep(arm, joints, target);
    }
}

static Vec toward(const Vec& from, const Vec& to, Real length) {
    Vec apart = to - from;
    Real n = norm(apart);
    return n > 0 ? from + (length / n) * apart : from + Vec{length, 0, 0};
}

static Solved fabrik(Arm& arm, const Vec& target, int effector, Real tolerance, int most) {
    std::vector<int> joints = arm.chain(effector);
    if (most > 1) arm.bend(joints, target);
    arm.forward();
    std::reverse(joints.begin(), joints.end());
    std::size_t n = joints.size();
    Points p;
    Numbers l(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
        p.push_back(arm.x[joints[i]]);
        l[i] = i ? arm.length(joints[i]) : 0;
    }
    Vec root = p[0];
    Solved out;
    for (;; ++out.iterations) {
        out.residual = norm(p.back() - target);
        out.converged = out.residual <= tolerance;
        if (out.converged || out.iterations == most || n == 1) break;
        p[n - 1] = target;
        for (std::size_t i = n - 1; i-- > 0;) {
            bool wrong = planted("fabrik_link") && i > 0;
            p[i] = toward(p[i + 1], p[i], l[wrong ? i : i + 1]);
        }
        if (!planted("fabrik_root")) p[0] = root;
        for (std::size_t i = 1; i < n; ++i) p[i] = toward(p[i - 1], p[i], l[i]);
    }
    for (std::size_t i = 0; i + 1 < n; ++i) {
        Quat now = arm.local[joints[i]];
        if (i) now = arm.r[joints[i - 1]] * now;
        arm.spin(joints[i], between(rotate(now, arm.offsets[joints[i + 1]]), p[i + 1] - p[i]));
        arm.forward();
    }
    for (std::size_t i = 0; i < n; ++i) arm.x[joints[i]] = p[i];
    return out;
}

static Points resample(Points curve, bool closed, int count, Real spacing) {
    if (closed) curve.push_back(curve[0]);
    Numbers s(curve.size(), 0);
    for (std::size_t i = 1; i < s.size(); ++i) {
        Real piece = planted("resample_by_index") ? 1 : norm(curve[i] - curve[i - 1]);
        s[i] = s[i - 1] + piece;
    }
    if (count == 0) count = int(std::ceil(s.back() / spacing - EPS)) + (closed ? 0 : 1);
    int pieces = std::max(1, closed ? count : count - 1);
    Points out;
    std::size_t j = 0;
    for (int i = 0; i < count; ++i) {
        Real at = s.back() * i / pieces;
        while (j + 2 < s.size() && s[j + 1] < at) ++j;
        Real piece = s.size() > 1 ? s[j + 1] - s[j] : 0;
        Real part = piece > 0 ? std::min(Real(1), (at - s[j]) / piece) : 0;
        out.push_back(piece > 0 ? (1 - part) * curve[j] + part * curve[j + 1] : curve[j]);
    }
    return out;
}

struct System {
    Numbers m;
    std::vector<std::array<int, 2>> springs;
    Numbers rest, k, c;
    std::vector<int> pinned;
    Vec gravity;
    Points x, v;

    explicit System(const plumbob::Request& in)
        : m(in["masses"]), springs(in["springs"]), rest(in["rest_lengths"]), k(in["stiffnesses"]),
          c(in["dampings"]), pinned(in.has("pinned") ? in["pinned"] : std::vector<int>()),
          gravity(in["gravity"]), x(in["positions"]), v(in["velocities"]) {}

    Points forces() const {
        Points f;
        for (Real mass : m) f.push_back((planted("forces_mass_missing") ? 1 : mass) * gravity);
        for (std::size_t s = 0; s < springs.size(); ++s) {
            auto [i, j] = springs[s];
            Vec apart = x[i] - x[j];
            Real l = norm(apart);
            if (l == 0) continue;
            Vec u = (1 / l) * apart;
            Real rate = dot(v[i] - v[j], u), damping = c[s] * rate;
            if (planted("forces_damping_sign")) damping = -damping;
            Vec pull = (k[s] * (l - rest[s]) + damping) * u;
            f[i] = f[i] - pull, f[j] = f[j] + pull;
        }
        return f;
    }
};

static void energies(const System& system, plumbob::Answer& out) {
    Real kinetic = 0, elastic = 0, gravitational = 0;
    for (std::size_t i = 0; i < system.m.size(); ++i) {
        kinetic += system.m[i] / 2 * dot(system.v[i], system.v[i]);
        gravitational -= system.m[i] * dot(system.gravity, system.x[i]);
    }
    for (std::size_t s = 0; s < system.springs.size(); ++s) {
        auto [i, j] = system.springs[s];
        Real stretch = norm(system.x[i] - system.x[j]) - system.rest[s];
        elastic += system.k[s] * stretch * stretch / (planted("energy_half") ? 1 : 2);
    }
    out.set("total", kinetic + elastic + gravitational);
    out.set("kinetic", kinetic), out.set("potential", elastic + gravitational);
    out.set("elastic", elastic), out.set("gravitational", gravitational);
}

// The function g(x) = (x - y)' M (x - y) / 2 + h^2 E(x) that the step minimises, and its solver.
class Step {
  public:
    Step(const System& given, Real h) : system(given), h(h), moves(given.m.size(), -1) {
        if (planted("step_damping_absent")) std::fill(system.c.begin(), system.c.end(), 0);
        std::vector<bool> held(moves.size(), false);
        if (!planted("step_pins_overwritten") && !planted("step_pins_springs"))
            for (int i : system.pinned) held[i] = true;
        for (std::size_t i = 0; i < moves.size(); ++i)
            if (!held[i]) moves[i] = free++;
        before = lengths(system.x);
        for (std::size_t i = 0; i < moves.size(); ++i) {
            y.push_back(held[i] ? system.x[i] : system.x[i] + h * system.v[i]);
            Vec g = system.gravity;
            if (planted("step_gravity_mass")) g = (1 / system.m[i]) * g;
            if (planted("step_gravity_doubled")) g = Real(2) * g;
            fall.push_back(g);
        }
    }

    Points solve() const {
        Points x = y;
        if (planted("step_linearised")) x = system.x;
        int most = planted("step_linearised") ? 1 : 100;
        for (int iteration = 0; iteration < most; ++iteration) {
            Points g = gradient(x), d = direction(x, g);
            Real alpha = planted("step_hundredth") ? Real(0.01) : most == 1 ? 1 : search(x, g, d);
            Real size = 0, change = 0;
            for (std::size_t i = 0; i < x.size(); ++i) {
                x[i] = x[i] + alpha * d[i];
                size = std::max(size, norm(x[i])), change = std::max(change, alpha * norm(d[i]));
            }
            if (change <= EPS * size) break;
        }
        return x;
    }

  private:
    System system;
    Real h;
    std::vector<int> moves;
    int free = 0;
    Points y, fall;
    Numbers before;

    Numbers lengths(const Points& x) const {
        Numbers out;
        for (auto [i, j] : system.springs) out.push_back(norm(x[i] - x[j]));
        return out;
    }

    Real tension(std::size_t s, Real l) const {
        return system.k[s] * (l - system.rest[s]) + system.c[s] / h * (l - before[s]);
    }

    Real value(const Points& x) const {
        Real sum = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            Vec off = x[i] - y[i];
            sum += system.m[i] * (dot(off, off) / 2 - h * h * dot(fall[i], off));
        }
        Numbers l = lengths(x);
        for (std::size_t s = 0; s < l.size(); ++s) {
            Real stretch = l[s] - system.rest[s], change = l[s] - before[s];
            Real energy = system.k[s] * stretch * stretch + system.c[s] / h * change * change;
            sum += h * h / 2 * energy;
        }
        if (planted("step_pins_springs"))
            for (int i : system.pinned)
                sum += h * h / 2 * Real(5e5) * dot(x[i] - system.x[i], x[i] - system.x[i]);
        return sum;
    }

    Points gradient(const Points& x) const {
        Points g;
        for (std::size_t i = 0; i < x.size(); ++i)
            g.push_back(system.m[i] * (x[i] - y[i] - h * h * fall[i]));
        for (std::size_t s = 0; s < system.springs.size(); ++s) {
            auto [i, j] = system.springs[s];
            Real l = norm(x[i] - x[j]);
            if (l == 0) continue;
            Vec pull = (h * h * tension(s, l) / l) * (x[i] - x[j]);
            g[i] = g[i] + pull, g[j] = g[j] - pull;
        }
        if (planted("step_pins_springs"))
            for (int i : system.pinned) g[i] = g[i] + h * h * Real(5e5) * (x[i] - system.x[i]);
        for (std::size_t i = 0; i < x.size(); ++i)
            if (moves[i] < 0) g[i] = {0, 0, 0};
        return g;
    }

    std::vector<Numbers> hessian(const Points& x, Real shift) const {
        std::vector<Numbers> H(3 * free);
        for (int i = 0; i < 3 * free; ++i) H[i].assign(i + 1, 0);
        auto add = [&](int i, int j, int a, int b, Real what) {
            int row = 3 * moves[i] + a, column = 3 * moves[j] + b;
            if (moves[i] >= 0 && moves[j] >= 0 && column <= row) H[row][column] += what;
        };
        for (std::size_t i = 0; i < x.size(); ++i)
            for (int a = 0; a < 3; ++a) add(i, i, a, a, system.m[i] * (1 + shift));
        for (std::size_t s = 0; s < system.springs.size(); ++s) {
            auto [i, j] = system.springs[s];
            Real l = norm(x[i] - x[j]);
            if (l == 0) continue;
            Vec u = (1 / l) * (x[i] - x[j]);
            Real along = system.k[s] + system.c[s] / h, across = tension(s, l) / l;
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b) {
                    Real one = h * h * ((along - across) * u[a] * u[b] + (a == b ? across : 0));
                    add(i, i, a, b, one), add(j, j, a, b, one);
                    add(i, j, a, b, -one), add(j, i, a, b, -one);
                }
        }
        if (planted("step_pins_springs"))
            for (int i : system.pinned)
                for (int a = 0; a < 3; ++a) add(i, i, a, a, h * h * Real(5e5));
        return H;
    }

    // Cholesky's factor within the rows' first non-zero columns; false if H is not positive.
    static bool factor(std::vector<Numbers>& H, std::vector<int>& first) {
        int n = int(H.size());
        for (int i = 0; i < n; ++i) {
            first[i] = 0;
            while (first[i] < i && H[i][first[i]] == 0) ++first[i];
            for (int j = first[i]; j <= i; ++j) {
                Real sum = H[i][j];
                for (int k = std::max(first[i], first[j]); k < j; ++k) sum -= H[i][k] * H[j][k];
                if (i == j && sum <= 0) return false;
                H[i][j] = i == j ? std::sqrt(sum) : sum / H[j][j];
            }
        }
        return true;
    }

    Points direction(const Points& x, const Points& g) const {
        std::vector<int> first(3 * free);
        std::vector<Numbers> H = hessian(x, 0);
        for (Real shift = Real(1e-3); !factor(H, first); shift *= 4) H = hessian(x, shift);
        Numbers b(3 * free);
        for (std::size_t i = 0; i < x.size(); ++i)
            for (int a = 0; a < 3 && moves[i] >= 0; ++a) b[3 * moves[i] + a] = -g[i][a];
        for (int i = 0; i < 3 * free; ++i) {
            for (int k = first[i]; k < i; ++k) b[i] -= H[i][k] * b[k];
            b[i] /= H[i][i];
        }
        for (int i = 3 * free; i-- > 0;) {
            b[i] /= H[i][i];
            for (int k = first[i]; k < i; ++k) b[k] -= H[i][k] * b[i];
        }
        Points d(x.size(), Vec{0, 0, 0});
        for (std::size_t i = 0; i < x.size(); ++i)
            for (int a = 0; a < 3 && moves[i] >= 0; ++a) d[i][a] = b[3 * moves[i] + a];
        return d;
    }

    // The first of 1, 1/2, ... that lowers g enough or, within its rounding, the gradient; or 0.
    Real search(const Points& x, const Points& g, const Points& d) const {
        Real slope = 0, old = value(x), size = 0;
        for (std::size_t i = 0; i < x.size(); ++i) slope += dot(g[i], d[i]), size += dot(g[i], g[i]);
        for (Real alpha = 1; alpha > Real(1e-6); alpha /= 2) {
            Points there;
            for (std::size_t i = 0; i < x.size(); ++i) there.push_back(x[i] + alpha * d[i]);
            Real change = value(there) - old, left = 0;
            if (change <= Real(1e-4) * alpha * slope && change < 0) return alpha;
            for (const Vec& one : gradient(there)) left += dot(one, one);
            if (change <= 1000 * EPS * std::abs(old) && left < size) return alpha;
        }
        return 0;
    }
};

static void advance(System& system, Real h) {
    int substeps = planted("step_substeps") ? 10 : 1;
    for (int i : system.pinned) system.v[i] = {0, 0, 0};
    for (int n = 0; n < substeps; ++n) {
        Points x = Step(system, h / substeps).solve();
        if (planted("step_pins_overwritten"))
            for (int i : system.pinned) x[i] = system.x[i];
        for (std::size_t i = 0; i < x.size() && !planted("step_velocity_kept"); ++i)
            system.v[i] = (substeps / h) * (x[i] - system.x[i]);
        system.x = x;
    }
}

static Solved solve_ik(Arm& arm, const plumbob::Request& in, const Vec& target) {
    std::string method = in.has("method") ? in["method"] : std::string();
    return (method == "fabrik" ? fabrik : ccd)(arm, target, in["effector"], in["tolerance"],
                                               in["max_iterations"]);
}

static void kinematics(const plumbob::Request& in, plumbob::Answer& out) {
    Arm arm{in["parents"], in["offsets"], in["local_rotations"], {}, {}};
    if (in.task == "forward_kinematics") {
        arm.forward();
        out.set("positions", arm.x), out.set("rotations", arm.r);
    } else if (in.task == "inverse_kinematics") {
        Solved solved = solve_ik(arm, in, in["target"]);
        out.set("local_rotations", arm.local), out.set("positions", arm.x);
        out.set("residual", solved.residual), out.set("iterations", solved.iterations);
        out.set("converged", solved.converged);
    } else {
        std::vector<std::vector<Quat>> local;
        std::vector<Points> positions;
        std::vector<Quat> start = arm.local;
        Points curve = in["curve"];
        for (const Vec& target : curve) {
            if (planted("track_restarts")) arm.local = start;
            solve_ik(arm, in, target);
            local.push_back(arm.local), positions.push_back(arm.x);
        }
        out.set("local_rotations", local), out.set("positions", positions);
    }
}

static void dynamics(const plumbob::Request& in, plumbob::Answer& out) {
    System system(in);
    if (in.task == "mass_spring_forces") return out.set("forces", system.forces());
    if (in.task == "energy") return energies(system, out);
    if (in.task == "mass_spring_step") {
        advance(system, in["h"]);
        return out.set("positions", system.x), out.set("velocities", system.v);
    }
    std::vector<Points> x, v;
    for (int n = in["steps"]; n > 0; --n) {
        advance(system, in["h"]);
        x.push_back(system.x), v.push_back(system.v);
    }
    out.set("positions", x), out.set("velocities", v);
}

static void solve(const plumbob::Request& in, plumbob::Answer& out) {
    if (in.task == "resample") {
        int count = in.has("count") ? in["count"] : 0;
        Real spacing = in.has("spacing") ? in["spacing"] : Real(0);
        return out.set("points", resample(in["curve"], in["closed"], count, spacing));
    }
    in.has("parents") ? kinematics(in, out) : dynamics(in, out);
}

int main(int count, char** arguments) {
    if (count == 3 && std::string(arguments[1]) == "--fault") fault = arguments[2];
    std::string precision = sizeof(Real) == 8 ? "double" : "single";
    return plumbob::serve(R"("name": "lab in C++", "language": "C++", "methods": ["ccd", "fabrik"],
        "tasks": ["forward_kinematics", "inverse_kinematics", "track", "resample",
                  "mass_spring_forces", "energy", "mass_spring_step", "mass_spring_motion"],
        "step": {"method": "converged", "start": "y", "substeps": 1, "damper": "length_rate",
                 "pins": "eliminated", "velocity": "displacement"},
        "precision": ")" + precision + '"', solve);
}
