"""Files beside both engines: what is measured, and how it is shown."""

import pytest
from table_cells import column

from plumbob.bench.experiments.robot_models import (
    compare,
    compare_effectors,
    effector_differences,
    readers,
)
from plumbob.bench.peers.catalogue import KINEMATICS, SINGLE_PRECISION
from plumbob.bench.peers.ik import drake
from plumbob.bench.problems.robots import CHARACTER, ROBOTS, is_installed
from plumbob.bench.tables.results import Results
from plumbob.crosscheck.engines import ROBOT_ENGINES
from plumbob.crosscheck.robots.models import RobotFile

URDF = """<robot name="arm"><link name="base"/><link name="arm"/><link name="tip"/>
  <joint name="shoulder" type="continuous">
    <parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="arm"/><child link="tip"/><origin xyz="1 0 0"/><mimic joint="{leader}"/>
  </joint>
</robot>"""


@pytest.fixture
def compared(make, tmp_path):
    """Return the records of a file, by both engines, from its text."""

    def records(name, text):
        path = tmp_path / name
        path.write_text(text)
        return [
            make.record(
                "robot_models", f"robots/{name}", engine, {"configurations": 5},
                facts={"title": name, **measured},
            )
            for engine in ROBOT_ENGINES
            for measured in [compare(engine, RobotFile(name, path))]
        ]  # fmt: skip

    return records


def test_a_file_that_both_read_is_a_row_with_its_size_and_differences(compared):
    table = readers(Results(compared("arm.urdf", URDF.format(leader="shoulder"))))
    assert table.rows[0][:3] == ("arm.urdf", "Pinocchio and MuJoCo", 1)
    assert table.rows[0][-3:] == ("", 3, 2)
    assert 0.0 < column(table, "Jacobians")[0] < 1e-14
    assert table.summary.points == ("Pinocchio: 1 of 1 file read", "MuJoCo: 1 of 1 file read")


def test_a_file_that_none_reads_says_why_and_no_path(compared, tmp_path):
    table = readers(Results(compared("cut.urdf", URDF[:100])))
    assert column(table, "engines") == ["none"]
    (why,) = column(table, "remark")
    assert why.count("does not read it") == 2
    assert str(tmp_path) not in why
    assert column(table, "links") == [None]
    assert table.summary.sentence == ""


def test_mimic_joints_left_free_are_told(compared, tmp_path):
    table = readers(Results(compared("free.urdf", URDF.format(leader="nobody"))))
    (why,) = column(table, "remark")
    assert why.count("with mimic joints left free") == 2
    assert str(tmp_path) not in why
    assert column(table, "freedoms") == [2]


def test_an_engine_with_a_known_cause_is_left_out_of_the_numbers(compared):
    pinocchio, mujoco = compared("arm.urdf", URDF.format(leader="shoulder"))
    pinocchio.measured["cause"] = "something is not read"
    pinocchio.measured["positions"] = 0.25
    table = readers(Results([pinocchio, mujoco]))
    assert column(table, "positions, of the extent")[0] < 1e-14
    assert column(table, "engines") == ["MuJoCo"]
    assert column(table, "remark") == ["Pinocchio differs by 0.250: something is not read"]
    assert table.summary.points[0].endswith("1 of them differently from MuJoCo's documentation")


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("peer", KINEMATICS, ids=lambda peer: peer.title)
def test_the_engine_of_a_peer_puts_effectors_where_we_do(peer, name):
    """Ten rotations in a row round to 1e-15; single precision rounds a metre to 6e-8 each."""
    if not peer.version or not is_installed(name):
        pytest.skip(f"{peer.package} or the robot is not installed")
    if name == CHARACTER and peer is not drake.PEER:
        pytest.skip("takes chains only")
    apart = effector_differences(peer.module, name)
    most = 1e-6 if peer.title in SINGLE_PRECISION else 1e-14
    assert all(0.0 < value < most for value in apart.values())


def test_what_an_engine_does_not_take_is_said_and_what_it_rounds_too(make):
    peer = next((peer for peer in KINEMATICS if peer.version and peer is not drake.PEER), None)
    if peer is None:
        pytest.skip("none of the engines is installed")
    measured = compare_effectors(peer, CHARACTER)
    assert measured["remark"].endswith("takes one chain of hinges only")
    assert measured.keys() == {"remark"}


def test_robots_in_engines_of_peers_stand_beside_files(make):
    peer = make.sample("read_by_a_peer", solver="PyBullet")
    table = readers(Results([peer, make.compared("MuJoCo")]))
    assert column(table, "robot") == ["arm", "the arm"]
    assert table.rows[1][1:] == (
        *("PyBullet 1.2", None, None, 3e-8, 2e-7, None, SINGLE_PRECISION["PyBullet"], None, None),
    )
    assert table.summary.points == (
        "MuJoCo: 1 of 1 file read",
        "PyBullet on the bench’s robots: effectors within 3.0e-8 m and 2.0e-7 in a rotation matrix",
    )
