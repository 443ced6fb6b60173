// FABRIK on a list of vectors whose root is never put back; the joints are turned to the points.
import java.util.*;

class Floating {
    record Vec(double x, double y, double z) {
        Vec plus(Vec o) { return new Vec(x + o.x, y + o.y, z + o.z); }
        Vec minus(Vec o) { return new Vec(x - o.x, y - o.y, z - o.z); }
        Vec times(double s) { return new Vec(s * x, s * y, s * z); }
        double dot(Vec o) { return x * o.x + y * o.y + z * o.z; }
        double length() { return Math.sqrt(dot(this)); }
        Vec cross(Vec o) { return new Vec(y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x); }
        static Vec of(double[] a) { return new Vec(a[0], a[1], a[2]); }
        double[] array() { return new double[] {x, y, z}; }
    }

    record Quat(double w, Vec v) {
        Quat times(Quat o) {
            Vec vector = o.v.times(w).plus(v.times(o.w)).plus(v.cross(o.v));
            return new Quat(w * o.w - v.dot(o.v), vector);
        }
        Quat inverse() { return new Quat(w, v.times(-1)); }
        Vec turn(Vec p) { return times(new Quat(0, p)).times(inverse()).v; }
        Quat unit() {
            double n = Math.sqrt(w * w + v.dot(v));
            return n < 1e-12 ? new Quat(1, v.times(0)) : new Quat(w / n, v.times(1 / n));
        }
        double[] array() { return new double[] {w, v.x, v.y, v.z}; }
        static Quat of(double[] q) { return new Quat(q[0], new Vec(q[1], q[2], q[3])); }
        static Quat between(Vec a, Vec b) {
            return new Quat(a.length() * b.length() + a.dot(b), a.cross(b)).unit();
        }
    }

    static Vec[] place(int[] parents, Vec[] offsets, Quat[] local, Quat[] global) {
        Vec[] points = new Vec[parents.length];
        for (int j = 0; j < points.length; j++) {
            int up = parents[j];
            points[j] = up < 0 ? offsets[j] : points[up].plus(global[up].turn(offsets[j]));
            global[j] = up < 0 ? local[j] : global[up].times(local[j]);
        }
        return points;
    }

    static void reach(List<Vec> p, Vec target, double tolerance, int limit) {
        int last = p.size() - 1;
        double[] d = new double[last];
        for (int i = 0; i < last; i++) d[i] = p.get(i + 1).minus(p.get(i)).length();
        for (int n = 0; n < limit; n++) {
            p.set(last, target);
            for (int i = last - 1; i >= 0; i--) p.set(i, pull(p.get(i + 1), p.get(i), d[i]));
            for (int i = 0; i < last; i++) p.set(i + 1, pull(p.get(i), p.get(i + 1), d[i]));
            if (p.get(last).minus(target).length() <= tolerance) break;
        }
    }

    static Vec pull(Vec fixed, Vec moved, double length) {
        Vec line = moved.minus(fixed);
        return fixed.plus(line.times(length / line.length()));
    }

    static void fabrik(Request ask, Map<String, Object> answer) {
        int[] parents = ask.integers("parents");
        Vec[] offsets = Arrays.stream(ask.rows("offsets")).map(Vec::of).toArray(Vec[]::new);
        Quat[] local = Arrays.stream(ask.rows("local_rotations")).map(Quat::of).toArray(Quat[]::new);
        Quat[] global = new Quat[local.length];
        LinkedList<Integer> path = new LinkedList<>();
        for (int j = ask.integer("effector"); j >= 0; j = parents[j]) path.addFirst(j);
        Vec[] points = place(parents, offsets, local, global);
        List<Vec> goals = new ArrayList<>();
        for (int j : path) goals.add(points[j]);
        Vec target = Vec.of(ask.numbers("target"));
        reach(goals, target, ask.number("tolerance"), ask.integer("max_iterations"));
        for (int i = 0; i + 1 < path.size(); i++) {
            int j = path.get(i);
            points = place(parents, offsets, local, global);
            Vec now = points[path.get(i + 1)].minus(points[j]);
            Quat world = Quat.between(now, goals.get(i + 1).minus(goals.get(i))).times(global[j]);
            local[j] = (i == 0 ? world : global[parents[j]].inverse().times(world)).unit();
        }
        answer.put("local_rotations", Arrays.stream(local).map(Quat::array).toArray());
    }

    public static void main(String[] arguments) throws Exception {
        Plumbob.serve(
            "\"name\": \"vectors\", \"language\": \"Java\", \"methods\": [\"fabrik\"]",
            Map.of("inverse_kinematics", Floating::fabrik));
    }
}
