"""The command `show`: our scenes, and yours beside ours, as pictures and pages."""

import json
import re
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from plumbob.bench.player import motion
from plumbob.bench.show import scenes as shows
from plumbob.bench.show.scene_solver import SceneSolver
from plumbob.cli import main as cli
from plumbob.reference import ImplicitEuler, State, curves, resample, scenes, solve_ik

IK = """
    import numpy as np
    from plumbob import Skeleton, set_backend, solve_ik

    def inverse_kinematics(parents, offsets, local_rotations, target, effector):
        with set_backend("python"):  # this process would compile first
            found = solve_ik(Skeleton(parents, offsets), local_rotations, target, solver="ccd"{})
        return {{"local_rotations": found.local_rotations}}
"""
STEP = """
    from plumbob import ImplicitEuler, MassSpring, State

    def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity,
                         positions, velocities, h):
        system = MassSpring(masses, springs, rest_lengths=rest_lengths, stiffnesses=stiffnesses,
                            dampings=dampings, pinned=pinned, gravity=gravity)
        after = ImplicitEuler(system, h=h).step(State(positions, velocities)).state
        return {{"positions": after.positions{}, "velocities": after.velocities}}
"""

# Two that import nothing, to be drawn.
STILL = """
    def mass_spring_step(positions, velocities):
        return {"positions": positions, "velocities": velocities}
"""
DOT = """
    def track(parents, curve):
        return {"positions": [[list(point)] * len(parents) for point in curve]}
"""


