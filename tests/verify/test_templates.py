"""The starters build, greet, survive stray prints, and lack nothing but the user's code."""

import json
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import msgspec
import pytest
from protocol_page import TRANSCRIPT

from plumbob.verify.connections import open_connection
from plumbob.verify.greeting import Fixed, Greeting, Step, System
from plumbob.verify.task import TASKS
from plumbob.verify.templates import GREETING_FIELDS, LANGUAGES, template

REQUESTS = [request for request, _ in TRANSCRIPT]
OFFERED = [
    "forward_kinematics", "inverse_kinematics", "mass_spring_step",
    "robot_inverse_kinematics", "robot_jacobian",
]  # fmt: skip
# In each language: texts of its starter, and what could stand in their place.
FILLED = tomllib.loads(Path(__file__).with_name("starters.toml").read_text("utf-8"))


def build(language, folder, texts=()):
    """Write a starter, some texts replaced, compile it, and return what runs it.

    Skip without its compiler, which may be there without what it needs, as rustup's rustc.
    """
    for name, text in template(language).items():
        for old, new in texts:
            text = text.replace(old, new)
        (folder / name).write_text(text, encoding="utf-8")
    make, run = map(shlex.split, (LANGUAGES[language].build, LANGUAGES[language].run))
    for tool in (one[0] for one in (make, run) if one and not one[0].startswith("./")):
        question = "version" if tool == "go" else "--version"
        version = [shutil.which(tool) or "false", question]
        if subprocess.run(version, capture_output=True, check=False).returncode:
            pytest.skip(f"{tool} does not start here: the {language} starter was not built")
    if make:
        quick = ["-O1" if one == "-O2" else one for one in make if one != "-O"]
        subprocess.run(quick, cwd=folder, check=True, timeout=180, capture_output=True)
    return [sys.executable if one == "python3" else one for one in run]


def ask(run, folder, requests):
    lines = "".join(json.dumps(one) + "\n" for one in requests)
    done = subprocess.run(
        run, cwd=folder, input=lines, capture_output=True, text=True, timeout=60, check=True
    )
    return [json.loads(line) for line in done.stdout.splitlines()], done.stderr


@pytest.fixture(scope="module", params=LANGUAGES)
def language(request):
    return request.param


@pytest.fixture(scope="module")
def replies(language, tmp_path_factory):
    folder = tmp_path_factory.mktemp(language)
    return ask(build(language, folder), folder, REQUESTS)[0]


def test_starter_greets_and_fails_only_where_code_is_missing(replies):
    fields = {name: value for name, value in replies[0].items() if name != "id"}
    greeting = msgspec.convert(fields, Greeting)
    assert list(greeting.tasks) == OFFERED
    assert set(OFFERED) <= set(TASKS)
    assert greeting.language
    assert greeting.precision == "double"
    for request, reply in zip(REQUESTS, replies, strict=True):
        assert reply["id"] == request["id"]
        if request["task"] in OFFERED:
            expected = f"{request['task']} is not written yet"
            assert reply == {"id": request["id"], "error": expected}


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_filled_in_starter_answers_and_times_itself_through_stray_prints(language, tmp_path):
    missing = FILLED[language]["texts"][0][0]
    assert sum(text.count(missing) for text in template(language).values()) == 1
    run = build(language, tmp_path, FILLED[language]["texts"])
    pose = {
        "parents": [-1],
        "offsets": [[0.1, 1e-17, -1e22]],
        "local_rotations": [[0.6, 0, 0.8, 0]],
    }
    request = {"id": 7, "task": "forward_kinematics", **pose}
    robot = next(one for one in REQUESTS if one["task"] == "robot_inverse_kinematics")
    (reply, of_robot), printed = ask(run, tmp_path, [request, robot])
    assert of_robot["q"] == robot["start"]
    assert reply["positions"] == pose["offsets"]  # to the last digit
    assert reply["rotations"] == pose["local_rotations"]
    assert "stray" in printed
    assert reply["seconds"] > 0.04  # a wait may end a little early by another clock


# What the C++ starter needs of glm, which is not among our packages.
GLM = """
#define GLM_VERSION 1000
namespace glm {
enum qualifier { highp };
template <int n, class T, qualifier Q> struct vec {
    T x, y, z;
    T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
};
template <class T, qualifier Q> struct qua { T x, y, z, w; };
using vec3 = vec<3, float, highp>;
using quat = qua<float, highp>;
}
"""
TYPES = {
    "glm": (GLM, "glm::vec3", "glm::quat"),
    "Eigen": ("#include <Eigen/Geometry>\n", "Eigen::Vector3d", "Eigen::Quaterniond"),
}


