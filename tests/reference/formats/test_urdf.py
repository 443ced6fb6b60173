import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import FormatWarning, urdf

PI, inf = np.pi, np.inf


def link(*names):
    return "".join(f'<link name="{name}"/>' for name in names)


def joint(name, parent, child, kind="revolute", inside="", limit='<limit lower="-9" upper="9"/>'):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{inside}{limit}</joint>"
    )


def robot(*parts):
    return urdf.parse(f'<robot name="r">{"".join(parts)}</robot>')


def pose(found, link, **coordinates):
    """The position and the rotation matrix of a link, at home but for some joints by name."""
    q = np.array(found.home)
    for name, value in coordinates.items():
        q[found.articulation.coordinates_of(found.joints[name])] = value
    all_of_them = forward_kinematics(found.articulation, q)
    at = found.articulation.index(link)
    return all_of_them.positions[at], rotation.to_matrix(all_of_them.rotations[at])


def rotation_about(axis, angle):
    return Rotation.from_euler(axis, angle).as_matrix()


ORIGIN = '<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>'  # x points along y, y along -x
MOVES = {
    "revolute": (0.5, (1, 2, 3), rotation_about("z", PI / 2) @ rotation_about("x", 0.5)),
    "continuous": (0.5, (1, 2, 3), rotation_about("z", PI / 2) @ rotation_about("x", 0.5)),
    "prismatic": (0.5, (1, 2.5, 3), rotation_about("z", PI / 2)),
    "fixed": ((), (1, 2, 3), rotation_about("z", PI / 2)),
    "floating": ((1, 0, 0, np.cos(0.25), 0, np.sin(0.25), 0), (1, 3, 3),
                 rotation_about("z", PI / 2) @ rotation_about("y", 0.5)),
    "planar": (0.5, (1, 2, 3), rotation_about("z", PI / 2) @ rotation_about("x", 0.5)),
}  # fmt: skip


@pytest.mark.parametrize("kind", MOVES)
def test_a_joint_moves_according_to_its_type(kind, backend):
    coordinates, x, R = MOVES[kind]
    found = robot(link("a", "b"), joint("j", "a", "b", kind, ORIGIN))
    positions, rotations = pose(found, "b", j=coordinates)
    np.testing.assert_allclose(positions, x, atol=1e-15)
    np.testing.assert_allclose(rotations, R, atol=1e-15)


def test_links_keep_the_order_of_the_file_and_follow_their_parents():
    found = robot(
        joint("3", "b", "late"), joint("1", "a", "second"), joint("2", "a", "b"),
        joint("4", "b", "last"), link("b", "last", "second", "late", "a"),
    )  # fmt: skip
    assert found.articulation.names == ("a", "second", "b", "late", "last")
    assert found.joints == {"1": 1, "2": 2, "3": 3, "4": 4}
    assert found.articulation.skeleton.parents.tolist() == [-1, 0, 0, 2, 2]


def test_limits_are_those_of_the_type():
    limit = '<limit lower="-1" upper="2"/><safety_controller soft_lower_limit="0"/>'
    found = robot(
        link(*"abcdefg"),
        joint("b", "a", "b", limit=limit),
        joint("c", "a", "c", "continuous", limit=limit),
        joint("d", "a", "d", "prismatic", limit=limit),
        joint("e", "a", "e", limit='<limit lower="0"/>'),
        joint("f", "a", "f", limit='<limit upper="inf"/>'),
        joint("g", "a", "g", "fixed", limit=limit),
    ).articulation
    inf = np.inf
    assert found.lower.tolist() == [-inf, -1, -inf, -1, 0, 0, -inf]
    assert found.upper.tolist() == [inf, 2, inf, 2, 0, inf, inf]


CROSSED = {"unlimited": (-inf, inf), "ordered": (-2.0, 1.0)}


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("choice", [*CROSSED, None])
def test_crossed_limits_are_read_with_a_warning_by_a_named_choice(kind, choice):
    limit = '<limit lower="1" upper="-2"/>'
    text = f"<robot>{link('a', 'b')}{joint('j', 'a', 'b', kind, limit=limit)}</robot>"
    chosen = {"crossed_limits": choice} if choice else {}
    said = r"line 1: <joint name='j'>: expected lower <= upper, got lower 1, upper -2; read as "
    with pytest.warns(FormatWarning, match=said + (choice or "unlimited")):
        found = urdf.parse(text, **chosen).articulation
    assert (found.lower[1], found.upper[1]) == CROSSED[choice or "unlimited"]


def test_crossed_limits_are_refused_on_demand(refusal):
    text = joint("j", "a", "b", limit='<limit lower="2" upper="1"/>')
    text = f"<robot>{link('a', 'b')}{text}</robot>"
    message = refusal(urdf.parse, text, crossed_limits="refused")
    assert "expected lower <= upper, got lower 2, upper 1" in message
    message = refusal(urdf.parse, text, crossed_limits="swapped")
    assert message == ("crossed_limits: expected one of unlimited, ordered, refused, got 'swapped'")


