import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from plumbob.crosscheck.robots.independent_bvh import global_poses
from plumbob.reference import (
    Articulation,
    Skeleton,
    curves,
    forward_kinematics,
    rotation,
    scenes,
    track,
)
from plumbob.reference.formats import FormatWarning, bvh
from plumbob.reference.formats.bvh import ORDERS, euler_angles

ONE_JOINT = """HIERARCHY
ROOT hip
{{
OFFSET 1 2 3
CHANNELS {}
}}
MOTION
Frames: 1
Frame Time: 0.1
{}"""
WALK = """HIERARCHY
ROOT hip
{
	OFFSET 0 0 0
	CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
	JOINT left leg {
		OFFSET 0.5 -1 0
		CHANNELS 3 Yrotation Zrotation Xrotation
		End Site
		{
			OFFSET 0 -2 0
		}
	}
	JOINT head
	{
		OFFSET 0 1 0
		CHANNELS 1 Xrotation
		End Site { OFFSET 0 0 0 }
	}
}
MOTION
Frames: 2
Frame Time: 0.04
1 2 3 10 20 30 40 50 60 70
1.5 2 3 -10 -20 -30 -40 -50 -60 -70
"""


IDENTITY = [1.0, 0.0, 0.0, 0.0]


def rotation_about(axis, degrees):
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def positions_by_a_second_reader(text):
    """The joints' global positions by name, frame by frame, computed independently."""
    return {name: positions for name, positions, _ in global_poses(text)}


def bound(skeleton):
    """How far each joint may be off after six decimals, as `bvh.write` states it."""
    paths = [skeleton.path(j) for j in range(skeleton.joint_count)]
    n = np.array([len(path) - 1 for path in paths])
    L = np.array([skeleton.link_lengths[path].sum() for path in paths])
    return (n + 1) * 9e-7 + n * L * 2.7e-8


def assert_same_positions(skeleton, positions, text):
    """Both readers find every joint where it was."""
    motion, second = bvh.parse(text), positions_by_a_second_reader(text)
    found = motion.pose().positions
    assert sorted(motion.skeleton.names) == sorted(skeleton.names)
    for j, name in enumerate(skeleton.names):
        ours = found[:, motion.skeleton.index(name)]
        assert np.linalg.norm(ours - positions[:, j], axis=-1).max() <= bound(skeleton)[j]
        np.testing.assert_allclose(second[name], ours, atol=1e-13)


@st.composite
def motions(draw):
    """A tree of up to seven joints, in any order that puts parents first, and some frames of it."""
    seed = draw(st.integers(0, 2**32 - 1))
    rng, count = np.random.default_rng(seed), draw(st.integers(1, 7))
    parents = [-1] + [draw(st.integers(0, j - 1)) for j in range(1, count)]
    offsets = rng.uniform(-2, 2, (count, 3)) * (rng.uniform(0, 1, (count, 1)) < 0.8)
    names = [f"joint {j}" for j in range(count)]
    local = rotation.random(rng, draw(st.integers(1, 4)), count)
    if draw(st.booleans()):  # may pass for an end site
        names[-1] = f"{names[parents[-1]]} end"
        if draw(st.booleans()):
            local[:, -1] = IDENTITY
    return Skeleton(parents, offsets, names), local


@given(motions(), st.sampled_from(ORDERS))
def test_a_motion_reads_back_to_the_same_positions(motion, order):
    skeleton, local = motion
    positions = forward_kinematics(skeleton, local).positions
    assert_same_positions(skeleton, positions, bvh.format(skeleton, local, order=order))


@given(motions(), st.sampled_from(ORDERS))
def test_a_motion_reads_back_to_the_same_skeleton_and_rotations(motion, order):
    skeleton, local = motion
    back = bvh.parse(bvh.format(skeleton, local, 0.03, order=order))
    at = [back.skeleton.index(name) for name in skeleton.names]
    assert back.frame_time == 0.03
    np.testing.assert_allclose(back.skeleton.offsets[at], skeleton.offsets, atol=5.1e-7)
    assert rotation.angle(back.local_rotations[:, at], local).max() <= 2.7e-8
    assert [at[p] if p >= 0 else -1 for p in skeleton.parents] == [
        back.skeleton.parents[j] for j in at
    ]


