"""Laws of the comparison of files: which files are found, their outcomes, and crashes."""

import os
import re
import signal
import time
from contextlib import closing

import numpy as np
import pytest

from plumbob.crosscheck.engines.file_kind import BVH, FRAGMENT, MJCF, URDF, file_kind
from plumbob.crosscheck.robots import comparisons, files
from plumbob.crosscheck.robots.comparisons import sweep_in_parts
from plumbob.crosscheck.robots.deviations import FRAME, INCLUDE, PLANE, QUATERNION
from plumbob.crosscheck.robots.files import (
    AGREES,
    CRASHED,
    DEVIATES,
    DIFFERS,
    NEITHER,
    REFUSED,
    SECOND_READER,
    UNREAD,
    ModelFile,
    check,
    compare,
    find,
)
from plumbob.crosscheck.robots.models import RobotFile
from plumbob.crosscheck.tolerances import POSITION
from plumbob.process.child import CallProcess, LostError
from plumbob.reference import Skeleton, rotation
from plumbob.reference.formats import bvh, mjcf

ARM = """<robot name="arm"><link name="base"/><link name="arm"/>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0.1 0.2 0.3"/><axis xyz="0 1 0"/><limit lower="{}" upper="2" effort="1" velocity="1"/>
</joint></robot>""".format
BODY = '<body name="{}" pos="{} 0 0"><geom size="0.1"/><joint range="-60 60"/>{}</body>'.format
TRUNK = BODY("trunk", 0, BODY("head", 1, ""))
PART = f"<mujocoinclude>{TRUNK}</mujocoinclude>"
BY_CLASS = BODY("hand", 0, "").replace("<joint", '<joint class="c"')


def character(inside):
    return f"<mujoco><worldbody>{inside}</worldbody></mujoco>"


def motion(count=3, joints=4):
    skeleton = Skeleton(np.arange(-1, joints - 1), np.ones((joints, 3)))
    return bvh.format(skeleton, rotation.random(np.random.default_rng(1), count, joints))


@pytest.fixture
def folder(tmp_path):
    """Return the function that writes files and returns their folder."""

    def write(**texts):
        for name, text in texts.items():
            path = tmp_path / name.replace("__", "/").replace("_", ".")
            path.parent.mkdir(exist_ok=True, parents=True)
            path.write_text(text)
        return tmp_path

    return write


class Here:
    """Stands for a process of its own, which takes seconds to start."""

    def __init__(self, prepare, patience):
        pass

    def close(self):
        pass

    def call(self, function, *arguments):
        return function(*arguments)


@pytest.fixture
def here(monkeypatch):
    """Let files be read in this process."""
    monkeypatch.setattr(files, "CallProcess", Here)


def outcomes(folder, **options):
    """What came of each file in a folder beside each engine, by name."""
    return {
        one.file.path.relative_to(folder).as_posix(): {r.engine: r for r in one.readings}
        for one in check(find([folder]).files, **options)
    }


KINDS = {
    "a.urdf": ("anything", URDF),
    "a.URDF": ("", URDF),
    "a.bvh": ("", BVH),
    "a.xml": ('<?xml version="1.0"?>\n<!-- <mujoco> --><robot><link/></robot>', URDF),
    "robot.xml": ("<!DOCTYPE robot><robot><devices/></robot>", ""),
    "b.xml": ("\ufeff<mujoco><worldbody/></mujoco>", MJCF),
    "c.xml": ("\n <?xml version='1.0'?>\n<mujoco>\n<include file='a'/></mujoco>", MJCF),
    "cut.xml": ("<mujoco><worldbody><body", MJCF),
    "d.mjcf": ("<mujoco model='a'><worldbody/></mujoco>", MJCF),
    "e.xml": ("<mujoco><asset/></mujoco>", FRAGMENT),
    "f.xml": (PART, FRAGMENT),
    "g.xml": ("<!DOCTYPE html><html><mujoco/></html>", ""),
    "h.xml": ("not XML", ""),
    "i.xml": ("", ""),
    "j.txt": ("<mujoco><worldbody/></mujoco>", ""),
    "k.xml": ("<!-- " * 10**5 + "<mujoco>", ""),
}


@pytest.mark.parametrize("name", KINDS)
def test_the_kind_of_a_file_follows_from_its_name_and_root_element(name, tmp_path):
    (tmp_path / name).write_text(KINDS[name][0])
    assert file_kind(tmp_path / name) == KINDS[name][1]


