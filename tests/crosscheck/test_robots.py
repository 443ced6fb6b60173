"""Robots and characters read from files: what the claims see, and what each engine makes of them.

Two files of our own making hold one of everything; the files of others are swept in a small slice,
and wholly if asked for slow tests.
"""

import re
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from crosscheck.engines import ROBOT_ENGINES
from crosscheck.engines.robot_engine import UnreadableError
from crosscheck.robots import comparisons, models
from crosscheck.robots.claims import ROBOT_CLAIMS, robot_claims
from crosscheck.robots.comparisons import differences
from crosscheck.robots.models import CAUSES, CHARACTERS, ROBOTS, STILL, UNREAD, Model
from crosscheck.robots.sweep import ours, sweep
from crosscheck.verdict import judge
from reference import Articulation
from reference.formats import mjcf, urdf

URDF = """<robot name="all">
  <link name="base"/><link name="wrist"/><link name="arm"/><link name="tool"/><link name="rail"/>
  <link name="finger"/><link name="thumb"/><link name="nail"/>
  <joint name="wheel" type="continuous">
    <parent link="arm"/><child link="wrist"/>
    <origin xyz="0.3 0.1 -0.2" rpy="0.4 -0.7 1.9"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0.1 0.2 0.5" rpy="0.3 0.5 -0.8"/><axis xyz="1 2 -2"/>
    <limit lower="-1.5" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="weld" type="fixed">
    <parent link="wrist"/><child link="tool"/><origin xyz="0 0 0.4" rpy="-1.2 0.2 0.6"/>
  </joint>
  <joint name="lift" type="prismatic">
    <parent link="base"/><child link="rail"/>
    <origin xyz="-0.4 0 0.1" rpy="0.9 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="-0.2" upper="0.6" effort="1" velocity="1"/>
  </joint>
  <joint name="grip" type="prismatic">
    <parent link="tool"/><child link="finger"/>
    <origin xyz="0 0.1 0" rpy="0 0.2 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="1" velocity="1"/>
  </joint>
  <joint name="oppose" type="revolute">
    <parent link="finger"/><child link="thumb"/>
    <origin xyz="0.1 0 0" rpy="0.1 0.2 0.3"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
    <mimic joint="shoulder" multiplier="-0.5" offset="0.7"/>
  </joint>
  <joint name="root" type="fixed">
    <parent link="thumb"/><child link="nail"/><origin xyz="0.2 0 0.1"/>
  </joint>
</robot>"""

# Bodies breadth-first by name; a second joint on a body, each about an anchor of its own.
MJCF = """<mujoco model="all">
  <compiler angle="degree" eulerseq="zyx"/>
  <worldbody>
    <body name="trunk" pos="0 0 1.2">
      <geom size="0.1"/><freejoint name="root"/>
      <body name="hip" pos="0.2 0.1 -0.3" euler="20 -40 70">
        <geom size="0.1"/>
        <joint name="swing" type="hinge" axis="1 1 0" pos="0.05 0 0.1" range="-60 80"/>
        <joint name="turn" type="hinge" axis="0 0 1" pos="0 0.07 0" range="-30 45"/>
        <body name="shin" pos="0 0 -0.5" axisangle="0 1 0 35">
          <geom size="0.1"/>
          <joint name="slip" type="slide" axis="0 1 1" range="-0.2 0.3" ref="0.1"/>
          <body name="foot" pos="0.1 0.2 -0.4">
            <geom size="0.1"/>
            <joint name="bend" axis="1 1 0" pos="0.05 0 0.1" range="-60 80" ref="25"/>
            <body name="toe" pos="0.2 0 0"><geom size="0.1"/></body>
          </body>
        </body>
      </body>
      <body name="neck" pos="0 0 0.4" quat="0.8 0 0.6 0">
        <geom size="0.1"/><joint name="neck" type="ball"/>
        <body name="head" pos="0.1 0 0.2" zaxis="1 0 2">
          <geom size="0.1"/><body name="nose" pos="0.1 0.1 0"><geom size="0.1"/></body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"""

