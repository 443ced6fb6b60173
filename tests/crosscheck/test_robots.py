"""Robots and characters read from files: what the claims see, and what each engine makes of them.

Two files of our own making hold one of everything; the files of others are swept in a small slice,
and wholly if asked for slow tests.
"""

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from plumbob.crosscheck.claims import ROBOT_CLAIMS, robot_claims
from plumbob.crosscheck.engines import ROBOT_ENGINES
from plumbob.crosscheck.engines.robot_engine import UnreadableError
from plumbob.crosscheck.robots import comparisons, models
from plumbob.crosscheck.robots.comparisons import (
    Differences,
    LinkKinematics,
    Sweep,
    differences,
    reference_kinematics,
    sweep,
)
from plumbob.crosscheck.robots.deviations import (
    CLASS_ANCHOR,
    COMPILERS,
    FIXED_AXES,
    FRAME,
    FREE_ANCHOR,
    INCLUDE,
    LONG_AXIS,
    NAMELESS,
    OUTER_ROOT,
    ROTATED_ROOT,
    SHARED_REF,
    known_deviations,
)
from plumbob.crosscheck.robots.models import CAUSES, CHARACTERS, ROBOTS, UNREAD, RobotFile
from plumbob.crosscheck.verdict import check_claim
from plumbob.reference import Articulation
from plumbob.reference.formats import mjcf, urdf

# One of everything, as a robot and as a character.
URDF, MJCF = (
    Path(__file__).with_name("models").joinpath(name).read_text(encoding="utf-8")
    for name in ("all.urdf", "all.xml")
)


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
            r"(<joint name=.swing.*)\n\s*(<joint name=.twist.*)",
            r"\2\n\1",
        ),
    },
}
# These change no angle.
KEEPS_ROTATIONS = {"xyz of the origin not read", "anchors not read"}


def rebuilt(articulation, **changes):
    names = ("skeleton", "kinds", "axes", "frames", "lower", "upper", "cones", "mimics")
    return Articulation(**{name: changes.get(name, getattr(articulation, name)) for name in names})


def faulty(robot, q, links, *, fault):
    """Stand in for `reference_kinematics`, with a fault in the robot, in q or in the formulas."""
    a = robot.articulation
    if fault == "joints by their order in another tree":
        single = [a.coordinates_of(j).start for j, k in enumerate(a.kinds) if k in ONE]
        q = q.copy()
        q[:, single] = q[:, single[::-1]]
    if fault == "mimic joints not in the Jacobian":
        kinds = ["fixed" if j in a.mimics else k for j, k in enumerate(a.kinds)]
        without_mimics = rebuilt(a, kinds=kinds, mimics={})
        fixed = reference_kinematics(robot._replace(articulation=without_mimics), q, links)
        return reference_kinematics(robot, q, links)._replace(jacobians=fixed.jacobians)
    motion = reference_kinematics(robot, q, links)
    return motion._replace(jacobians=faulty_jacobians(motion, fault))


def faulty_jacobians(motion, fault):
    J, R = motion.jacobians.copy(), motion.matrices
    linear, angular = J[..., :3, :], J[..., 3:, :]
    if fault == "Jacobian along the link's own axes":
        inverse = np.swapaxes(R, -1, -2)
        J = np.concatenate([inverse @ linear, inverse @ angular], axis=-2)
    if fault == "Jacobian at the origin of the world":
        linear += np.cross(motion.positions[..., None], angular, axis=-2)
    if fault == "angular rows first":
        J = np.roll(J, 3, axis=-2)
    return J


