import mujoco
import numpy as np
import pytest

from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import FormatWarning, mjcf

SOLID = '<geom size="1"/>'


def character(bodies, head=""):
    return mjcf.parse(f"<mujoco>{head}<worldbody>{bodies}</worldbody></mujoco>")


def pose(found, body, q=None):
    """The position and the rotation matrix of a body."""
    poses = forward_kinematics(found.articulation, found.home if q is None else q)
    at = found.articulation.index(body)
    return poses.positions[at], rotation.to_matrix(poses.rotations[at])


def difference_from_mujoco(text, q=None):
    """How far our poses of all bodies are from MuJoCo's for the same text, at q or each at home."""
    model, found = mujoco.MjModel.from_xml_string(text), mjcf.parse(text)
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0 if q is None else q
    mujoco.mj_kinematics(model, data)
    worst = 0.0
    for i in range(model.nbody):
        x, R = pose(found, model.body(i).name or f"body#{i}", q)
        worst = max(worst, np.abs(x - data.xpos[i]).max())
        worst = max(worst, np.abs(R.ravel() - data.xmat[i]).max())
    return worst


def spoken(rng, count, low=-2.0, high=2.0):
    return " ".join(f"{value:.17g}" for value in rng.uniform(low, high, count))


def oriented(rng):
    """One of the forms of an orientation, or none."""
    count, name = [(4, "quat"), (4, "axisangle"), (3, "euler"), (6, "xyaxes"), (3, "zaxis"),
                   (0, "")][rng.integers(6)]  # fmt: skip
    return f'{name}="{spoken(rng, count)}"' if name else ""


def any_joint(rng, kinds, k):
    name = f'name="j{k}"' if rng.integers(2) else ""
    low, high = np.sort(rng.uniform(-2, 2, 2))
    limits = ["", f'range="{low:.17g} {high:.17g}"', f'limited="false" range="{low} {high}"']
    kind = kinds[rng.integers(len(kinds))]
    about = ["", f'axis="{spoken(rng, 3)}"'][rng.integers(2)]
    anchor = ["", f'pos="{spoken(rng, 3)}"'][rng.integers(2)]
    ref = ["", f'ref="{spoken(rng, 1)}"'][rng.integers(2)]
    grade = ["", 'class="slides"', 'class="inner"'][rng.integers(3)] if kind == "hinge" else ""
    kind = f'type="{kind}"' if kind != "hinge" or rng.integers(2) else ""
    if "ball" in kind:
        return f'<joint {name} {kind} {anchor} range="0 {high + 3:.17g}" class="main"/>'
    return f"<joint {name} {kind} {about} {anchor} {ref} {grade} {limits[rng.integers(3)]}/>"


def any_content(rng, depth, ids):
    """Joints, and bodies inside frames or not."""
    ball = depth and not rng.integers(4)  # no more than six freedoms in all
    count = rng.integers(2) if ball else rng.integers(4)
    text = "".join(any_joint(rng, ["hinge", "slide"], next(ids)) for _ in range(count))
    text += any_joint(rng, ["ball"], next(ids)) if ball else ""
    for _ in range(rng.integers(1, 3) if depth < 3 else 0):
        inner = any_body(rng, depth + 1, ids)
        grade = ["", 'childclass="inner"'][rng.integers(2)]
        inside = (
            ""
            if rng.integers(2)
            else any_joint(rng, ["slide"] if ball else ["hinge", "slide"], next(ids))
        )
        framed = f'<frame pos="{spoken(rng, 3)}" {oriented(rng)} {grade}>{inside}{inner}</frame>'
        text += framed if rng.integers(2) else inner
    return text


def any_body(rng, depth, ids):
    name = f'name="b{next(ids)}"' if rng.integers(3) else ""
    grade = ["", 'childclass="slides"'][rng.integers(2)]
    place = f'pos="{spoken(rng, 3)}"' if rng.integers(3) else ""
    return (
        f"<body {name} {place} {oriented(rng)} {grade}>{SOLID}{any_content(rng, depth, ids)}</body>"
    )


def any_character(rng):
    ids = iter(range(10_000))
    sequence = "".join(rng.choice(list("xyzXYZ"), 3))
    unit = ["", 'angle="degree"', 'angle="radian"'][rng.integers(3)]
    defaults = """<default><joint axis="1 2 3" ref="0.5"/><default class="inner">
        <joint range="-1 1"/><default class="slides"><joint type="slide" ref="0.2"/></default>
        </default></default>"""
    free = f'<body pos="1 2 3" euler="10 20 30"><freejoint/>{SOLID}{any_body(rng, 1, ids)}</body>'
    placed = f'<frame pos="{spoken(rng, 3)}" {oriented(rng)}>{free}</frame>'
    return (
        f"<mujoco><worldbody>{any_body(rng, 0, ids)}{placed}</worldbody><compiler {unit}/>"
        f'<compiler eulerseq="{sequence}"/>{defaults}</mujoco>'
    )