TEXTS = {ROBOTS: ("all.urdf", URDF), CHARACTERS: ("all.xml", MJCF)}
ONE = ("hinge", "slide")
READERS = {ROBOTS: urdf, CHARACTERS: mjcf}
QUANTITIES = ("positions", "rotations", "jacobians")

# What a reader does that does not see something: (pattern, what it reads in its place).
BLIND = {
    ROBOTS: {
        "rpy not read": (r'rpy="[^"]*"', ""),
        "xyz of the origin not read": (r'<origin xyz="[^"]*"', "<origin"),
        "axis not read": (r"<axis[^>]*>", ""),
        "a slide read as a hinge": ("prismatic", "revolute"),
        "offset of a mimic dropped": (r' offset="[^"]*"', ""),
        "multiplier of a mimic dropped": (r'multiplier="[^"]*"', ""),
        "multiplier of a mimic without its sign": ('multiplier="-', 'multiplier="'),
    },
    CHARACTERS: {
        "degrees for radians": ('angle="degree"', 'angle="radian"'),
        "sequence of the Euler angles not read": (r'eulerseq="[^"]*"', ""),
        "euler not read": (r'euler="[^"]*"', ""),
        "axisangle not read": (r'axisangle="[^"]*"', ""),
        "zaxis not read": (r'zaxis="[^"]*"', ""),
        "quat as xyzw": ('quat="0.8 0 0.6 0"', 'quat="0 0.8 0 0.6"'),
        "anchors not read": (r'(axis="[01 ]*") pos="[^"]*"', r"\1"),
        "ref not read": (r'ref="[^"]*"', ""),
        "joints of a body in another order": (
            r"(<joint name=.swing.*)\n\s*(<joint name=.turn.*)",
            r"\2\n\1",
        ),
    },
}
# These change no angle.
KEEPS_ROTATIONS = {"xyz of the origin not read", "anchors not read"}


def rebuilt(articulation, **changes):
    names = ("skeleton", "kinds", "axes", "frames", "lower", "upper", "cones", "mimics")
    return Articulation(**{name: changes.get(name, getattr(articulation, name)) for name in names})


def turned_frames(robot, change):
    """The robot with the roll, pitch and yaw of its frames changed."""
    turns = Rotation.from_quat(robot.articulation.frames, scalar_first=True)
    frames = change(turns.as_euler("xyz")).as_quat(scalar_first=True)
    return robot._replace(articulation=rebuilt(robot.articulation, frames=frames))


def slipped(robot, q, links, *, slip):
    """Stand in for `ours`, with one slip in what was read, in q, or in the formulas."""
    a = robot.articulation
    if slip == "rpy in the other order":
        robot = turned_frames(robot, lambda rpy: Rotation.from_euler("XYZ", rpy))
    if slip == "rpy in degrees":
        robot = turned_frames(robot, lambda rpy: Rotation.from_euler("xyz", rpy, degrees=True))
    if slip == "axis not turned by the frame":
        frames = Rotation.from_quat(a.frames, scalar_first=True)
        robot = robot._replace(articulation=rebuilt(a, axes=frames.inv().apply(a.axes.copy())))
    if slip == "joints by their order in another tree":
        single = [a.coordinates_of(j).start for j, k in enumerate(a.kinds) if k in ONE]
        q = q.copy()
        q[:, single] = q[:, single[::-1]]
    if slip == "degrees for radians":
        q = np.degrees(q)
    if slip == "mimic joints not in the Jacobian":
        held = rebuilt(a, kinds=["fixed" if j in a.mimics else k for j, k in enumerate(a.kinds)],
                       mimics={})  # fmt: skip
        still = ours(robot._replace(articulation=held), q, links)
        return ours(robot, q, links)._replace(jacobians=still.jacobians)
    motion = ours(robot, q, links)
    return motion._replace(jacobians=slipped_jacobians(motion, slip))


