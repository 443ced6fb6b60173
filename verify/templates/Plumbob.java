// The protocol of `plumbob verify` (docs/protocol.md) for Java: nothing here needs to be changed.
import java.io.*;
import java.nio.charset.StandardCharsets;
import java.util.*;

/** A request by the names of its fields; null is NaN. */
class Request {
    final Map<String, Object> fields;

    Request(Map<String, Object> fields) { this.fields = fields; }

    Object get(String name) {
        if (!fields.containsKey(name)) throw new RuntimeException("the request has no " + name);
        return fields.get(name);
    }

    String text(String name) { return (String) get(name); }
    double number(String name) { return (Double) get(name); }
    int integer(String name) { return (int) number(name); }
    double[] numbers(String name) { return numbers(get(name)); }
    int[] integers(String name) { return integers(get(name)); }

    double[][] rows(String name) {
        return list(get(name)).stream().map(Request::numbers).toArray(double[][]::new);
    }

    int[][] pairs(String name) {
        return list(get(name)).stream().map(Request::integers).toArray(int[][]::new);
    }

    boolean[] flags(String name) {
        List<?> items = list(get(name));
        boolean[] flags = new boolean[items.size()];
        for (int i = 0; i < flags.length; i++) flags[i] = (Boolean) items.get(i);
        return flags;
    }

    private static List<?> list(Object value) { return (List<?>) value; }

    private static double[] numbers(Object value) {
        return list(value).stream().mapToDouble(item -> (Double) item).toArray();
    }

    private static int[] integers(Object value) {
        return list(value).stream().mapToInt(item -> (int) (double) (Double) item).toArray();
    }
}

class Parser {
    private final String line;
    private int at = 0;

    Parser(String line) { this.line = line; }

    Object value() {
        char next = peek();
        if (next == '{') return members();
        if (next == '[') return items();
        if (next == '"') return text();
        int start = at;
        while (at < line.length() && ",]} \t\r".indexOf(line.charAt(at)) < 0) at++;
        String word = line.substring(start, at);
        if (word.equals("null")) return Double.NaN;
        if (word.equals("true") || word.equals("false")) return word.equals("true");
        return Double.valueOf(word);
    }

    private char peek() {
        while (" \t\r".indexOf(line.charAt(at)) >= 0) at++;
        return line.charAt(at);
    }

    private void skip(char wanted) {
        if (peek() != wanted) throw new RuntimeException("the request is no JSON");
        at++;
    }

    private Map<String, Object> members() {
        Map<String, Object> members = new HashMap<>();
        for (skip('{'); peek() != '}'; ) {
            String name = text();
            skip(':');
            members.put(name, value());
            if (peek() != '}') skip(',');
        }
        skip('}');
        return members;
    }

    private List<Object> items() {
        List<Object> items = new ArrayList<>();
        for (skip('['); peek() != ']'; ) {
            items.add(value());
            if (peek() != ']') skip(',');
        }
        skip(']');
        return items;
    }

    private String text() { // \\uXXXX stays as it is: no request needs it
        StringBuilder out = new StringBuilder();
        for (skip('"'); line.charAt(at) != '"'; at++) {
            if (line.charAt(at) == '\\' && "\"\\/".indexOf(line.charAt(at + 1)) >= 0) at++;
            out.append(line.charAt(at));
        }
        at++;
        return out.toString();
    }
}

class Plumbob {
    interface Solver { void solve(Request request, Map<String, Object> answer) throws Exception; }

    private static String write(Object value) {
        StringJoiner out = new StringJoiner(",", "[", "]");
        if (value instanceof double[] numbers) for (double one : numbers) out.add(write(one));
        else if (value instanceof float[] numbers) for (float one : numbers) out.add(write(one));
        else if (value instanceof Object[] rows) for (Object row : rows) out.add(write(row));
        else if (value instanceof Collection<?> items) for (Object one : items) out.add(write(one));
        else if (value instanceof Double number && !Double.isFinite(number)) return "null";
        else if (value instanceof Float number && !Float.isFinite(number)) return "null";
        else if (value instanceof String text) return quote(text);
        else return String.valueOf(value);
        return out.toString();
    }

    private static String quote(String text) {
        String safe = text.replace("\\", "\\\\").replace("\"", "\\\"").replaceAll("\\p{Cntrl}", " ");
        return '"' + safe + '"';
    }

    /** Answers every request until standard input ends; the greeting is members of an object. */
    @SuppressWarnings("unchecked")
    static void serve(String greeting, Map<String, Solver> solvers) throws IOException {
        PrintStream answers = new PrintStream(new FileOutputStream(FileDescriptor.out), true, "UTF-8");
        System.setOut(System.err); // what else is printed goes to the errors and does no harm
        var input = new BufferedReader(new InputStreamReader(System.in, StandardCharsets.UTF_8));
        for (String line; (line = input.readLine()) != null; ) {
            Request request = new Request((Map<String, Object>) new Parser(line).value());
            Map<String, Object> answer = new LinkedHashMap<>();
            answer.put("id", request.integer("id"));
            String text = "";
            if (request.text("task").equals("greeting")) {
                text = ",\"protocol\":1," + greeting.replace('\n', ' ')
                    + ",\"tasks\":" + write(new TreeSet<>(solvers.keySet()));
            } else {
                answer(request, answer, solvers.get(request.text("task")));
            }
            StringJoiner members = new StringJoiner(",");
            answer.forEach((name, value) -> members.add(quote(name) + ":" + write(value)));
            answers.println("{" + members + text + "}");
        }
    }

    private static void answer(Request request, Map<String, Object> answer, Solver solver) {
        try {
            long start = System.nanoTime();
            solver.solve(request, answer);
            answer.put("seconds", (System.nanoTime() - start) * 1e-9);
        } catch (Exception error) {
            answer.put("error", String.valueOf(error.getMessage()));
        }
    }
}