@given(motions(), st.sampled_from(ORDERS))
def test_a_written_file_is_rewritten_as_it_is(motion, order):
    text = bvh.format(*motion, order=order)
    assert bvh.format(*bvh.parse(text), order=order) == text


@pytest.mark.parametrize("solver", ["ccd", "fabrik"])
def test_a_tracked_motion_opens_in_other_programs(solver, tmp_path):
    skeleton, _ = scenes.lab_arm()
    tracked = track(skeleton, curves["heart"](40), solver=solver)
    bvh.write(tmp_path / "heart.bvh", skeleton, tracked.local_rotations)
    text = (tmp_path / "heart.bvh").read_text()
    assert_same_positions(skeleton, tracked.positions, text)
    back = bvh.read(tmp_path / "heart.bvh")
    assert back.skeleton.names == skeleton.names
    plain = forward_kinematics(back.skeleton, back.local_rotations).positions
    np.testing.assert_allclose(plain, tracked.positions, atol=bound(skeleton).max())
    assert np.ptp(plain[:, -1], axis=0).max() > 0.5


def test_joints_that_shift_read_back(rng):
    skeleton = Skeleton([-1, 0, 1, 1], rng.uniform(-1, 1, (4, 3)), list("abcd"))
    joints = Articulation(
        skeleton, ["free", "slide", "hinge", "ball"], rng.standard_normal((4, 3)),
        frames=rotation.random(rng, 4),
    )  # fmt: skip
    q = joints.random(rng, 5)
    text = bvh.format(joints, q)
    assert text.count("CHANNELS 6") == 2
    assert "ROOT a\n{\n\tOFFSET 0.000000 0.000000 0.000000\n" in text
    assert_same_positions(skeleton, forward_kinematics(joints, q).positions, text)


def test_a_root_that_moves_reads_back(rng):
    skeleton, _ = scenes.lab_arm()
    local, path = rotation.random(rng, 4, 5), rng.uniform(-3, 3, (4, 3))
    back = bvh.parse(bvh.format(skeleton, local, offsets=path))
    np.testing.assert_allclose(back.offsets[:, 0], path, atol=5.1e-7)
    np.testing.assert_allclose(back.pose().positions[:, 0], path, atol=5.1e-7)
    np.testing.assert_allclose(back.skeleton.offsets[0], path[0], atol=5.1e-7)
    everything = np.tile(skeleton.offsets, (4, 1, 1))
    everything[:, 0] = path
    assert bvh.format(skeleton, local, offsets=everything) == bvh.format(
        skeleton, local, offsets=path
    )


CHANNELS = [*ORDERS, "X", "Y", "Z", "ZX", "YZ", "", "zxy"]


@pytest.mark.parametrize("order", CHANNELS)
def test_channels_compose_in_their_own_order(order):
    angles = [10.0, -200.0, 75.0][: len(order)]
    names = " ".join(f"{axis}rotation" for axis in order)
    text = ONE_JOINT.format(
        f"{len(order) + 1} Yposition {names}", f"9 {' '.join(map(str, angles))}"
    )
    expected = np.eye(3)
    for axis, angle in zip(order.upper(), angles, strict=False):
        expected = expected @ rotation_about(axis, angle)
    motion = bvh.parse(text)
    np.testing.assert_allclose(
        rotation.to_matrix(motion.local_rotations[0, 0]), expected, atol=1e-15
    )


def test_a_file_of_many_manners_is_read():
    motion = bvh.parse(WALK.replace("JOINT", "Joint").replace("\n", "\r\n").replace("\t\t", " "))
    assert motion.skeleton.names == ("hip", "left leg", "left leg end", "head")
    assert motion.skeleton.parents.tolist() == [-1, 0, 1, 0]
    assert motion.frame_time == 0.04
    assert motion.offsets[:, 0].tolist() == [[1, 2, 3], [1.5, 2, 3]]
    legs = positions_by_a_second_reader(WALK)
    for j, name in enumerate(motion.skeleton.names):
        np.testing.assert_allclose(motion.pose().positions[:, j], legs[name], atol=1e-14)
    R = rotation_about("Z", 10) @ rotation_about("X", 20) @ rotation_about("Y", 30)
    np.testing.assert_allclose(legs["left leg"][0], [1, 2, 3] + R @ [0.5, -1, 0], atol=1e-14)


