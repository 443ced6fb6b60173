// Right: Verlet's step on points that keep their previous position; no dampers.
import java.util.*;

class Verlet {
    static class Point {
        final double mass;
        double[] now, before, force;
        boolean pinned;

        Point(double mass, double[] now, double[] before) {
            this.mass = mass;
            this.now = now.clone();
            this.before = before.clone();
        }

        void pull(double[] line, double factor) {
            for (int c = 0; c < 3; c++) force[c] += factor * line[c];
        }

        void move(double h) {
            for (int c = 0; c < 3 && !pinned; c++) {
                double next = 2 * now[c] - before[c] + h * h * force[c] / mass;
                before[c] = now[c];
                now[c] = next;
            }
        }
    }

    static void stick(Point a, Point b, double rest, double stiffness) {
        double[] line = new double[3];
        double square = 0;
        for (int c = 0; c < 3; c++) {
            line[c] = b.now[c] - a.now[c];
            square += line[c] * line[c];
        }
        double length = Math.sqrt(square), factor = stiffness * (length - rest) / length;
        a.pull(line, factor);
        b.pull(line, -factor);
    }

    static void step(Request ask, Map<String, Object> answer) {
        double[] masses = ask.numbers("masses"), gravity = ask.numbers("gravity");
        double[] rest = ask.numbers("rest_lengths"), stiffness = ask.numbers("stiffnesses");
        double[][] now = ask.rows("positions"), before = ask.rows("previous_positions");
        List<Point> points = new ArrayList<>();
        for (int i = 0; i < masses.length; i++) {
            Point point = new Point(masses[i], now[i], before[i]);
            point.force = new double[3];
            point.pull(gravity, masses[i]);
            points.add(point);
        }
        for (int i : ask.integers("pinned")) points.get(i).pinned = true;
        int[][] pairs = ask.pairs("springs");
        for (int s = 0; s < pairs.length; s++)
            stick(points.get(pairs[s][0]), points.get(pairs[s][1]), rest[s], stiffness[s]);
        for (Point point : points) point.move(ask.number("h"));
        answer.put("positions", points.stream().map(point -> point.now).toArray());
    }

    public static void main(String[] arguments) throws Exception {
        Plumbob.serve(
            "\"name\": \"points\", \"language\": \"Java\", \"system\":"
                + " {\"state\": \"previous_positions\"}, \"step\": {\"damper\": \"none\"}",
            Map.of("mass_spring_step", Verlet::step));
    }
}