def slipped_jacobians(motion, slip):
    J, R = motion.jacobians.copy(), motion.matrices
    linear, angular = J[..., :3, :], J[..., 3:, :]
    if slip == "Jacobian along the link's own axes":
        inverse = np.swapaxes(R, -1, -2)
        J = np.concatenate([inverse @ linear, inverse @ angular], axis=-2)
    if slip == "Jacobian at the origin of the world":
        linear += np.cross(motion.positions[..., None], angular, axis=-2)
    if slip == "angular rows first":
        J = np.roll(J, 3, axis=-2)
    return J


FORMULAS = {
    "rpy in the other order": QUANTITIES,
    "rpy in degrees": QUANTITIES,
    "axis not turned by the frame": QUANTITIES,
    "joints by their order in another tree": QUANTITIES,
    "degrees for radians": QUANTITIES,
    "Jacobian along the link's own axes": ("jacobians",),
    "Jacobian at the origin of the world": ("jacobians",),
    "angular rows first": ("jacobians",),
    "mimic joints not in the Jacobian": ("jacobians",),
}


@pytest.fixture
def small(tmp_path, monkeypatch):
    """Let the families be our own file each."""
    made = {}
    for family, (name, text) in TEXTS.items():
        path = tmp_path / name
        path.write_text(text)
        made[family] = Model(name, path)
    monkeypatch.setattr(models, "models", lambda family: (made[family],))
    sweep.cache_clear()
    return made


def verdict(family, engine, quantity):
    names = {"positions": "positions", "rotations": "rotations", "jacobians": "Jacobians"}
    claims = {claim.name: claim for claim in robot_claims(family, engine)}
    return judge(claims[f"{family[:-1]} {names[quantity]}, {engine}"])


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize("family", TEXTS)
def test_one_of_everything_agrees(family, engine, quantity, small, speed):
    assert verdict(family, engine, quantity).held, verdict(family, engine, quantity)


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize(
    ("family", "slip"), [(family, slip) for family, slips in BLIND.items() for slip in slips]
)
def test_claims_go_red_if_the_reader_is_blind(family, slip, engine, small, monkeypatch):
    pattern, instead = BLIND[family][slip]
    text, count = re.subn(pattern, instead, TEXTS[family][1])
    assert count
    blind = READERS[family].parse(text)

    def blindly(robot, q, links):
        names = robot.articulation.names
        return ours(blind, q, np.array([blind.articulation.index(names[j]) for j in links]))

    monkeypatch.setattr(comparisons, "ours", blindly)
    for quantity in QUANTITIES:
        held = quantity == "rotations" and slip in KEEPS_ROTATIONS
        expected = "" if held else "they differ"
        assert verdict(family, engine, quantity).missed == expected, quantity


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize("slip", FORMULAS)
def test_claims_go_red_under_the_slip(slip, engine, small, monkeypatch):
    monkeypatch.setattr(comparisons, "ours", partial(slipped, slip=slip))
    for quantity in FORMULAS[slip]:
        assert verdict(ROBOTS, engine, quantity).missed == "they differ", quantity


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
def test_without_a_slip_the_copy_holds(engine, small, monkeypatch):
    monkeypatch.setattr(comparisons, "ours", partial(slipped, slip=None))
    assert all(verdict(ROBOTS, engine, quantity).held for quantity in QUANTITIES)