FORMULAS = {
    "joints by their order in another tree": QUANTITIES,
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
        made[family] = RobotFile(name, path)
    monkeypatch.setattr(models, "models", lambda family: (made[family],))
    sweep.cache_clear()
    return made


def verdict(family, engine, quantity):
    names = {"positions": "positions", "rotations": "rotations", "jacobians": "Jacobians"}
    claims = {claim.name: claim for claim in robot_claims(family, engine)}
    return check_claim(claims[f"{family[:-1]} {names[quantity]}, {engine}"])


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize("family", TEXTS)
def test_one_of_everything_agrees(family, engine, quantity, small, backend):
    assert verdict(family, engine, quantity).holds, verdict(family, engine, quantity)


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize(
    ("family", "fault"), [(family, fault) for family, faults in BLIND.items() for fault in faults]
)
def test_claims_go_red_if_the_reader_is_blind(family, fault, engine, small, monkeypatch):
    pattern, instead = BLIND[family][fault]
    text, count = re.subn(pattern, instead, TEXTS[family][1])
    assert count
    blind = READERS[family].parse(text)

    def blindly(robot, q, links):
        names = robot.articulation.names
        return reference_kinematics(
            blind, q, np.array([blind.articulation.index(names[j]) for j in links])
        )

    monkeypatch.setattr(comparisons, "reference_kinematics", blindly)
    for quantity in QUANTITIES:
        holds = quantity == "rotations" and fault in KEEPS_ROTATIONS
        expected = "" if holds else "they differ"
        assert verdict(family, engine, quantity).failure == expected, quantity


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize("fault", FORMULAS)
def test_claims_go_red_under_the_fault(fault, engine, small, monkeypatch):
    monkeypatch.setattr(comparisons, "reference_kinematics", partial(faulty, fault=fault))
    for quantity in FORMULAS[fault]:
        assert verdict(ROBOTS, engine, quantity).failure == "they differ", quantity


PLANAR = """<robot name="arm"><link name="a"/><link name="b"/><link name="c"/>
<joint name="h" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="k" type="continuous"><parent link="b"/><child link="c"/>
<origin xyz="2 0 0"/><axis xyz="0 0 1"/></joint></robot>"""


@pytest.mark.parametrize(
    ("positions", "rotations", "linear", "angular", "expected"),
    [
        (0.3, 0.0, 0.0, 0.0, (0.1, 0.0, 0.0)),
        (0.0, 0.3, 0.0, 0.0, (0.0, 0.3, 0.0)),
        (0.0, 0.0, 0.3, 0.0, (0.0, 0.0, 0.1)),
        (0.0, 0.0, 0.3, 0.2, (0.0, 0.0, 0.2)),
        (0.0, 0.0, 0.9, 0.2, (0.0, 0.0, 0.3)),
    ],
)
def test_lengths_are_over_the_extent_of_all_links_and_angles_over_a_radian(
    positions, rotations, linear, angular, expected
):
    """The hand is at (2, 0), (0, 2) and (-1, root of 3): the box is three metres wide."""
    robot, links = urdf.parse(PLANAR), np.arange(3)
    q = np.array([[0.0, 0.0], [np.pi / 2, 0.0], [2 * np.pi / 3, 0.0]])
    ours = reference_kinematics(robot, q, links)
    x, R, J = (part.copy() for part in ours)
    x[1, 2, 0] += positions
    R[0, 1, 2, 1] -= rotations
    J[2, 2, 1, 0] -= linear
    J[1, 1, 5, 1] += angular
    theirs = LinkKinematics(x, R, J)
    parts = [
        Sweep(
            robot, q, links[i : i + 1], LinkKinematics(*(part[:, i : i + 1] for part in theirs)), ""
        )
        for i in range(3)
    ]
    assert differences(parts) == pytest.approx(Differences(*expected), abs=1e-15)


def written(folder, text, name="a.xml"):
    sweep.cache_clear()
    (folder / name).write_text(text)
    return RobotFile(name, folder / name)


# Minimal files in which Pinocchio departs from MuJoCo, by the cause that the check names.
BODY = '<geom size="0.1"/>'
B = f'<body name="b" pos="1 0 0">{BODY}<joint name="j" axis="0 1 0" pos="0.1 0 0"/></body>'
FREE = f"""<mujoco>{{}}<worldbody><body name="a">{BODY}<freejoint name="r"/>{{}}</body>
    </worldbody></mujoco>"""
TURNED = f'<body name="t" {{}}><body name="u" pos="1 0 0">{BODY}<joint name="k"/></body></body>'
TURNED = TURNED.format
DEVIATES = {
    OUTER_ROOT: f"""<mujoco><worldbody><body name="a" pos="0 0 0.5">{BODY}{B}</body></worldbody>
        </mujoco>""",
    ROTATED_ROOT: f"""<mujoco><worldbody>
        <body name="a" pos="0 0 1" euler="90 0 0">{BODY}<freejoint name="r"/></body>
        </worldbody></mujoco>""",
    CLASS_ANCHOR: FREE.format(
        '<default><default class="c"><joint pos="0.1 0 0"/></default></default>',
        B.replace('pos="0.1 0 0"/>', 'class="c"/>'),
    ),
    SHARED_REF: FREE.format("", B.replace("/></body>", ' ref="25"/><joint name="k"/></body>')),
    FRAME: FREE.format("", f"{B[:-7]}<frame><joint name='k'/></frame></body>"),
    INCLUDE: FREE.format("", f"{B[:-7]}<include file='j.xml'/></body>"),
    NAMELESS: FREE.format("", f"<body>{BODY}<joint name='k'/>{B}</body>"),
    FIXED_AXES: FREE.format('<compiler eulerseq="XYZ"/>', TURNED('euler="10 20 30"')),
    COMPILERS: FREE.format(
        '<compiler angle="radian"/><compiler angle="degree"/>', TURNED('euler="10 20 30"')
    ),
    LONG_AXIS: FREE.format("", TURNED('axisangle="0 0 2 30"')),
    FREE_ANCHOR: FREE.format("", B).replace(
        '<freejoint name="r"', '<joint name="r" type="free" pos=".1 .2 .3"'
    ),
}
LATE = FREE.format("", TURNED('euler=".1 .2 .3"'))
LATE = LATE.replace("</mujoco>", '<compiler angle="radian"/></mujoco>')


@pytest.mark.parametrize(("cause", "text"), [*DEVIATES.items(), (COMPILERS, LATE)])
def test_pinocchio_departs_from_mujoco_and_us_by_a_cause_that_is_named(cause, text, tmp_path):
    """If this fails, Pinocchio has learnt something: the cause and its entries in CAUSES can go."""
    (tmp_path / "j.xml").write_text('<x><joint name="k"/></x>')
    model = written(tmp_path, text)
    assert known_deviations(model.path) == [cause]
    assert max(differences([sweep("MuJoCo", model)])) < 1e-14
    assert max(differences([sweep("Pinocchio", model)])) > 0.01


def test_no_cause_is_named_where_pinocchio_reads_as_mujoco_does(tmp_path):
    model = written(tmp_path, FREE.format("<option/>", B))
    assert known_deviations(model.path) == []
    assert max(differences([sweep("Pinocchio", model)])) < 1e-14
    assert known_deviations(written(tmp_path, MJCF[:300]).path) == []
    assert known_deviations(written(tmp_path, URDF, "a.urdf").path) == []


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
def test_refused_mimics_move_independently_for_both_with_a_reason(engine, small):
    """A leader that does not exist; one that Pinocchio, which goes by the alphabet, meets late."""
    unknown = small[ROBOTS].path.with_name("unknown.urdf")
    unknown.write_text(URDF.replace('mimic joint="shoulder"', 'mimic joint="elbow"'))
    swept = sweep(engine, RobotFile("unknown.urdf", unknown))
    assert swept.free_mimics
    assert swept.robot.articulation.freedom_count == 5
    assert max(differences([swept])) < 1e-14
    late = small[ROBOTS].path.with_name("late.urdf")
    follows = '<mimic joint="zz" multiplier="0.2"/><limit lower="-0.2" upper="0.6"'
    late.write_text(
        URDF.replace('"shoulder"', '"zz"').replace('<limit lower="-0.2" upper="0.6"', follows)
    )
    swept = sweep(engine, RobotFile("late.urdf", late))
    assert bool(swept.free_mimics) == (engine == "Pinocchio")
    assert max(differences([swept])) < 1e-14


# Files that some engine stumbled over, all of which the reference reads as MuJoCo does.
JOINTS = '<joint axis="1 0 0" range="-1 1"/><joint type="slide" axis="0 1 0" range="-1 1"/>'
NESTED = f"""<mujoco><worldbody><body name="a">{BODY}{{}}
    <body name="b" pos="1 0 0">{BODY}<joint name="j" axis="0 1 0" pos="0.1 0 0"/></body>
    </body></worldbody></mujoco>"""
UNNAMED = {
    "a hinge": '<joint axis="1 1 0" range="-1 1"/>',
    "a slide": '<joint type="slide" axis="1 1 0" range="-1 1"/>',
    "a ball": '<joint type="ball"/>',
    "a free joint": "<freejoint/>",
    "a free joint of type": '<joint type="free"/>',
    "two": JOINTS,
    "the first of two": f'{JOINTS}<joint name="k" range="-1 1"/>',
    "the second of two": f'<joint name="k" range="-1 1"/>{JOINTS}',
}


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize("joints", UNNAMED.values(), ids=UNNAMED)
def test_joints_without_names_are_found(joints, engine, tmp_path):
    swept = sweep(engine, written(tmp_path, NESTED.format(joints)))
    assert len(swept.links) == 2 + (engine == "MuJoCo")  # which also knows the world
    assert np.ptp(swept.expected.matrices[:, -1], axis=0).max() > 0.1  # not constant
    assert max(differences([swept])) < 1e-14


def chain_of_mimics(count, order):
    """A URDF of hinges of which each follows the next one, written in some order."""
    joints = [
        f"""<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>
        <origin xyz="0.3 0.1 0"/><axis xyz="0 {i % 2} 1"/>
        <limit lower="-3" upper="3" effort="1" velocity="1"/>{{}}</joint>"""
        for i in range(count)
    ]
    follows = '<mimic joint="j{}" multiplier="{}" offset="0.2"/>'
    texts = [
        joint.format(follows.format(i + 1, 0.7 + 0.1 * i) if i < count - 1 else "")
        for i, joint in enumerate(joints)
    ]
    links = "".join(f'<link name="l{i}"/>' for i in range(count + 1))
    return f'<robot name="r">{links}{"".join(texts[i] for i in order)}</robot>'


@pytest.mark.parametrize("engine", ROBOT_ENGINES)
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
def test_a_mimic_of_a_mimic_moves_and_is_in_the_jacobian(order, engine, tmp_path):
    """Or is left free, for both, where the engine is Pinocchio, which refuses it."""
    swept = sweep(engine, written(tmp_path, chain_of_mimics(4, order), "a.urdf"))
    refused = engine == "Pinocchio"
    assert bool(swept.free_mimics) == refused
    assert swept.robot.articulation.freedom_count == (4 if refused else 1)
    assert max(differences([swept])) < 1e-14
    ahead, behind = (
        reference_kinematics(swept.robot, swept.q + h, swept.links).positions for h in (1e-5, -1e-5)
    )
    # Off by 1e-16/h, and by h²/6 times the third derivative, 4³ m where four coordinates change.
    rates = (ahead - behind) / 2e-5
    theirs = swept.expected.jacobians[..., :3, :].sum(axis=-1)  # all coordinates change
    np.testing.assert_allclose(theirs, rates, atol=1e-8)


CLASS_C = '<x><default><default class="c"/></default></x>'
# What Pinocchio does not read or reads otherwise: (MJCF, what it says of it).
WORLD = "<mujoco>{}<worldbody>{}</worldbody>{}</mujoco>"
MOVED = f'<body name="a">{BODY}<joint name="x"/><joint name="y" type="slide"/></body>'
REFUSED_BY_PINOCCHIO = {
    "two worlds": (
        WORLD.format("", MOVED, f'<worldbody><body name="b">{BODY}</body></worldbody>'),
        "it reads the first of several <worldbody> again for each",
    ),
    "two worlds, one without bodies": (
        WORLD.format("", MOVED, f"<worldbody>{BODY}</worldbody>"), "the first of several <world"
    ),
    "a class of an included file": (
        WORLD.format('<include file="c.xml"/>', MOVED.replace("<body", '<body childclass="c"'), ""),
        "it ends in an IndexError: ",
    ),
    "a joint called universe": (
        WORLD.format("", MOVED.replace('"x"', '"universe"').replace("slide", "hinge"), ""),
        "universe is its own name of the world",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED_BY_PINOCCHIO)
def test_files_that_would_crash_pinocchio_are_refused(name, tmp_path):
    text, said = REFUSED_BY_PINOCCHIO[name]
    (tmp_path / "c.xml").write_text(CLASS_C)
    with pytest.raises(UnreadableError) as refused:
        sweep("Pinocchio", written(tmp_path, text))
    assert said in str(refused.value)
    assert max(differences([sweep("MuJoCo", written(tmp_path, text))])) < 1e-14


# Files whose mimic joints an engine or the reference does not take.
FREE_MIMICS = {
    "Pinocchio": {"alex_psyonic_hands", "romeo", "talos_full_v2", "talos_full_v2_box"},
    "MuJoCo": {"alex_psyonic_hands"},
}


@pytest.mark.slow
@pytest.mark.parametrize("claim", ROBOT_CLAIMS, ids=lambda claim: claim.name)
def test_claim_holds_on_all_files(claim):
    verdict = check_claim(claim)
    assert verdict.holds, verdict
    assert verdict.cases == claim.cases


@pytest.mark.slow
@pytest.mark.parametrize("engine", ROBOT_ENGINES)
def test_what_each_engine_does_not_read_or_reads_otherwise(engine):
    unread, freed, departing = set(), set(), set()
    for family in TEXTS:
        for model in models.models(family):
            try:
                swept = sweep(engine, model)
            except (UnreadableError, ValueError):
                unread.add((engine, model.name))
                continue
            freed |= {model.path.stem} if swept.free_mimics else set()
            departing |= {(engine, model.name)} if max(differences([swept])) > 1e-12 else set()
    there = {(engine, model.name) for family in TEXTS for model in models.models(family)}
    assert unread == there & {(engine, "ur_description/urdf/ur3.urdf"), *UNREAD}
    assert freed == FREE_MIMICS[engine]
    assert departing == there & CAUSES.keys()
    assert len(models.models(ROBOTS)) == 69


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