def test_a_frame_too_many_is_left_out_with_a_warning():
    said = "line 25: expected the end after 1 frames, got one more, which is left out"
    with pytest.warns(FormatWarning, match=said):
        motion = bvh.parse(WALK.replace("Frames: 2", "Frames: 1"))
    assert motion.offsets.shape[0] == 1
    assert motion.offsets[:, 0].tolist() == [[1, 2, 3]]


def test_no_frames_are_a_skeleton():
    text = WALK[: WALK.index("Frames")] + "Frames: 0\nFrame Time: 0.04\n"
    motion = bvh.parse(text)
    assert motion.local_rotations.shape == (0, 4, 4)
    assert motion.pose().positions.shape == (0, 4, 3)
    assert motion.skeleton.offsets[1].tolist() == [0.5, -1, 0]
    assert "Frames: 0\n" in bvh.format(*motion)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("side", [90.0, -90.0])
def test_gimbal_lock_costs_no_accuracy(order, off, side):
    middle = np.degrees(off) + side
    R = Rotation.from_euler(order, [[30.0, middle, 50.0], [-170, middle, 100]], degrees=True)
    q = R.as_quat(scalar_first=True)[None]
    back = Rotation.from_euler(order, euler_angles(q, order)[0], degrees=True)
    assert (R.inv() * back).magnitude().max() < 1e-14
    skeleton = Skeleton([-1, 0], np.eye(3)[:2])
    again = bvh.parse(bvh.format(skeleton, q, order=order)).local_rotations
    assert rotation.angle(again, q).max() <= 2.7e-8


def test_angles_are_continuous_beyond_360_degrees():
    angle = np.radians(np.linspace(0, 1080, 100))
    skeleton = Skeleton([-1], [[0, 0, 0]])
    spins = rotation.exponential(angle[:, None, None] * np.array([0.0, 0.0, 1.0]))
    angles = euler_angles(spins, "ZXY")[:, 0]
    np.testing.assert_allclose(angles[:, 0], np.degrees(angle), atol=1e-10)
    np.testing.assert_allclose(angles[:, 1:], 0.0, atol=1e-10)
    assert bvh.format(skeleton, spins).splitlines()[-1].split()[3] == "1080.000000"


TIP = [0.0, 0.0, 1.0]
TURNED = [0.0, 1.0, 0.0, 0.0]
LEAVES = {
    "an end": ([-1, 0], ["a", "a end"], TIP, IDENTITY, True),
    "the same, twice covered": ([-1, 0], ["a", "a end"], TIP, [-1.0, 0, 0, 0], True),
    "one of another name": ([-1, 0], ["a", "b"], TIP, IDENTITY, False),
    "one that rotates": ([-1, 0], ["a", "a end"], TIP, TURNED, False),
    "one at its parent": ([-1, 0], ["a", "a end"], [0.0, 4e-7, 0.0], IDENTITY, False),
    "one that has a brother": ([-1, 0, 0], ["a", "a end", "b"], TIP, IDENTITY, False),
    "one that has an elder son": ([-1, 0, 1], ["a", "a end", "b"], TIP, IDENTITY, False),
}


@pytest.mark.parametrize("name", LEAVES)
def test_an_end_site_is_written_for_what_reads_back_from_it(name):
    parents, names, offset, Q, expected = LEAVES[name]
    local = rotation.identity(1, len(parents))
    local[:, names.index("a end") if "a end" in names else 1] = Q
    skeleton = Skeleton(parents, [offset] * len(parents), names)
    text = bvh.format(skeleton, local)
    assert (f"OFFSET {offset[0]:.6f} {offset[1]:.6f} {offset[2]:.6f}\n\t}}" in text) == expected
    assert_same_positions(skeleton, forward_kinematics(skeleton, local).positions, text)
    shifted = np.ones((1, len(parents), 3))
    back = bvh.parse(bvh.format(skeleton, local, offsets=shifted))
    np.testing.assert_array_equal(back.offsets, shifted)