# Minimal files in which Pinocchio departs from MuJoCo: (file, where and how the robot stands).
BODY = '<geom size="0.1"/>'
DEPARTURES = {
    "a first body without a joint": f"""<mujoco><worldbody><body name="a" pos="0 0 0.5">{BODY}
        <body name="b" pos="1 0 0">{BODY}<joint name="j" axis="0 1 0" pos="0.1 0 0"/></body>
        </body></worldbody></mujoco>""",
    "a free body that is turned": f"""<mujoco><worldbody>
        <body name="a" pos="0 0 1" euler="90 0 0">{BODY}<freejoint name="r"/></body>
        </worldbody></mujoco>""",
    "an anchor from a default class": f"""<mujoco>
        <default><default class="c"><joint pos="0.1 0 0"/></default></default>
        <worldbody><body name="a">{BODY}<freejoint name="r"/><body name="b" pos="1 0 0">{BODY}
        <joint name="j" class="c" axis="0 1 0"/></body></body></worldbody></mujoco>""",
    "ref of one of two joints of a body": f"""<mujoco><worldbody>
        <body name="a">{BODY}<freejoint name="r"/><body name="b" pos="1 0 0">{BODY}
        <joint name="j" axis="0 1 0" pos="0.1 0 0" ref="25"/><joint name="k" axis="0 0 1"/></body>
        </body></worldbody></mujoco>""",
}