def test_mimic_joints_follow_through_chains():
    follow = '<mimic joint="{}" multiplier="{}" offset="{}"/>'.format
    found = robot(
        link(*"abcd"),
        joint("c", "b", "c", "prismatic", follow("b", -3, 0.5)),
        joint("b", "a", "b", "continuous", follow("d", 2, 0.25)),
        joint("d", "a", "d", "continuous"),
    )
    assert found.articulation.coordinate_count == 1
    q_b = 2 * 0.7 + 0.25
    x, R = pose(found, "c", d=0.7)
    np.testing.assert_allclose(x, [-3 * q_b + 0.5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(R, rotation_about("x", q_b), atol=1e-15)


def test_mimic_joints_move_by_themselves_on_demand():
    follower = joint("c", "b", "c", inside='<mimic joint="gone"/>')
    text = f"<robot>{link('a', 'b', 'c')}{joint('b', 'a', 'b')}{follower}</robot>"
    assert urdf.parse(text, mimic=False).articulation.coordinate_count == 2


def test_a_joint_without_numbers_is_locked_unless_it_follows():
    bare, limit = '<limit effort="5" velocity="1"/>', '<limit lower="-1" upper="1"/>'
    follow = '<mimic joint="b" offset="0.5"/>'
    text = f"<robot>{link('a', 'b', 'c')}{joint('b', 'a', 'b', limit=limit)}{{}}</robot>"
    model = urdf.parse(text.format(joint("c", "b", "c", inside=follow, limit=bare))).articulation
    assert (model.lower.tolist()[1:], model.upper.tolist()[1:]) == ([-1, -inf], [1, inf])
    said = "<joint name='c'>: expected lower or upper, got neither; locked at 0"
    with pytest.warns(FormatWarning, match=said):
        model = urdf.parse(text.format(joint("c", "b", "c", limit=bare))).articulation
    assert (model.lower[2], model.upper[2]) == (0, 0)


WRONG = {
    "no links": ("", "expected a <link>, got none"),
    "two roots": (link("a", "b"), "that no joint moves, the root, got 2: 'a', 'b'"),
    "a ring": (link("a", "b") + joint("j", "a", "b") + joint("k", "b", "a"), "the root, got none"),
    "a ring aside": (
        link("c", "a", "b") + joint("j", "a", "b") + joint("k", "b", "a"),
        "expected a path to the root 'c', got a ring",
    ),
    "a missing link": (link("a") + joint("j", "a", "b"), "a <link> of that name, got none: 'b'"),
    "two parents": (
        link("a", "b") + joint("j", "a", "b") + joint("k", "a", "b"),
        "expected one joint to move link 'b', got 'j' as well",
    ),
    "a link twice": (link("a", "a"), "expected a link's name once, got it twice"),
    "a joint twice": (link(*"abc") + joint("j", "a", "b") + joint("j", "a", "c"), "name once"),
    "a link without a name": ("<link/>", "expected an attribute 'name', got none"),
    "no parent": (
        link("a") + '<joint name="j" type="fixed"><child link="a"/></joint>',
        "expected a <parent>, got none",
    ),
    "two children": (
        link("a", "b") + joint("j", "a", "b", inside='<child link="a"/>'),
        "expected at most one <child>, got 2",
    ),
    "another type": (link("a", "b") + joint("j", "a", "b", "hinge"), "expected one of fixed, rev"),
    "no axis": (link("a", "b") + joint("j", "a", "b", inside='<axis xyz="0 0 0"/>'), "not zero"),
    "no limit": (link("a", "b") + joint("j", "a", "b", limit=""), "<limit> of a revolute joint"),
    "two numbers": (
        link("a", "b") + joint("j", "a", "b", inside='<origin xyz="1 2"/>'),
        "expected 3 numbers in 'xyz', got '1 2'",
    ),
    "no leader": (
        link("a", "b") + joint("j", "a", "b", inside='<mimic joint="k"/>'),
        "got none of that name for 'k'",
    ),
    "a fixed leader": (
        link(*"abc") + joint("k", "a", "b", "fixed")
        + joint("j", "b", "c", inside='<mimic joint="k"/>'),
        "got fixed for 'k'",
    ),
    "a ring of mimics": (
        link(*"abc") + joint("k", "a", "b", inside='<mimic joint="j"/>')
        + joint("j", "b", "c", inside='<mimic joint="k"/>'),
        "in a ring",
    ),
    "too many": (
        link(*map(str, range(10_001)))
        + "".join(joint(str(i), "0", str(i), "fixed") for i in range(1, 10_001)),
        "expected at most 10,000 joints, got 10,001",
    ),
    "unexpanded macros": (
        link("a", "b") + joint("j", "a", "b", inside='<origin xyz="${x} 0 0"/>'),
        "expected a value, got the xacro '${x} 0 0': run xacro first",
    ),
    "a macro": (
        '<xacro:macro name="m"/>' + link("a"),
        "<xacro:macro name='m'>: expected a URDF file, got xacro: run xacro first",
    ),
    "a name of a macro": ('<link name="${prefix}base"/>', "${prefix}base': run xacro first"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_robot_is_refused_and_named(name, refusal):
    text, message = WRONG[name]
    assert message in refusal(robot, text)


OFFSET = '<origin xyz="1 0 0"/>'
QUATERNION = 'quat_xyzw="0 0 1.2 1.6"'  # of length 2, about z by 2 atan2(3, 4)
TURNS = {
    "1.0": ("", [1.0, 0.0, 0.0]),
    "1.1": ("", [0.28, 0.96, 0.0]),
    "1.2": ("", [0.28, 0.96, 0.0]),
    "1.0 with rpy": (' rpy="0 0 1.5707963267948966"', [0.0, 1.0, 0.0]),
}


@pytest.mark.filterwarnings("ignore::plumbob.reference.formats.FormatWarning")
@pytest.mark.parametrize("name", TURNS)
def test_the_quaternion_of_an_origin_is_read_as_pinocchio_reads_it(name, tmp_path):
    """From version 1.1 on, of any length; the tip is at a place computed by hand."""
    pinocchio = pytest.importorskip("pinocchio")
    rpy, tip = TURNS[name]
    origin = f'<origin xyz="0 0 0" {QUATERNION}{rpy}/>'
    joints = joint("j", "a", "b", "fixed", origin, "") + joint("k", "b", "c", "fixed", OFFSET, "")
    text = f'<robot name="r" version="{name[:3]}">{link(*"abc")}{joints}</robot>'
    np.testing.assert_allclose(pose(urdf.parse(text), "c")[0], tip, atol=1e-15)
    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, pinocchio.neutral(model))
    theirs = data.oMf[model.getFrameId("c")].translation
    np.testing.assert_allclose(theirs, tip, atol=1e-15)


def inertial(mass, centre, more=""):
    moments = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    return f'<inertial><mass value="{mass}"/>{more}<origin xyz="{centre}"/>{moments}</inertial>'


INERTIALS = {
    "one": inertial(2.5, "0.1 0.2 0.3"),
    "two": inertial(2.5, "0.1 0.2 0.3") + inertial(1.0, "1 1 1"),
    "two masses": inertial(2.5, "0.1 0.2 0.3", '<mass value="7"/>'),
}


@pytest.mark.parametrize("name", INERTIALS)
def test_masses_and_their_centres_are_pinocchios(name):
    """Of repeated elements the first counts, as in urdfdom."""
    pinocchio = pytest.importorskip("pinocchio")
    body = f'<link name="b">{INERTIALS[name]}</link>'
    text = f'<robot name="r">{link("a", "c")}{body}{{}}{{}}</robot>'.format(
        joint("j", "a", "b", "continuous", OFFSET, ""), joint("k", "b", "c", "fixed", OFFSET, "")
    )
    robot, model = urdf.parse(text), pinocchio.buildModelFromXML(text)
    names = robot.articulation.names
    theirs = model.inertias[model.getJointId("j")]
    assert (robot.masses[names.index("b")], robot.masses.sum()) == (theirs.mass, theirs.mass)
    np.testing.assert_allclose(robot.centres[names.index("b")], theirs.lever, atol=1e-15)
    assert theirs.mass == 2.5


def test_a_quaternion_that_is_passed_over_gets_a_warning():
    text = (
        f"<robot>{link('a', 'b')}{joint('j', 'a', 'b', inside=f'<origin {QUATERNION}/>')}</robot>"
    )
    with pytest.warns(FormatWarning, match=r"<origin>: expected version 1\.1 for quat_xyzw, got"):
        urdf.parse(text)


NO_QUATERNIONS = {
    "three numbers": ("1.1", 'quat_xyzw="0 0 1"', "expected 4 numbers in 'quat_xyzw', got '0 0 1'"),
    "zero": ("1.1", 'quat_xyzw="0 0 0 0"', "expected a quaternion in 'quat_xyzw', got '0 0 0 0'"),
    "empty": ("1.2", 'quat_xyzw=""', "expected a quaternion in 'quat_xyzw', got ''"),
    "two": ("1.1", f'{QUATERNION} rpy="0 0 0"', "expected one orientation, got rpy and quat_xyzw"),
    "a version to come": ("2.0", QUATERNION, "expected one of 1.0, 1.1, 1.2 for version"),
}


@pytest.mark.parametrize("name", NO_QUATERNIONS)
def test_other_quaternions_of_origins_are_refused_by_name(name, refusal):
    version, attributes, problem = NO_QUATERNIONS[name]
    inside = joint("j", "a", "b", inside=f"<origin {attributes}/>")
    text = f'<robot version="{version}">{link("a", "b")}{inside}</robot>'
    assert problem in refusal(urdf.parse, text)
