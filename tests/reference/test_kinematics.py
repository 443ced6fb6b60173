import numpy as np
import pytest

from plumbob.reference import (
    forward_kinematics,
    kinematics,
    local_from_global,
    prepare,
    rotation,
    set_num_threads,
)
from plumbob.reference.backend import compiled
from plumbob.reference.backend.simd.vectors import LANES

pytestmark = pytest.mark.both_backends

# Six joints: a dozen products and sums of numbers of order one.
ROUNDING = 1e-14


# Fewer poses than lanes, as many, one more; a last tile that overlaps; several tiles.
BATCHES = [1, LANES - 1, LANES, LANES + 1, 3 * LANES - 2]


@pytest.mark.parametrize("count", BATCHES)
def test_a_pose_has_the_same_bits_in_every_batch_and_at_both_speeds(skeleton, rng, count, backend):
    local = rotation.random(rng, count, skeleton.joint_count) * (1.0 + 5e-7)
    batch = forward_kinematics(skeleton, local)
    back = local_from_global(skeleton, batch.rotations)
    with compiled.set_backend("python"):
        poses = [forward_kinematics(skeleton, q) for q in local]
        locals_ = [local_from_global(skeleton, pose.rotations) for pose in poses]
    assert (batch.positions == [pose.positions for pose in poses]).all()
    assert (batch.rotations == [pose.rotations for pose in poses]).all()
    assert (back == locals_).all()


@pytest.mark.parametrize("count", [2, 3])
def test_a_pose_has_the_same_bits_on_any_number_of_cores(skeleton, rng, count, monkeypatch):
    local = rotation.random(rng, 50, skeleton.joint_count)
    with set_num_threads(1):
        one = forward_kinematics(skeleton, local)
        back = local_from_global(skeleton, one.rotations)
    monkeypatch.setattr(kinematics, "THREAD_JOINTS", 1)
    with set_num_threads(count):
        several = forward_kinematics(skeleton, local)
        assert (several.positions == one.positions).all()
        assert (several.rotations == one.rotations).all()
        assert (local_from_global(skeleton, one.rotations) == back).all()


@pytest.mark.parametrize("convert", [forward_kinematics, local_from_global])
@pytest.mark.parametrize("value", [np.nan, 1.5])
@pytest.mark.parametrize(
    ("count", "pose"),
    [(LANES - 1, 0), *((2 * LANES + 3, pose) for pose in (0, LANES - 1, LANES, 2 * LANES + 2))],
)
def test_one_bad_quaternion_in_a_batch_is_found(
    convert, value, count, pose, skeleton, rng, monkeypatch, backend
):
    monkeypatch.setattr(kinematics, "THREAD_JOINTS", LANES * skeleton.joint_count)
    rotations = rotation.random(rng, count, skeleton.joint_count)
    rotations[pose, 3, 2] = value
    with (
        set_num_threads(2),
        pytest.raises(ValueError, match=rf"rotations: .* at index \({pose}, 3"),
    ):
        convert(skeleton, rotations)


@pytest.mark.parametrize("excess", [1e-6 - 1e-13, -1e-6 + 1e-13])
def test_lengths_on_the_edge_of_the_tolerance_are_normalised_too(skeleton, local, excess, backend):
    exact = forward_kinematics(skeleton, local)
    edge = forward_kinematics(skeleton, local * (1.0 + excess))
    np.testing.assert_allclose(edge.positions, exact.positions, rtol=0, atol=ROUNDING)
    back = local_from_global(skeleton, exact.rotations * (1.0 + excess))
    np.testing.assert_allclose(back, local, rtol=0, atol=ROUNDING)


def test_prepared_kinematics_fill_the_same_arrays_with_the_same_bits(skeleton, rng, backend):
    forward = prepare(skeleton)
    assert np.isnan(forward.pose.positions).all()
    for local in (
        *rotation.random(rng, 2, skeleton.joint_count),
        [[1.0, 0, 0, 0]] * skeleton.joint_count,
    ):
        pose, other = forward(local), forward_kinematics(skeleton, local)
        assert pose is forward.pose
        assert all(map(np.array_equal, pose, other))
        assert not any(values.flags.writeable for values in pose)
    bad = np.array(local, float)
    bad[-1] *= 1.01
    for wrong, words in ((bad, "length 1.01"), (bad[:-1], "shape"), ("x", "numbers")):
        with pytest.raises(ValueError, match=f"^local_rotations: expected .*{words}"):
            forward(wrong)
    with pytest.raises(ValueError, match=r"^skeleton: "):
        prepare(local)


def test_prepared_kinematics_of_an_articulation_have_the_same_bits(articulated, rng, backend):
    model = articulated(["free", "hinge", "slide", "ball", "fixed", "hinge"], 1)
    forward, rows = prepare(model), model.random(rng, 3)
    batch = forward_kinematics(model, rows)
    for i, q in enumerate(rows):
        pose = forward(q)
        for values, row, single in zip(pose, batch, forward_kinematics(model, q), strict=True):
            np.testing.assert_array_equal(values, row[i])
            np.testing.assert_array_equal(values, single)
            assert not values.flags.writeable
    infinite = np.full_like(rows[0], np.inf)
    for wrong, words in ((rows[0] * 1.01, "length 1.01"), (rows, "shape"), (infinite, "inf")):
        with pytest.raises(ValueError, match=f"^q: expected .*{words}"):
            forward(wrong)