@pytest.mark.parametrize("text", DEPARTURES.values(), ids=DEPARTURES)
def test_pinocchio_departs_from_mujoco_and_us(text, tmp_path):
    """If this fails, Pinocchio has learnt something: its entries in CAUSES can go."""
    model = Model("a.xml", tmp_path / "a.xml")
    model.path.write_text(text)
    sweep.cache_clear()
    assert max(differences(sweep("MuJoCo", model))) < 1e-14
    assert max(differences(sweep("Pinocchio", model))) > 0.01


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
def test_mimics_that_are_not_taken_are_left_free_for_both_and_said(engine, small):
    """A leader that does not exist; one that Pinocchio, which goes by the alphabet, meets late."""
    unknown = small[ROBOTS].path.with_name("unknown.urdf")
    unknown.write_text(URDF.replace('mimic joint="shoulder"', 'mimic joint="elbow"'))
    swept = sweep(engine, Model("unknown.urdf", unknown))
    assert swept.free_mimics
    assert swept.robot.articulation.freedom_count == 5
    assert max(differences(swept)) < 1e-14
    late = small[ROBOTS].path.with_name("late.urdf")
    follows = '<mimic joint="zz" multiplier="0.2"/><limit lower="-0.2" upper="0.6"'
    late.write_text(
        URDF.replace('"shoulder"', '"zz"').replace('<limit lower="-0.2" upper="0.6"', follows)
    )
    swept = sweep(engine, Model("late.urdf", late))
    assert bool(swept.free_mimics) == (engine == "Pinocchio")
    assert max(differences(swept)) < 1e-14


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("cut.urdf", URDF[:500]),
        ("cut.xml", MJCF[:500]),
        ("other.xml", "<html/>"),
    ],
)
def test_a_file_that_an_engine_refuses_is_said_in_a_line(engine, name, text, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(UnreadableError) as error:
        ROBOT_ENGINES[engine](tmp_path / name)
    assert str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
def test_engines_keep_quiet_and_leave_no_log(engine, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "warns.urdf"
    path.write_text(URDF.replace('lower="-1.5" upper="2"', 'lower="0" upper="0"'))
    ROBOT_ENGINES[engine](path)
    path.write_text('<robot name="empty"/>')
    if engine == "Pinocchio":  # to MuJoCo that is an empty world
        with pytest.raises(UnreadableError, match="there is no link in it"):
            ROBOT_ENGINES[engine](path)
    assert capfd.readouterr() == ("", "")
    assert [entry.name for entry in tmp_path.iterdir()] == ["warns.urdf"]


# Robots with mimic and continuous joints and slides; characters with free joints and anchors,
# some of a package that every Python has, some of one that the newest lack.
FEW = {
    ROBOTS: ("kinova.urdf", "panda.urdf", "pr2.urdf"),
    CHARACTERS: ("humanoid.xml", "half_cheetah.xml", "fish.xml", "boxhead.xml"),
}
# Files whose mimic joints an engine or the reference does not take.
FREE_MIMICS = {
    "Pinocchio": {"alex_psyonic_hands", "romeo", "talos_full_v2", "talos_full_v2_box"},
    "MuJoCo": {"alex_psyonic_hands"},
}


def some(family):
    return [model for model in models.models(family) if model.path.name in FEW[family]]


@pytest.mark.parametrize("claim", ROBOT_CLAIMS, ids=lambda claim: claim.name)
def test_claim_holds_on_some_files(claim, monkeypatch):
    chosen = {family: some(family) for family in FEW}
    monkeypatch.setattr(models, "models", chosen.get)
    verdict = judge(claim)
    assert verdict.held, verdict
    assert verdict.cases == len(chosen[ROBOTS if claim.name.startswith("robot") else CHARACTERS])
    assert verdict.cases >= 2


@pytest.mark.slow
@pytest.mark.parametrize("claim", ROBOT_CLAIMS, ids=lambda claim: claim.name)
def test_claim_holds_on_all_files(claim):
    verdict = judge(claim)
    assert verdict.held, verdict
    assert verdict.cases == claim.cases


@pytest.mark.slow
@pytest.mark.parametrize("engine", ROBOT_ENGINES)
def test_what_each_engine_does_not_read_or_reads_otherwise(engine):
    unread, freed, departing = set(), set(), set()
    for family in FEW:
        for model in models.models(family):
            try:
                swept = sweep(engine, model)
            except (UnreadableError, ValueError):
                unread.add((engine, model.name))
                continue
            freed |= {model.path.stem} if swept.free_mimics else set()
            departing |= {(engine, model.name)} if max(differences(swept)) > 1e-12 else set()
    there = {(engine, model.name) for family in FEW for model in models.models(family)}
    assert unread == there & {(engine, "ur_description/urdf/ur3.urdf"), *UNREAD}
    assert freed == FREE_MIMICS[engine]
    assert departing == there & CAUSES.keys()
    assert len(models.models(ROBOTS)) == 69


@pytest.mark.slow
def test_the_files_said_to_stand_still_do():
    for model in models.models(ROBOTS):
        if model.path.stem != "ur3":
            still = not model.read(mimic=False).articulation.freedom_count
            assert still == (model.name in STILL)


@pytest.fixture
def without(monkeypatch):
    """Pretend that some packages are not installed."""

    def forget(*packages):
        found = models.folder
        monkeypatch.setattr(models, "folder", lambda p: None if p in packages else found(p))
        models.models.cache_clear()

    yield forget
    monkeypatch.undo()
    models.models.cache_clear()


def test_characters_are_checked_on_every_python(without):
    without("dm_control")
    names = {model.path.stem for model in models.models(CHARACTERS)}
    assert {"humanoid", "ant", "half_cheetah"} <= names
    for engine in ROBOT_ENGINES:
        assert len(models.comparable(CHARACTERS, engine, moving=True)) == 8


@pytest.mark.parametrize("packages", [("dm_control",), ("example-robot-data", "gymnasium")])
def test_what_is_not_installed_is_said_in_a_line_and_claims_nothing(packages, without):
    absent = {p for of in models.PACKAGES.values() for p in of if models.folder(p) is None}
    without(*packages)
    said = [p for of in models.PACKAGES.values() for p in of if p in absent or p in packages]
    assert models.left_out() == (
        f"Left out: the claims about the files of {' and '.join(said)}, not installed here "
        "(pip install -e '.[robots]' brings what there are wheels of for this Python)"
    )
    roots = [models.folder(p) for of in models.PACKAGES.values() for p in of]
    files = [model.path for family in models.PACKAGES for model in models.models(family)]
    assert all(any(path.is_relative_to(root) for root in roots if root) for path in files)


def test_where_all_is_installed_nothing_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(models, "folder", lambda package: tmp_path)
    assert models.left_out() == ""


def test_a_package_that_is_not_there_has_no_folder():
    assert models.folder("plumbob-nowhere") is None