@pytest.fixture(autouse=True)
def short(monkeypatch, tmp_path):
    """Curves of few points and a short swing, in a folder of their own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(shows, "FRAMES", 6)
    monkeypatch.setattr(shows, "MIN_SPACING", 0.3)
    monkeypatch.setattr(shows, "MAX_SPACING", 0.6)


def file(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(textwrap.dedent(text), encoding="utf-8")
    return str(path)


def errors(page):
    """The errors of each motion of a page, in the order of its solvers."""
    text = page.read_text(encoding="utf-8")
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', text)[1])
    return [one["errors"] for one in data["motions"]]


def show(capsys, *arguments):
    code = cli.run_command(["show", *map(str, arguments)])
    told = capsys.readouterr()
    return code, told.out, told.err


def test_an_honest_arm_is_as_near_as_ours_and_each_frame_starts_from_the_last(tmp_path):
    mine = SceneSolver.open([file(tmp_path, "my_ik.py", IK.format(""))])
    found = shows.arm_motion("circle", "ccd")
    told = []
    positions = mine.follow_curve(*found[:3], lambda done, total: told.append((done, total)))
    mine.close()
    np.testing.assert_allclose(positions, found.motion.positions, atol=1e-9)
    assert told[-1] == (len(found.curve), len(found.curve))
    start = solve_ik(found.skeleton, found.rest, found.curve[-1], solver="ccd").positions
    assert np.abs(positions[-1] - start).max() > 1e-3


@pytest.mark.slow
def test_the_cloth_by_your_steps_is_as_far_off_as_it_is(tmp_path):
    system, start = scenes.lab_cloth()
    for change, least in (("", 0.0), (" + 1e-3", 1e-3)):
        yours = SceneSolver.open([file(tmp_path, "my_cloth.py", STEP.format(change))])
        found = shows.cloth_motion("newton")
        positions = yours.step_cloth(*found[:2], len(found.positions) - 1, lambda *_: None)
        yours.close()
        scene = shows.cloth_scene(found, "newton", [("yours", positions)])
        assert scene.motions[1].errors.max() == 0.0
        assert least <= scene.motions[0].errors.max() < 1e-6 + 100 * least
    state = State(start.positions, start.velocities)
    first = ImplicitEuler(system, h=shows.H).step(state).state.positions
    np.testing.assert_allclose(found.positions[1], first, atol=0)


def test_a_cloth_that_blows_up_is_shown_until_it_does(tmp_path):
    mine = file(
        tmp_path,
        "bang.py",
        """
        def mass_spring_step(positions, velocities, h):
            return {"positions": positions * 1e200, "velocities": velocities}
        """,
    )
    yours = SceneSolver.open([mine])
    found = shows.cloth_motion("newton")
    positions = yours.step_cloth(*found[:2], len(found.positions) - 1, lambda *_: None)
    yours.close()
    assert np.isfinite(positions[1]).all()
    assert np.isnan(positions[-1]).all()
    text = motion.page(shows.cloth_scene(found, "newton", [("yours", positions)]))
    assert "NaN" not in text
    assert "Infinity" not in text


@pytest.mark.sample("html-circle", "svg-cloth")
@pytest.mark.parametrize("scene", ["circle", "cloth"])
@pytest.mark.parametrize("suffix", ["html", "svg"])
def test_both_are_drawn_in_either_form(capsys, tmp_path, scene, suffix):
    mine = file(tmp_path, "mine.py", STILL if scene == "cloth" else DOT)
    path = tmp_path / f"{scene}.{suffix}"
    assert show(capsys, scene, "--with", mine, "-o", path) == (0, f"{path}\n", "")
    text = path.read_text(encoding="utf-8")
    assert "mine.py" in text
    if (scene, suffix) == ("circle", "html"):
        assert text.index("mine.py") < text.index("Plumbob FABRIK")
        yours, ours = errors(path)
        assert max(yours) == 0.0 < max(ours) <= 1e-4


def test_a_page_of_one_arm_is_written_without_a_name(capsys, tmp_path):
    assert show(capsys, "star", "--solver", "ccd") == (0, f"{Path('report/star.html')}\n", "")
    page = tmp_path / "report" / "star.html"
    assert page.read_text(encoding="utf-8").count("<canvas") == 1
    assert max(errors(page)[0]) <= 1e-4


def extent(path):
    """Return the width and the height of the curve in a picture."""
    lines = re.findall(r'd="(M[^"]*)"[^>]*stroke: #d5d9df', path.read_text(encoding="utf-8"))
    numbers = re.findall(r"-?[\d.]+", max(lines, key=len))
    return np.ptp(np.array(numbers, dtype=float).reshape(-1, 2), axis=0)


@pytest.mark.parametrize("name", ["heart", "star", "circle"])
def test_a_curve_in_a_plane_is_seen_upright_and_almost_face_on(capsys, tmp_path, monkeypatch, name):
    monkeypatch.setattr(shows, "FRAMES", 20)
    path = tmp_path / f"{name}.svg"
    assert show(capsys, name, "-o", path)[0] == 0
    points = resample(curves[name](), min_spacing=0.3, max_spacing=0.6)
    wide, high = extent(path) / np.ptp(points[:, [0, 2]], axis=0)
    assert 0.9 < high / wide < 1.02


@pytest.mark.slow
def test_a_still_shows_the_whole_curve_by_each_solver_and_what_its_colours_mean(capsys, tmp_path):
    mine = file(tmp_path, "mine.py", IK.format(""))
    assert show(capsys, "heart", "--with", mine, "-o", "heart.svg")[0] == 0
    svg = (tmp_path / "heart.svg").read_text(encoding="utf-8")
    for text in ("mine.py", "Plumbob FABRIK", "distance to the target", "largest"):
        assert f">{text}" in svg or f"{text} " in svg
    assert re.search(r">\d+ (nm|µm|mm)<", svg)
    poses = re.findall(r"stroke: #0b62a8; stroke-opacity: ([\d.]+)", svg)
    assert 0 < max(map(float, poses)) < 0.3


def test_a_program_behind_two_dashes_is_shown_with_the_scene_it_can_do(capsys, tmp_path):
    program = file(
        tmp_path,
        "program.py",
        """
        import json, sys
        for line in sys.stdin:
            asked = json.loads(line)
            if asked["task"] == "greeting":
                answer = {"protocol": 1, "tasks": ["track"], "name": "The Dot"}
            else:
                answer = {"positions": [[p] * len(asked["parents"]) for p in asked["curve"]]}
            print(json.dumps({"id": asked["id"], **answer}), flush=True)
        """,
    )
    code, out, err = show(capsys, "-o", "dot.html", "--", sys.executable, program)
    assert (code, err) == (0, "")
    assert (
        "The lab’s arm draws the custom curve: The Dot beside Plumbob FABRIK"
        in (tmp_path / "dot.html").read_text()
    )


FORWARD = "def forward_kinematics(parents): return 0"
TRACKS = "def track(curve): return curve"
RAISES = "def inverse_kinematics(target): raise KeyError('oh')"
FAULTS = {
    "no such function": ("def solve(x): return x", ["circle"], "inverse_kinematics.*got solve"),
    "of another task": (FORWARD, ["circle"], "inverse_kinematics for an arm.*has forward_kin"),
    "of no scene": (FORWARD, [], "mass_spring_motion.*which has forward_kinematics"),
    "an arm for a cloth": (TRACKS, ["cloth"], "mass_spring_motion for a cloth.*has track"),
    "it raises": (RAISES, ["circle"], "frame 1 of.*raised KeyError in line 1 of mine.py: 'oh'"),
    "no pose": ("def inverse_kinematics(target): return {'residual': 0.5}", ["circle"],
                "expected positions in the answer.*got residual"),
    "two solvers": (TRACKS, ["circle", "--", "b"], "expected one solver, got --with and a program"),
    "a syntax error": ("def f(:", ["circle"], "expected a solver, got.*SyntaxError in line 1"),
    "no file": (None, ["circle"], "mine.py, which does not exist"),
    "no motions as bones": (TRACKS, ["circle", "-o", "a.bvh"], "one of .html, .svg, got '.bvh'"),
}  # fmt: skip


@pytest.mark.sample(every=2)
@pytest.mark.parametrize(("text", "arguments", "words"), FAULTS.values(), ids=FAULTS)
def test_what_is_wrong_with_a_solver_is_said_in_a_sentence(
    capsys, tmp_path, text, arguments, words
):
    if text:
        file(tmp_path, "mine.py", text)
    code, out, err = show(capsys, "--with", "mine.py", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert re.search(words, err), err


def test_an_exploding_motion_leaves_the_others_large_enough_to_see():
    still = np.zeros((2, 3, 3)) + np.eye(3)
    exploding = still.copy()
    exploding[1] *= 1e9
    exploding[1, 0] = np.nan
    motions = [
        motion.Moving(name, x, np.zeros(2))
        for name, x in zip("ab", (still, exploding), strict=True)
    ]
    scene = motion.Scene("", "", "", motions, 1.0, "", (0.0, 0.0)).checked()
    assert np.abs(scene.points()).max() == 1.0
