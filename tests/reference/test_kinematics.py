import pickle

import numpy as np
import pytest

from plumbob.reference import (
    Pose,
    forward_kinematics,
    kinematics,
    local_from_global,
    prepare,
    rotation,
    set_num_threads,
)
from plumbob.reference.arguments import frozen
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
    masked = np.ma.masked_greater(local, 0.5)
    for wrong, words in ((bad, "length 1.01"), (bad[:-1], "shape"), (bad[None], "shape"),
                         ("x", "numbers"), (masked, "masked")):  # fmt: skip
        with pytest.raises(ValueError, match=f"^local_rotations: expected .*{words}"):
            forward(wrong)
    with pytest.raises(ValueError, match=r"^skeleton: "):
        prepare(local)


FORMS = {
    "list": lambda x: x.tolist(),
    "float32": lambda x: x.astype(np.float32),
    "other byte order": lambda x: x.astype(x.dtype.newbyteorder()),
    "read-only": frozen,
    "strided": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "columns": np.asfortranarray,
    "another process": lambda x: pickle.loads(pickle.dumps(x)),
}


@pytest.mark.parametrize("form", FORMS)
def test_prepared_kinematics_take_arrays_of_any_form(skeleton, articulated, rng, form, backend):
    robot = articulated(["free", "hinge", "slide", "ball", "fixed", "hinge"], 1)
    for model, q in (
        (skeleton, rotation.random(rng, skeleton.joint_count)),
        (robot, robot.random(rng)),
    ):
        forward = prepare(model)
        for values in (FORMS[form](q), q):  # what one call has taken changes no later call
            expected = forward_kinematics(model, np.array(values, float))
            assert all(map(np.array_equal, forward(values), expected))


def test_prepared_kinematics_take_views_of_their_last_pose(skeleton, local, backend):
    forward = prepare(skeleton)
    rotations = forward(local).rotations[::-1]
    expected = forward_kinematics(skeleton, rotations.copy())
    assert all(map(np.array_equal, forward(rotations), expected))


@pytest.fixture(params=["skeleton", "articulation"])
def batch(request, skeleton, articulated, rng):
    """Return a model, coordinates of more poses than lanes, and arrays for their poses."""
    if request.param == "skeleton":
        model, q = skeleton, rotation.random(rng, 3, LANES, skeleton.joint_count)
    else:
        model = articulated(["free", "hinge", "slide", "ball", "fixed", "hinge"], 1)
        q = model.random(rng, 3, LANES)
    shape = 3, LANES, model.joint_count
    return model, q, Pose(np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan))


@pytest.mark.parametrize("threads", [1, 2])
def test_poses_in_arrays_of_the_user_have_the_same_bits(batch, threads, monkeypatch, backend):
    model, q, out = batch
    expected = forward_kinematics(model, q)
    monkeypatch.setattr(kinematics, "THREAD_JOINTS", 1)
    with set_num_threads(threads):
        pose = forward_kinematics(model, q, out=out)
    for values, array, right in zip(pose, out, expected, strict=True):
        assert values is array
        assert array.flags.writeable
        np.testing.assert_array_equal(array, right)
    single = forward_kinematics(model, q[0, 0], out=(out.positions[0, 0], None))
    np.testing.assert_array_equal(single.positions, out.positions[0, 0])
    np.testing.assert_array_equal(single.rotations, expected.rotations[0, 0])


@pytest.mark.parametrize("count", BATCHES)
def test_results_may_take_the_place_of_arguments(skeleton, rng, count, backend):
    """The last tile of a batch would read what an earlier tile wrote."""
    local = rotation.random(rng, count, skeleton.joint_count)
    pose = forward_kinematics(skeleton, local)
    rotations = local.copy()
    forward_kinematics(skeleton, rotations, out=(None, rotations))
    np.testing.assert_array_equal(rotations, pose.rotations)
    expected = local_from_global(skeleton, pose.rotations)
    assert local_from_global(skeleton, rotations, out=rotations) is rotations
    np.testing.assert_array_equal(rotations, expected)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda x, R: x, "out: expected a Pose or a pair"),
        (lambda x, R: (x, R, R), "out: expected a Pose or a pair"),
        (lambda x, R: (x[:-1], R), r"out.positions: .* got a ndarray of float64, \(2, 8, 6, 3\)"),
        (lambda x, R: (x[0], R), r"out.positions: .* got a ndarray of float64, \(8, 6, 3\)"),
        (lambda x, R: (x, R.tolist()), r"out.rotations: .* got \["),
        (lambda x, R: (x, R.astype(np.float32)), "out.rotations: .* of float32"),
        (lambda x, R: (x, frozen(R)), "out.rotations: .* got a read-only"),
        (lambda x, R: (np.asfortranarray(x), R), "out.positions: .* strides"),
        (lambda x, R: (R.reshape(-1)[: x.size].reshape(x.shape), R), "out: .* share memory"),
    ],
)
def test_arrays_that_cannot_be_filled_are_refused(batch, change, words):
    model, q, out = batch
    with pytest.raises(ValueError, match=f"^{words}"):
        forward_kinematics(model, q, out=change(*out))
    assert all(np.isnan(values).all() for values in out)


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