def test_files_are_found_below_folders_in_order_and_once(folder):
    root = folder(
        b__b_urdf=ARM(-1), a_xml=character(TRUNK), b__a_bvh=motion(), c_xml="<other/>", d_txt="",
        b__part_xml=PART,
    )  # fmt: skip
    os.mkfifo(root / "endless.xml")
    (root / "gone.urdf").symlink_to(root / "nowhere")
    found = find([root, root / "b", root / "a.xml"])
    assert [(file.path.relative_to(root).as_posix(), file.kind) for file in found.files] == [
        ("a.xml", MJCF), ("b/a.bvh", BVH), ("b/b.urdf", URDF), ("b/part.xml", FRAGMENT)
    ]  # fmt: skip
    assert found.ignored == 1
    assert {file.root for file in found.files} == {root}
    assert find([root / "a.xml"]).files == (ModelFile(root / "a.xml", MJCF, root),)


def test_folders_without_files_are_an_error(folder):
    root = folder(a_txt="")
    with pytest.raises(ValueError, match="expected URDF, MJCF or BVH files, got none"):
        find([root])
    with pytest.raises(ValueError, match="there is no such file or folder"):
        find([root / "nowhere"])


def test_all_readers_agree_on_valid_files(folder, here):
    root = folder(a_urdf=ARM(-1), b_xml=character(TRUNK), c_bvh=motion())
    said = outcomes(root)
    assert [list(readings) for readings in said.values()] == [
        ["Pinocchio", "MuJoCo"], ["Pinocchio", "MuJoCo"], [SECOND_READER]
    ]  # fmt: skip
    for readings in said.values():
        for reading in readings.values():
            assert reading.outcome == AGREES, reading
            assert reading.difference < 1e-14
            assert (reading.why, reading.notes) == ("", ())


@pytest.mark.parametrize(("encoding", "by"), [("iso-8859-1", AGREES), ("utf-16", UNREAD)])
def test_files_in_a_declared_encoding_are_compared(encoding, by, tmp_path, here):
    """MuJoCo's own reader of MJCF refuses UTF-16; of URDF it gets the text."""
    for name, text in {"a.urdf": ARM(-1), "b.xml": character(TRUNK)}.items():
        text = f'<?xml version="1.0" encoding="{encoding}"?><!-- \xfc -->{text}'
        (tmp_path / name).write_bytes(text.encode(encoding))
    said = outcomes(tmp_path)
    assert said["a.urdf"]["MuJoCo"].outcome == AGREES
    assert {reading.outcome for reading in said["b.xml"].values()} == {by}


def test_a_refused_file_names_the_reader_and_the_reason(folder, here):
    root = folder(
        a_urdf="<robot", b_xml=character('<body name="b"><composite/></body>'),
        c_xml=character(TRUNK + "<geom type='hfield'/>"), d_bvh="HIERARCHY", e_urdf=ARM(3),
    )  # fmt: skip
    said = outcomes(root)
    assert said["a.urdf"]["Pinocchio"].outcome == NEITHER
    assert "; the reference: a.urdf, line 1: expected well-formed" in said["a.urdf"]["MuJoCo"].why
    assert said["b.xml"]["Pinocchio"].outcome == REFUSED
    assert said["b.xml"]["Pinocchio"].why.startswith("b.xml, line 1: <composite>: expected every")
    assert said["d.bvh"][SECOND_READER].outcome == REFUSED
    assert said["e.urdf"]["MuJoCo"].outcome == AGREES
    assert "lower 3, upper 2; read as unlimited" in said["e.urdf"]["MuJoCo"].notes[0]
    assert all("\n" not in r.why + "".join(r.notes) for rs in said.values() for r in rs.values())


def test_included_files_are_not_models(folder, here):
    """One that a model includes and nobody reads by itself is a part, whatever its root says."""
    main = '<mujoco><default><default class="c"/></default><include file="hand.xml"/></mujoco>'
    root = folder(main_xml=main, hand_xml=character(BY_CLASS), part_xml=PART)
    checked = {one.file.path.name: one for one in check(find([root]).files)}
    assert {name: one.file.kind for name, one in checked.items()} == {
        "hand.xml": FRAGMENT, "main.xml": MJCF, "part.xml": FRAGMENT
    }  # fmt: skip
    assert checked["hand.xml"].readings == ()
    assert checked["main.xml"].readings[1].outcome == AGREES
    (root / "main.xml").unlink()
    checked = {one.file.path.name: one for one in check(find([root]).files)}
    assert checked["hand.xml"].file.kind == MJCF
    assert checked["hand.xml"].readings[1].outcome == NEITHER


