"""What a difference from an engine is relative to."""

import numpy as np
import pytest

from plumbob.crosscheck.kinematics import full_reach
from plumbob.crosscheck.robots.comparisons import (
    Differences,
    LinkKinematics,
    Sweep,
    differences,
    reference_kinematics,
)
from plumbob.reference import Skeleton
from plumbob.reference.formats import urdf

ARM = """<robot name="arm"><link name="a"/><link name="b"/><link name="c"/>
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
    robot, links = urdf.parse(ARM), np.arange(3)
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


def test_positions_of_a_skeleton_are_over_the_longest_way_from_its_root():
    """Two branches of three and of four metres; the root's own offset does not count."""
    parents, lengths = [-1, 0, 1, 0, 3, 3], [9.0, 1.0, 2.0, 3.0, 1.0, 0.5]
    tree = Skeleton(parents, np.outer(lengths, [0.6, 0.0, 0.8]))
    assert full_reach(tree) == pytest.approx(4.0)