@pytest.mark.parametrize("seed", range(30))
def test_any_character_has_mujocos_poses(seed):
    rng = np.random.default_rng(seed)
    text = any_character(rng)
    found = mjcf.parse(text)
    assert found.articulation.joint_count > 4
    q = found.articulation.random(rng)
    # Ten bodies in each other, of lengths of some metres: some hundred roundings of 1e-15.
    assert difference_from_mujoco(text) < 1e-13
    assert difference_from_mujoco(text, q) < 1e-13
    assert not np.allclose(pose(found, found.articulation.names[-1], q)[1],
                           pose(found, found.articulation.names[-1])[1])  # fmt: skip


@pytest.mark.parametrize("seed", range(10))
def test_limits_and_names_are_mujocos(seed):
    text = any_character(np.random.default_rng(seed))
    model, found = mujoco.MjModel.from_xml_string(text), mjcf.parse(text)
    named = [i for i in range(model.njnt) if model.joint(i).name]
    assert named
    assert len(found.joints) == model.njnt
    for i in named:
        j = found.joints[model.joint(i).name]
        limits = model.jnt_range[i] if model.jnt_limited[i] else (-np.inf, np.inf)
        where = found.articulation.coordinates_of(j)
        assert where.start == model.jnt_qposadr[i]
        if model.jnt_type[i] == mujoco.mjtJoint.mjJNT_BALL:
            assert found.articulation.cones[j] == pytest.approx(limits[1], abs=1e-15)
            limits = -limits[1], limits[1]
        ours = found.articulation.lower[j], found.articulation.upper[j]
        np.testing.assert_allclose(ours, limits, atol=1e-15)  # one rounding of degrees


def test_the_last_joint_is_the_body_where_it_can_be():
    found = character(
        '<body name="a"><joint name="x" type="slide" pos="1 1 1"/><joint/><body/></body>'
        '<body name="fixed"/><body name="b"><joint type="slide" pos="1 1 1"/></body>'
    )
    assert found.articulation.names == ("world", "a/x", "a", "body#2", "fixed", "b")
    assert found.joints == {"x": 1, "a/hinge2": 2, "b/slide1": 5}


def test_a_file_includes_others_of_its_folder(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "main.xml").write_text(
        '<mujoco><include file="parts/settings.xml"/><worldbody><body name="a" euler="1 0 0">'
        '<include file="parts/arm.xml"/></body></worldbody></mujoco>'
    )
    (tmp_path / "parts" / "settings.xml").write_text(
        '<mujoco><include file="unit.xml"/><default><joint type="slide"/></default></mujoco>'
    )
    (tmp_path / "parts" / "unit.xml").write_text('<mujoco><compiler angle="radian"/></mujoco>')
    (tmp_path / "parts" / "arm.xml").write_text(
        '<mujocoinclude><joint name="j"/><body name="b"/></mujocoinclude>'
    )
    found = mjcf.read(tmp_path / "main.xml")
    assert found.articulation.names == ("world", "a", "b")
    assert found.articulation.kinds == ("fixed", "slide", "fixed")
    np.testing.assert_allclose(pose(found, "a")[1][2, 1], np.sin(1.0), atol=1e-15)