SITES = {
    "two end sites": (
        WALK.replace("{ OFFSET 0 0 0 }", "{ OFFSET 0 1 0 } End Site { OFFSET 1 0 0 }"),
        ("hip", "left leg", "left leg end", "head", "head end", "head end 2"),
        {4: [0, 1, 0], 5: [1, 0, 0]},
    ),
    "a joint of that name, later": (
        WALK.replace("JOINT head", "JOINT left leg end"),
        ("hip", "left leg", "left leg end 2", "left leg end"),
        {2: [0, -2, 0], 3: [0, 1, 0]},
    ),
    "three, one of them at its parent": (
        WALK.replace(
            "{ OFFSET 0 0 0 }", "{ OFFSET 1 0 0 } End { OFFSET 0 0 0 } End { OFFSET 2 0 0 }"
        ),
        ("hip", "left leg", "left leg end", "head", "head end", "head end 2"),
        {4: [1, 0, 0], 5: [2, 0, 0]},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", SITES)
def test_an_end_site_gets_a_name_that_no_joint_has(case):
    """The joints are where the second reader has them, and stay there when written and read."""
    text, names, offsets = SITES[case]
    motion = bvh.parse(text)
    assert motion.skeleton.names == names
    for j, x in offsets.items():
        assert motion.skeleton.offsets[j].tolist() == x
    pose = motion.pose()
    for j, (_, x, _) in enumerate(global_poses(text)):
        np.testing.assert_allclose(pose.positions[:, j], x, atol=1e-13)
    back = bvh.parse(bvh.format(*motion))
    assert back.skeleton.names == names
    np.testing.assert_allclose(back.pose().positions, pose.positions, atol=1e-5)


WRONG = {
    "empty": ("", "line 1: expected HIERARCHY, got the end of the file"),
    "no joints": ("HIERARCHY\nMOTION", "line 2: expected complete joints before MOTION, got none"),
    "two roots": (WALK.replace("JOINT head", "ROOT head"), "one ROOT and all joints in it"),
    "a joint twice": (WALK.replace("left leg", "hip"), "a name of its own, got 'hip'"),
    "no name": (WALK.replace("JOINT head", "JOINT"), "a name of its own, got ''"),
    "no brace": (WALK.replace("leg {", "leg"), "line 7: expected {, got 'OFFSET"),
    "no end": (WALK.replace("\n}", ""), "before MOTION, got 'hip' still open"),
    "an end too many": (WALK.replace("\n}", "\n}}"), "expected a joint or what belongs to one"),
    "no OFFSET": (WALK.replace("\tOFFSET 0 1 0\n", ""), "expected an OFFSET in 'head', got none"),
    "two OFFSETs": (WALK.replace("OFFSET 0 1 0", "OFFSET 0 1 0\nOFFSET 1 1 1"), "one OFFSET"),
    "a short OFFSET": (WALK.replace("OFFSET 0 1 0", "OFFSET 0 1"), "expected 3 numbers, got 2"),
    "an OFFSET beyond": (WALK.replace("OFFSET 0 1 0", "OFFSET 0 1e80 0"), "at most 1e+75"),
    "no number": (WALK.replace("OFFSET 0 1 0", "OFFSET 0 1 up"), "expected numbers, got 'up'"),
    "fewer channels": (WALK.replace("CHANNELS 1", "CHANNELS 2"), "a count and so many different"),
    "another channel": (WALK.replace("1 Xrotation", "1 Xscale"), "a count and so many different"),
    "a channel twice": (WALK.replace("1 X", "2 xrotation X"), "a count and so many different"),
    "channels of an end": (
        WALK.replace("OFFSET 0 -2 0", "OFFSET 0 -2 0\nCHANNELS 0"), "expected CHANNELS once"
    ),
    "a joint in an end": (
        WALK.replace("OFFSET 0 -2 0", "OFFSET 0 -2 0\nJOINT a"), "expected nothing in an end site"
    ),
    "another statement": (WALK.replace("OFFSET 0 1 0", "SCALE 2"), "got 'SCALE 2'"),
    "no motion": (WALK[: WALK.index("MOTION")], "expected MOTION, got the end of the file"),
    "no count": (WALK.replace("Frames: 2\n", ""), "expected 'Frames:', got 'Frame Time: 0.04'"),
    "no whole count": (WALK.replace("Frames: 2", "Frames: 2.5"), "a count of frames, got '2.5'"),
    "frames not there": (WALK.replace("Frames: 2", "Frames: 3"), "expected 3 frames, got the end"),
    "two frames too many": (
        WALK.replace("Frames: 2", "Frames: 0"), "line 25: expected the end after 0 frames"
    ),
    "words too many": (WALK + "the end", "expected the end after 2 frames, got 'the end'"),
    "a million frames": (WALK.replace("Frames: 2", "Frames: 1000000"), "got a shorter file"),
    "a billion frames": (WALK.replace("Frames: 2", "Frames: 999999999"), "at most 20,000,000"),
    "no time": (WALK.replace("Frame Time: 0.04\n", ""), "expected 'Frame Time:', got '1 2 3"),
    "no time at all": (WALK.replace("Time: 0.04", "Time: 0"), "time greater than 0, got 0"),
    "endless time": (WALK.replace("Time: 0.04", "Time: inf"), "expected numbers of at most"),
    "a short frame": (WALK.replace("60 70", "60"), "line 24: expected 10 numbers, got 9"),
    "NaN": (WALK.replace("60 70", "60 nan"), "line 24: expected numbers of at most 1e+75"),
    "frames of nothing": (
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 9\nFrame Time: 1\n",
        "expected 9 frames of 0 numbers, got a shorter file",
    ),
    "a million joints in each other": (
        "HIERARCHY\nROOT a\n{\n" + "".join(f"JOINT {i}\n{{\n" for i in range(10**6)),
        "expected at most 10,000 joints",
    ),
    "a line without end": ("HIERARCHY\n" + "{" * 10**6, "lines of at most 100,000 characters"),
    "ten million lines of nothing": ("\n" * 10**7, "line 10000001: expected HIERARCHY"),
    "many poses of few numbers": (
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n"
        + "".join(f"JOINT {i}\n{{\nOFFSET 0 0 0\n}}\n" for i in range(9000))
        + "}\nMOTION\nFrames: 3000\nFrame Time: 1\n" + "0\n" * 3000,
        "expected at most 20,000,000 frames times joints",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_motion_is_refused_and_named(name, refusal):
    text, message = WRONG[name]
    assert message in refusal(bvh.parse, text)


def test_a_file_cut_anywhere_is_refused(refusal):
    for end in range(len(WALK.rstrip()) - 3):  # with its last number cut it is whole again
        refusal(bvh.parse, WALK[:end])


def test_a_file_with_a_piece_missing_is_a_motion_or_refused(refusal):
    for begin in range(len(WALK)):
        text = WALK[:begin] + WALK[begin + 13 :]
        try:
            motion = bvh.parse(text)
        except ValueError:
            refusal(bvh.parse, text)
        else:
            assert np.isfinite(motion.pose().positions).all()


ARM = Skeleton([-1, 0], np.zeros((2, 3)), ["a", "b"])
REFUSED = [
    (ARM, rotation.identity(1, 1, 2), {}, "local_rotations: expected one pose or a row of frames"),
    (ARM, 2 * rotation.identity(2), {}, "local_rotations: expected unit quaternions"),
    (ARM, rotation.identity(2), {"order": "XYX"}, "order: expected one of XYZ, .*, got 'XYX'"),
    (ARM, rotation.identity(2), {"offsets": np.zeros((2, 3))}, r"offsets: expected shape \(1, 3\)"),
    (Articulation(ARM), rotation.identity(2), {}, r"local_rotations: expected shape \(..., 8\)"),
    (Articulation(ARM), np.eye(8)[0] + np.eye(8)[4], {"offsets": np.zeros((1, 3))}, "none beside"),
    *((Skeleton([-1], [[0, 0, 0]], [name]), rotation.identity(1), {}, "names without braces")
      for name in ["a{", "}", "two\nlines", " led", "a\tb", "a\0"]),
]  # fmt: skip


@pytest.mark.parametrize(("skeleton", "local", "options", "message"), REFUSED)
def test_what_cannot_be_written_is_refused(skeleton, local, options, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        bvh.write(tmp_path / "no.bvh", skeleton, local, **options)
    assert not list(tmp_path.iterdir())