def test_includes_are_read_from_the_whole_folder(folder, here):
    root = folder(
        robots__a_xml=character('<include file="../parts/trunk.xml"/>'), parts__trunk_xml=PART
    )
    assert outcomes(root)["robots/a.xml"]["MuJoCo"].outcome == AGREES
    reading = outcomes(root / "robots")["a.xml"]["MuJoCo"]
    assert reading.outcome == REFUSED
    assert "which is outside" in reading.why


def test_a_difference_is_excused_only_where_the_other_engine_agrees(folder, here, monkeypatch):
    inner = '<include file="part.xml"/>'
    root = folder(
        a_xml=character(BODY("b", 0, inner)),
        part_xml='<x><joint name="k" type="slide" axis="1 0 0" range="0 1"/></x>',
    )
    reading = outcomes(root)["a.xml"]["Pinocchio"]
    confirmed = "; MuJoCo agrees with the reference"
    assert (reading.outcome, reading.why) == (DEVIATES, INCLUDE + confirmed)
    assert reading.difference > 0.01
    monkeypatch.setattr(files, "known_deviations", lambda *_: [])
    reading = outcomes(root)["a.xml"]["Pinocchio"]
    assert (reading.outcome, reading.why) == (DEVIATES, "the file shows no known cause" + confirmed)
    file = find([root]).files[0]
    theirs = files.FileReading("Pinocchio", DIFFERS, 0.5), files.FileReading("MuJoCo", CRASHED)
    monkeypatch.undo()
    assert files._with_causes(Here(None, 60.0), file, list(theirs)) == theirs


