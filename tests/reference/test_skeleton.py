import numpy as np
import pytest

from plumbob.reference import Skeleton

FORK = {"parents": [-1, 0, 1, 1, 0], "offsets": np.arange(15.0).reshape(5, 3)}


@pytest.mark.parametrize(
    ("parents", "offsets", "names", "message"),
    [
        ([], np.zeros((0, 3)), None, "offsets: expected at least one joint"),
        ([0, 0], np.zeros((2, 3)), None, r"parents: expected one root \(parent -1\), got 0"),
        ([-1, -1], np.zeros((2, 3)), None, r"parents: expected one root \(parent -1\), got 2"),
        ([-1, 5], np.zeros((2, 3)), None, "parents: expected indices from -1 to 1, got 5"),
        ([-1, 2, 0], np.zeros((3, 3)), None, "parent before its child, got parent 2 for joint 1"),
        ([-1, 1], np.zeros((2, 3)), None, "parent before its child, got parent 1 for joint 1"),
        ([-1, 0], np.zeros((2, 3)), ["a"], "names: expected 2 names, one a joint, got 1"),
        ([-1, 0], np.zeros((2, 3)), ["a", "a"], "names: expected distinct names, got 'a'"),
        ([-1, 0], np.zeros((2, 3)), ["a", ""], "names: expected 2 non-empty strings"),
        ([-1, 0], np.zeros((2, 3)), "ab", "names: expected 2 names, one a joint, got 'ab'"),
    ],
)
def test_what_is_no_tree_is_refused_and_named(parents, offsets, names, message):
    with pytest.raises(ValueError, match=message):
        Skeleton(parents, offsets, names)


def test_the_path_runs_from_the_root_to_the_effector():
    skeleton = Skeleton(**FORK)
    assert skeleton.path(3).tolist() == [0, 1, 3]
    assert skeleton.path("joint4").tolist() == [0, 4]
    assert skeleton.path(0).tolist() == [0]
    assert skeleton.path().tolist() == [0, 4]


def test_joints_answer_to_the_names_they_are_given():
    skeleton = Skeleton(**FORK, names=["root", "spine", "left", "right", "tail"])
    assert skeleton.names == ("root", "spine", "left", "right", "tail")
    assert [skeleton.index(name) for name in skeleton.names] == [0, 1, 2, 3, 4]
    assert skeleton.path("right").tolist() == [0, 1, 3]


def test_the_reach_is_the_links_total_length():
    skeleton = Skeleton([-1, 0, 1], [[5, 5, 5], [0, 3, 4], [1, 0, 0]])
    assert skeleton.reach() == 6.0
    assert skeleton.reach(0) == 0.0
    assert skeleton.link_lengths.tolist() == [0.0, 5.0, 1.0]


@pytest.mark.parametrize("length", [1e-76, 1e-155, 1e-160])
def test_a_link_whose_length_cannot_be_divided_by_is_refused(length):
    with pytest.raises(
        ValueError, match=r"offsets: expected 0 or at least 1e-75, got .* at index 2"
    ):
        Skeleton([-1, 0, 1], [[length, 0, 0], [0, 1, 0], [0, 0, length]])
    assert Skeleton([-1, 0], [[length, 0, 0], [0, 0, 1]]).reach() == 1.0