def test_repeated_includes_and_files_outside_the_root_are_refused(tmp_path, refusal):
    folder = tmp_path / "model"
    folder.mkdir()
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    (folder / "ring.xml").write_text('<mujoco><include file="main.xml"/></mujoco>')
    (folder / "twice.xml").write_text(
        '<mujoco><include file="part.xml"/><include file="./part.xml"/></mujoco>'
    )
    (folder / "part.xml").write_text("<mujoco/>")
    (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
    (folder / "link").symlink_to(tmp_path)
    for name, message in [
        ("ring.xml", "ring.xml, line 1: <include>: expected every file to be included once"),
        ("twice.xml", "twice.xml, line 1: <include>: expected every file to be included once"),
        ("../secret.xml", "got '../secret.xml', which is outside; root= names a wider folder"),
        (str(tmp_path / "secret.xml"), "which is outside"),
        ("link.xml", "which is outside"),
        ("link/secret.xml", "which is outside"),
        ("../nowhere.xml", "which is outside"),
        ("missing.xml", "expected a file in 'model', got 'missing.xml', which is not there"),
        ("", "expected an attribute 'file', got an empty one"),
    ]:
        (folder / "main.xml").write_text(f'<mujoco><include file="{name}"/></mujoco>')
        assert message in refusal(mjcf.read, folder / "main.xml")
    text = '<mujoco><include file="ring.xml"/></mujoco>'
    assert "expected a text without includes" in refusal(mjcf.parse, text)


@pytest.fixture
def shared(tmp_path):
    """A model whose arm stands in a folder beside its own."""
    for folder in ("robots/arm", "robots/parts", "elsewhere"):
        (tmp_path / folder).mkdir(parents=True)
    main = tmp_path / "robots" / "arm" / "main.xml"
    main.write_text(
        '<mujoco><worldbody><body name="a"><include file="../parts/arm.xml"/></body></worldbody>'
        "</mujoco>"
    )
    (tmp_path / "robots" / "parts" / "arm.xml").write_text('<x><body name="b" pos="1 0 0"/></x>')
    (tmp_path / "elsewhere" / "hand.xml").write_text("<x><body/></x>")
    return main


@pytest.mark.parametrize("up", [1, 2])
def test_a_wider_root_admits_files_of_other_folders(shared, up, refusal):
    found = mjcf.read(shared, root=shared.parents[up])
    assert found.articulation.names == ("world", "a", "b")
    message = refusal(mjcf.read, shared)
    assert "got '../parts/arm.xml', which is outside; root= names a wider folder" in message


@pytest.mark.parametrize("name", ["a" * 1000, "loop", "loop/a.xml", "main.xml/a", "/" * 999])
def test_a_name_that_no_file_can_have_is_not_there(name, shared, refusal):
    (shared.parent / "loop").symlink_to(shared.parent / "loop")
    shared.write_text(f'<mujoco><include file="{name}"/></mujoco>')
    message = refusal(mjcf.read, shared)
    assert "which is outside" in message if name[0] == "/" else "which is not there" in message
    message = refusal(mjcf.read, shared, root=shared.parent / name / "a")
    assert message.startswith("root: expected a folder that holds 'main.xml', got ")


def test_a_file_is_sought_beside_the_main_one_first_as_mujoco_does(tmp_path):
    (tmp_path / "parts").mkdir()
    main = tmp_path / "main.xml"
    main.write_text('<mujoco><worldbody><include file="parts/p.xml"/></worldbody></mujoco>')
    (tmp_path / "parts" / "p.xml").write_text('<mujoco><include file="q.xml"/></mujoco>')
    for folder in ("parts", "."):  # the second takes the place of the first
        name = "inner" if folder == "parts" else "outer"
        (tmp_path / folder / "q.xml").write_text(f'<mujoco><body name="{name}"/></mujoco>')
        assert mujoco.MjModel.from_xml_path(str(main)).body(1).name == name
        assert mjcf.read(main).articulation.names == ("world", name)


COPIES = [
    '<replicate count="9"><geom size="1"/><site/></replicate>',
    '<replicate count="2"><replicate count="2"><frame><light/></frame></replicate></replicate>',
    "<replicate/>",
]


@pytest.mark.parametrize("copies", COPIES)
def test_copies_of_what_has_no_body_are_passed_over_with_a_warning(copies):
    with pytest.warns(FormatWarning, match="line 1: <replicate>: expected bodies .* passed over"):
        found = character(f'<body name="a" pos="1 2 3">{copies}<joint/></body>')
    assert found.articulation.names == ("world", "a")


@pytest.mark.parametrize("inside", ["<body/>", "<joint/>", "<freejoint/>", "<attach/>"])
def test_copies_of_bodies_and_joints_are_refused(inside, refusal):
    text = f"<body><replicate><frame>{inside}</frame></replicate></body>"
    assert "expected every body to be written out" in refusal(character, text)


WRONG = {
    "two orientations": ('<body quat="1 0 0 0" euler="0 0 0"/>', "got quat and euler"),
    "no quaternion": ('<body quat="0 0 0 0"/>', "expected a quaternion in 'quat', got '0 0 0 0'"),
    "parallel axes": ('<body xyaxes="1 0 0 2 0 0"/>', "expected a direction in 'xyaxes'"),
    "no axis": ('<body><joint axis="0 0 0"/></body>', "expected a direction in 'axis'"),
    "two numbers": ('<body pos="1 2"/>', "expected 3 numbers in 'pos', got '1 2'"),
    "numbers without end": (f'<body pos="{"1 " * 9**6}"/>', "at most 2,000 characters in 'pos'"),
    "another type": ('<body><joint type="screw"/></body>', "one of hinge, slide, ball, free"),
    "a joint of the world": ("<joint/>", "expected no joint in the world"),
    "a free joint inside": ("<body><body><freejoint/></body></body>", "a single free joint"),
    "a free joint and another": ("<body><freejoint/><joint/></body>", "a single free joint"),
    "an aligned joint": ('<body><freejoint align="true"/></body>', "not aligned"),
    "no class": ('<body childclass="c"/>', "expected a default class, got 'c'"),
    "a body twice": ('<body name="a"/><body name="a"/>', "a body's name once, got 'a' twice"),
    "a joint twice": (
        '<body><joint name="j"/><joint name="j"/></body>', "a joint's name once, got 'j' twice"
    ),
    "crossed limits": (
        '<body><joint limited="true" range="2 1"/></body>', "range from the least up, got 2 to 1"
    ),
    "a ball's lower limit": (
        '<body><joint type="ball" range="1 2"/></body>', "expected a range from 0 up, got 1 to 2"
    ),
    "perhaps a limit": ('<body><joint limited="1"/></body>', "one of true, false, auto"),
    "copies": ('<body><replicate count="9"><body/></replicate></body>', "got a rule for some"),
    "a composite": ('<body><composite type="cable"/></body>', "got a rule for some"),
    "too many": ("<body/>" * 10_001, "expected at most 10,000 joints, got 10,002"),
}  # fmt: skip
WRONG_HEADS = {
    "another unit": ('<compiler angle="grad"/>', "one of degree, radian for angle, got 'grad'"),
    "another sequence": ('<compiler eulerseq="xy"/>', "expected three axes"),
    "global coordinates": ('<compiler coordinate="global"/>', "one of local for coordinate"),
    "limits left open": (
        '<compiler autolimits="false"/><default><joint range="0 1"/></default>',
        "expected limited='true' or 'false'",
    ),
    "all aligned": ('<compiler alignfree="true"/>', "not aligned"),
    "another main class": ('<default class="c"/>', "outermost class to be 'main', got 'c'"),
    "a class twice": (
        '<default><default class="c"/><default class="c"/></default>', "class once, got 'c' twice"
    ),
    "a class without a name": ("<default><default/></default>", "expected an attribute 'class'"),
    "two joints of a class": ("<default><joint/><joint/></default>", "at most one <joint>, got 2"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_character_is_refused_and_named(name, refusal):
    text, message = WRONG[name]
    assert message in refusal(character, text)


@pytest.mark.parametrize("name", WRONG_HEADS)
def test_what_is_no_setting_is_refused_and_named(name, refusal):
    head, message = WRONG_HEADS[name]
    assert message in refusal(character, "<body><freejoint/></body><body><joint/></body>", head)


# Bodies with geoms of all kinds, by mass, density and size, of their own and of default classes.
SOLIDS = """<default><geom density="300" size=".2 .3 .4"/><default class="light">
<geom density="10" size=".7"/><default class="inner"><geom size=".1 .9" mass="2"/></default>
</default></default><worldbody><geom/>
<body><joint/><geom pos=".1 .2 .3"/><geom type="capsule" pos="1 0 0"/><geom type="cylinder"
 fromto="0 0 0 1 2 3" density="50"/></body>
<body childclass="light"><freejoint/><geom type="box" size=".5 .6"/><geom class="inner" pos="0 1 0"
 type="ellipsoid"/><frame pos="1 2 3" euler="40 50 60"><geom pos="1 1 1" group="4"/></frame></body>
<body><joint pos="1 0 0"/><inertial pos="1 0 0" mass="3" diaginertia="1 1 1"/>
<geom type="box" fromto="0 0 1 1 1 1"/><geom type="ellipsoid" fromto="0 0 1 1 0 1" size=".3"/><body>
<inertial pos="1 2 0" mass=".1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    "settings",
    ["", 'boundmass="3"', 'settotalmass="7"', 'inertiafromgeom="true"', 'inertiagrouprange="0 3"'],
)
def test_masses_and_their_centres_are_mujocos(settings):
    text = f"<mujoco><compiler {settings}/>{SOLIDS}"
    mujoco.set_mju_user_warning(lambda message: None)  # of a setting that it is to drop
    robot, model = mjcf.parse(text), mujoco.MjModel.from_xml_string(text)
    bodies = [robot.articulation.index(f"body#{i}") for i in range(1, model.nbody)]
    assert model.body_mass[1:].min() > 0.0
    np.testing.assert_allclose(robot.masses[bodies], model.body_mass[1:], rtol=1e-12)
    np.testing.assert_allclose(robot.centres[bodies], model.body_ipos[1:], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("geom", "mass"),
    [
        ('type="mesh" mesh="a"', np.nan),
        ('mesh="a" mass="2"', np.nan),
        ('type="mesh" mesh="a" density="0"', 0.0),
        ('size="1" shellinertia="true"', np.nan),
        ('size="1" shellinertia="true" mass="2"', 2.0),
        ('size="a"', np.nan),
    ],
)
def test_the_mass_of_a_mesh_is_unknown(geom, mass):
    robot = character(f'<body name="b"><geom {geom}/></body>')
    np.testing.assert_equal(robot.masses[1], mass)