@pytest.mark.parametrize("library", TYPES)
def test_the_starter_reads_and_writes_vectors_of(library, tmp_path, monkeypatch):
    if library == "Eigen":
        folders = [path for room in sys.path for path in Path(room).glob("*/include/eigen3")]
        if not folders:
            pytest.skip("Eigen is not on this machine")
        monkeypatch.setenv("CPLUS_INCLUDE_PATH", str(folders[0]))
    head, vector, quaternion = TYPES[library]
    assert vector in template("cpp")["solver.cpp"]

    texts = [
        FILLED["cpp"]["texts"][0],
        ('#include "plumbob.hpp"\n', head + '#include "plumbob.hpp"\n'),
        ("using Vec3 = std::array<double, 3>", f"using Vec3 = {vector}"),
        ("using Quat = std::array<double, 4>", f"using Quat = {quaternion}"),
    ]
    pose = {"offsets": [[0.5, 1.0, -2.0]], "local_rotations": [[0.5, -0.25, 0.75, 2.0]]}
    request = {"id": 7, "task": "forward_kinematics", "parents": [-1], **pose}
    (reply,), _ = ask(build("cpp", tmp_path, texts), tmp_path, [request])
    assert (reply["positions"], reply["rotations"]) == tuple(pose.values())


# Members of a class, which programs assign as often as they initialise variables.
MEMBERS = {
    "parents": "std::vector<int>",
    "offsets": "std::vector<std::array<double, 3>>",
    "target": "std::array<double, 3>",
    "method": "std::string",
    "tolerance": "double",
    "max_iterations": "int",
    "converged": "bool",
}


def test_fields_initialise_and_are_assigned(tmp_path):
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no g++ on this machine")
    members = "".join(f"{kind} {name};\n" for name, kind in MEMBERS.items())
    initial = "".join(f'{kind} {name} = in["{name}"];\n' for name, kind in MEMBERS.items())
    assigned = "".join(f'solver.{n} = in["{n}"]; solver.{n} = {n};\n' for n in MEMBERS)
    (tmp_path / "plumbob.hpp").write_text(template("cpp")["plumbob.hpp"], "utf-8")
    (tmp_path / "members.cpp").write_text(
        f'#include "plumbob.hpp"\nstruct Solver {{\n{members}}};\n'
        "void solve(const plumbob::Request& in, Solver& solver) {\n"
        f"{initial}{assigned}}}\n",
        "utf-8",
    )
    command = [compiler, "-std=c++17", "-fsyntax-only", "members.cpp"]
    done = subprocess.run(command, cwd=tmp_path, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("language", ["cpp", "rust", "javascript", "go", "java", "csharp"])
def test_starter_reads_the_method(language):
    code = [
        line.split("//")[0]
        for line in template(language)[LANGUAGES[language].files[0]].splitlines()
    ]
    assert any("method" in line for line in code)


@pytest.mark.parametrize("language", LANGUAGES)
def test_starter_is_short_and_lists_every_field_of_the_greeting(language):
    first, *others = LANGUAGES[language].files
    text = template(language)[first]
    lines = text.splitlines()
    assert len(lines) - len(GREETING_FIELDS.splitlines()) <= 120
    assert max(map(len, lines)) <= 100
    assert set(others) <= template(language).keys()
    words = re.findall(r"\w+", " ".join(re.findall(r"(?://|#) (.*)", text)))
    for kind in (Greeting, System, Step, Fixed):
        for field in msgspec.structs.fields(kind):
            assert field.name in words
            for values in re.findall(r"Literal\[(.*?)\]", str(field.type)):
                assert set(re.findall(r"'(\w+)'", values)) <= set(words), field.name
    assert "GREETING_FIELDS" not in text


def test_the_python_starter_declares_what_it_greets_with(tmp_path):
    path = tmp_path / "solver.py"
    text = template("python")["solver.py"].replace('"precision": "double"', '"precision": "single"')
    path.write_text(text)
    for program in (open_connection(str(path)), open_connection([sys.executable, str(path)])):
        try:
            assert program.greeting.precision == "single"
            assert list(program.greeting.tasks) == OFFERED
        finally:
            program.close()


def test_an_unknown_language_is_refused():
    with pytest.raises(ValueError, match="expected one of cpp, rust"):
        template("cobol")


def test_starters_and_catalogues_are_installed_with_the_package():
    project = Path(__file__).parents[2] / "pyproject.toml"
    data = tomllib.loads(project.read_text(encoding="utf-8"))
    patterns = data["tool"]["setuptools"]["package-data"]["plumbob.verify"]
    room = Path(sys.modules["plumbob.verify"].__file__).parent
    shipped = {path for pattern in patterns for path in room.glob(pattern)}
    for language in LANGUAGES.values():
        assert {room / "templates" / name for name in language.files} <= shipped
    assert set(room.rglob("*.toml")) <= shipped