PLANE_JOINT = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="p" type="planar"><parent link="a"/><child link="b"/>
<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>{}</joint>
<joint name="k" type="continuous"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/></joint>
</robot>""".format


def test_planar_joints_agree_and_their_axes_are_read_otherwise_by_pinocchio(folder, here):
    """In all three coordinates and their Jacobians; Pinocchio takes every axis for z."""
    root = folder(
        a_urdf=PLANE_JOINT('<axis xyz="0 0 2"/>'), b_urdf=PLANE_JOINT('<axis xyz="1 2 2"/>'),
        c_urdf=PLANE_JOINT('<axis xyz="0 0 -1"/>'), d_urdf=PLANE_JOINT(""),
    )  # fmt: skip
    for name, readings in outcomes(root).items():
        assert readings["MuJoCo"].outcome == AGREES, readings
        theirs = readings["Pinocchio"]
        why = f"{PLANE}; MuJoCo agrees with the reference"
        expected = (AGREES, "") if name == "a.urdf" else (DEVIATES, why)
        assert (theirs.outcome, theirs.why) == expected
        assert min(readings["MuJoCo"].difference, theirs.difference) < 1e-14


def test_a_quaternion_that_mujoco_passes_over_is_confirmed_by_pinocchio(folder, here):
    turned = ARM(-1).replace('name="arm"', 'name="arm" version="1.1"', 1)
    turned = turned.replace("<origin", '<origin quat_xyzw="0 0 0.6 0.8"')
    readings = outcomes(folder(a_urdf=turned))["a.urdf"]
    assert readings["Pinocchio"].outcome == AGREES
    assert readings["MuJoCo"].outcome == DEVIATES
    assert readings["MuJoCo"].why == f"{QUATERNION}; Pinocchio agrees with the reference"


OLD = '<option collision="all"/>'
INNER = '<frame><joint name="k"/></frame>'  # which Pinocchio passes over


def test_mujoco_confirms_a_known_cause_in_a_file_whose_settings_it_refuses(folder, here):
    """An option of older MuJoCo is in the file, in one that it includes or in both."""
    main = "<mujoco>{}<worldbody>{}</worldbody></mujoco>".format
    included = f"<mujoco>{OLD}<default/></mujoco>"
    root = folder(
        a_xml=main(OLD, BODY("b", 0, INNER)), part__old_xml=included,
        b_xml=main('<include file="part/old.xml"/>' + OLD, BODY("b", 0, INNER)),
        c_xml=main('<include file="part/old.xml"/>', BODY("b", 0, INNER)),
    )  # fmt: skip
    readings = outcomes(root)
    for name in ("a.xml", "b.xml", "c.xml"):
        assert readings[name]["MuJoCo"].outcome == UNREAD
        assert "unrecognized attribute: 'collision'" in readings[name]["MuJoCo"].why
        assert readings[name]["Pinocchio"].outcome == DEVIATES
        assert FRAME in readings[name]["Pinocchio"].why
        assert readings[name]["Pinocchio"].difference > 0.01


def test_a_known_cause_excuses_nothing_where_nobody_confirms_it(folder, here, monkeypatch):
    """MuJoCo refuses more than settings; or it reads the copy otherwise than the reference."""
    refused = BODY("b", 0, INNER).replace("size", "colour")
    root = folder(
        a_xml=character(refused), b_xml=character(BODY("b", 0, INNER)).replace(">", f">{OLD}", 1)
    )
    assert outcomes(root)["a.xml"]["MuJoCo"].outcome == UNREAD
    assert outcomes(root)["a.xml"]["Pinocchio"].outcome == DIFFERS
    assert outcomes(root)["b.xml"]["Pinocchio"].outcome == DEVIATES
    read = mjcf.read
    other = folder(other__b_xml=character(BODY("b", 1, INNER))) / "other" / "b.xml"
    monkeypatch.setattr(mjcf, "read", lambda path, **options: read(other))
    assert outcomes(root)["b.xml"]["Pinocchio"].outcome == DIFFERS


def tree_of_hinges(count):
    """A URDF of hinges, three on each link."""
    links = "".join(f'<link name="l{i}"/>' for i in range(count + 1))
    joints = "".join(
        f"""<joint name="j{i}" type="continuous"><parent link="l{(i - 1) // 3}"/>
        <child link="l{i}"/><origin xyz="0.1 0.2 0.3"/><axis xyz="0 {i % 2} 1"/></joint>"""
        for i in range(1, count + 1)
    )
    return f'<robot name="tree">{links}{joints}</robot>'


@pytest.mark.parametrize("engine", ["Pinocchio", "MuJoCo"])
def test_the_parts_of_a_model_differ_by_as_much_as_the_whole(engine, folder, monkeypatch):
    """To the bit; and a fault in the last link alone is seen from every size of the parts."""
    file = find([folder(a_urdf=tree_of_hinges(40))]).files[0]
    model = RobotFile("a.urdf", file.path)
    numbers = 41 * 5 * 6 * 40

    def compared(part):
        parts = list(sweep_in_parts(engine, model, part))
        return len(parts), comparisons.differences(parts)

    count, whole = compared(np.inf)
    assert count == 1
    assert max(whole) < POSITION.value
    sizes = (numbers, numbers / 2, numbers / 7, numbers / 40.5, 1)
    assert [compared(size)[0] for size in sizes] == [1, 2, 7, 41, 41]
    assert all(compared(size)[1] == whole for size in sizes)
    right = comparisons.reference_kinematics

    def with_a_fault(robot, q, links):
        J = right(robot, q, links)
        J.jacobians[:, links == 40, 3:] += np.nan if np.isnan(fault) else fault
        return J

    monkeypatch.setattr(comparisons, "reference_kinematics", with_a_fault)
    for fault in (1e-3, np.nan):
        for size in (np.inf, *sizes):
            np.testing.assert_allclose(compared(size)[1].jacobians, fault, rtol=1e-9)


BLIND = {
    "a body of a character elsewhere": ("a.xml", character(TRUNK), 'pos="1', 'pos="1.000001'),
    "an axis": ("a.urdf", ARM(-1), "0 1 0", "0 1 1e-9"),
    "an offset": ("a.bvh", motion(), "OFFSET 1.000000", "OFFSET 1.000001"),
    "a rotation": ("a.bvh", motion(), "Zrotation X", "Xrotation Z"),
}


@pytest.mark.parametrize("name", BLIND)
def test_a_changed_file_differs(name, tmp_path, monkeypatch):
    """The reference is made to read another file than the engines."""
    path, text, pattern, instead = BLIND[name]
    assert pattern in text
    (tmp_path / path).write_text(text)
    other = tmp_path / "other" / path
    other.parent.mkdir()
    other.write_text(text.replace(pattern, instead))
    file = find([tmp_path / path]).files[0]
    for engine in files.ENGINES[file.kind]:
        assert compare(engine, file).outcome == AGREES
    for reader in (bvh, mjcf, RobotFile):
        read = reader.read
        monkeypatch.setattr(
            reader, "read",
            (lambda self, read=read, **options: read(RobotFile("", other), **options))
            if reader is RobotFile
            else (lambda _, read=read, **options: read(other)),
        )  # fmt: skip
    for engine in files.ENGINES[file.kind]:
        reading = compare(engine, file)
        assert reading.outcome == DIFFERS, reading
        assert reading.difference > 1e3 * POSITION.value


@pytest.mark.parametrize("frame", [0, -1])
@pytest.mark.parametrize("part", [1, 2], ids=["position", "rotation"])
def test_every_frame_of_a_motion_is_compared(frame, part, tmp_path, monkeypatch):
    """Also the rotations of a joint that carries no other."""
    (tmp_path / "a.bvh").write_text(motion())
    file = find([tmp_path]).files[0]
    poses = list(files.global_poses(motion()))
    assert len(poses[-1][1]) > 1
    poses[-1][part][frame] += 1e-6
    assert compare(files.SECOND_READER, file).outcome == AGREES
    monkeypatch.setattr(files, "global_poses", lambda text: iter(poses))
    assert compare(files.SECOND_READER, file).outcome == DIFFERS


def test_channels_in_small_letters_are_the_same_channels(tmp_path):
    text = re.sub("[XYZ](rot|pos)", lambda match: match[0].lower(), motion())
    assert text != motion()
    (tmp_path / "a.bvh").write_text(text)
    reading = compare(files.SECOND_READER, find([tmp_path]).files[0])
    assert (reading.outcome, reading.why) == (AGREES, "")


def raising(*_):
    raise KeyError("a")


@pytest.mark.parametrize(
    ("largest", "outcome", "why"),
    [
        *((lambda *_, x=x: x, DIFFERS, "") for x in (np.nan, np.inf, 2 * POSITION.value)),
        (raising, CRASHED, "it ends in KeyError: 'a'"),
    ],
)
def test_a_difference_above_the_tolerance_differs_and_an_exception_is_lost(
    largest, outcome, why, folder, monkeypatch
):
    monkeypatch.setattr(files, "_largest_difference", largest)
    reading = compare("MuJoCo", find([folder(a_urdf=ARM(-1))]).files[0])
    assert (reading.outcome, reading.why) == (outcome, why)


@pytest.mark.slow
def test_a_file_that_crashes_an_engine_loses_only_that_reading(folder):
    """So many bodies in each other are more than the stack that Pinocchio 4.1 reads on holds."""
    deep = '<body name="a">' * 60_000 + "</body>" * 60_000
    root = folder(a_urdf=ARM(-1), c_urdf=ARM(-2), b_xml=character(deep))
    said = outcomes(root)
    assert said["b.xml"]["Pinocchio"].outcome == CRASHED
    assert said["b.xml"]["Pinocchio"].why == "the process ends by SIGSEGV"
    assert said["b.xml"]["MuJoCo"].outcome == NEITHER
    assert "at most 500 elements in each other" in said["b.xml"]["MuJoCo"].why
    for name in ("a.urdf", "c.urdf"):
        assert {r.outcome for r in said[name].values()} == {AGREES}


def nothing():
    pass


def crash(code):
    os.kill(os.getpid(), code) if code == signal.SIGSEGV else os._exit(code)


def spin(seconds):
    """Work for so much processor time [s]."""
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def loud():
    os.write(1, b"loud")
    os.write(2, b"loud")
    return os.getpid()


@pytest.mark.slow
def test_a_call_that_crashes_or_hangs_is_lost_and_the_next_one_is_not(capfd):
    with closing(CallProcess(nothing, patience=0.3)) as child:
        first = child.call(loud)
        assert child.call(loud) == first != os.getpid()
        with pytest.raises(LostError, match="ends by SIGSEGV"):
            child.call(crash, signal.SIGSEGV)
        with pytest.raises(LostError, match="ends with code 3"):
            child.call(crash, 3)
        with pytest.raises(LostError, match=r"takes more than 0\.3 s of processor time"):
            child.call(spin, 60.0)
        with pytest.raises(LostError, match="gives no answer within 3 s"):
            child.call(time.sleep, 60)
        assert child.call(loud) not in (first, os.getpid())
        process = child._child._process
    assert process.returncode is not None
    assert capfd.readouterr() == ("", "")
