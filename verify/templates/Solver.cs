// A starter for `plumbob verify -- dotnet out/Solver.dll`. Offer only what you have: see Main.
// Build: dotnet build -o out Solver.csproj
using System.Text.Json;
using System.Text.Json.Serialization;

class Request { // positions are x, y, z [m]; rotations are unit quaternions w, x, y, z
    public int id, effector, max_iterations;
    public string task = "", method = "";
    public int[] parents = null!, pinned = null!; // parents precede children, the root's is -1
    public int[][] springs = null!; // pairs of particles
    public double[][] offsets = null!, local_rotations = null!;
    public double[][] positions = null!, velocities = null!;
    public double[] masses = null!, rest_lengths = null!, stiffnesses = null!, dampings = null!;
    public double[] target = null!, gravity = null!; // gravity is an acceleration
    public double tolerance, tolerance_rotation, h;
    public double[][] origins = null!, orientations = null!, axes = null!; // of a robot's joints
    public bool[] slides = null!; // along the axis; else the joint rotates about it
    public double[] lower = null!, upper = null!, start = null!, q = null!;
    public double[] tool_position = null!, tool_rotation = null!; // of the joint `effector`
    public double[] target_position = null!, target_rotation = null!;
    public string urdf = ""; // the same robot as a text
}

static class Solver {
    // Fill in "positions" and "rotations", global, of all joints, as double[][].
    static void ForwardKinematics(Request input, Dictionary<string, object> answer) =>
        throw new Exception("forward_kinematics is not written yet");

    // Fill in "local_rotations" that bring the joint `effector` to the target.
    static void InverseKinematics(Request input, Dictionary<string, object> answer) =>
        throw new Exception("inverse_kinematics is not written yet");

    // Fill in "positions" and "velocities" a time h later.
    static void MassSpringStep(Request input, Dictionary<string, object> answer) =>
        throw new Exception("mass_spring_step is not written yet");

    // Fill in "q", coordinates within their limits that bring the tool to the target, as double[].
    static void RobotInverseKinematics(Request input, Dictionary<string, object> answer) =>
        throw new Exception("robot_inverse_kinematics is not written yet");

    // Fill in "jacobian", the tool's linear and angular velocity by joint, as 6 rows double[][].
    static void RobotJacobian(Request input, Dictionary<string, object> answer) =>
        throw new Exception("robot_jacobian is not written yet");

    // GREETING_FIELDS
    static void Main() {
        var tasks = new Dictionary<string, Action<Request, Dictionary<string, object>>> {
            ["forward_kinematics"] = ForwardKinematics,
            ["inverse_kinematics"] = InverseKinematics,
            ["mass_spring_step"] = MassSpringStep,
            ["robot_inverse_kinematics"] = RobotInverseKinematics,
            ["robot_jacobian"] = RobotJacobian,
        };
        var offered = new List<string>(tasks.Keys);
        tasks["greeting"] = (input, answer) => {
            (answer["protocol"], answer["tasks"]) = (1, offered);
            (answer["language"], answer["precision"]) = ("C#", "double");
        };
        using var answers = new StreamWriter(Console.OpenStandardOutput()) { AutoFlush = true };
        Console.SetOut(Console.Error); // what else is printed does no harm
        JsonSerializerOptions json = new() { IncludeFields = true, Converters = { new NullNaN() } };
        while (Console.ReadLine() is string line) {
            var input = JsonSerializer.Deserialize<Request>(line, json)!;
            var reply = new Dictionary<string, object> { ["id"] = input.id };
            var watch = System.Diagnostics.Stopwatch.StartNew();
            try { tasks[input.task](input, reply); reply["seconds"] = watch.Elapsed.TotalSeconds; }
            catch (Exception e) { reply["error"] = e.Message; }
            answers.WriteLine(JsonSerializer.Serialize(reply, json));
        }
    }
}

class NullNaN : JsonConverter<double> {
    public override bool HandleNull => true;
    public override double Read(ref Utf8JsonReader reader, Type type, JsonSerializerOptions _) =>
        reader.TokenType == JsonTokenType.Null ? double.NaN : reader.GetDouble();
    public override void Write(Utf8JsonWriter to, double value, JsonSerializerOptions _)
    { if (double.IsFinite(value)) to.WriteNumberValue(value); else to.WriteNullValue(); }
}
