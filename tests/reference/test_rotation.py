import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference import rotation
from plumbob.reference.quaternion import half_angle

pytestmark = pytest.mark.both_backends

# Products of unit quaternions round to a few eps; 32 allows a dozen operations.
ROUNDING = 32 * np.finfo(float).eps
# A series sums terms below one: a few halves of an eps, where one term too few leaves six.
FEW_ROUNDINGS = 2 * np.finfo(float).eps


@pytest.fixture
def a(rng):
    return rotation.random(rng, 50)


@pytest.fixture
def b(rng):
    return rotation.random(rng, 50)


@pytest.fixture
def v(rng):
    return rng.standard_normal((50, 3))


def assert_close(x, y, tolerance=ROUNDING):
    np.testing.assert_allclose(x, y, rtol=0, atol=tolerance)


def test_a_product_rotates_by_its_right_factor_first(a, b, v):
    one_by_one = rotation.rotate(a, rotation.rotate(b, v))
    assert_close(rotation.rotate(rotation.multiply(a, b), v), one_by_one, 4 * ROUNDING)


def test_matrices_rotate_as_quaternions_do(a, v):
    R = rotation.to_matrix(a)
    assert_close(np.einsum("nij,nj->ni", R, v), rotation.rotate(a, v), 4 * ROUNDING)
    assert_close(np.linalg.det(R), np.ones(50))


def test_a_quaternion_comes_back_from_its_matrix(a):
    back = rotation.from_matrix(rotation.to_matrix(a))
    assert (back[:, 0] >= 0).all()
    assert_close(np.abs(np.vecdot(back, a)), np.ones(50))


@pytest.mark.parametrize("axis", np.eye(3))
def test_rotations_by_pi_come_back_from_their_matrices(axis):
    R = 2 * np.outer(axis, axis) - np.eye(3)
    assert_close(np.abs(rotation.from_matrix(R)[1:]), axis)


@pytest.mark.parametrize("matrix", [-np.eye(3), 2 * np.eye(3), np.ones((3, 3))])
def test_what_is_no_rotation_matrix_is_refused(matrix):
    with pytest.raises(ValueError, match="matrix: expected rotation matrices"):
        rotation.from_matrix(matrix)


def test_between_takes_one_direction_to_the_other_by_the_shortest_arc(v, backend):
    w = v[::-1] * 3.0
    q = rotation.between(v, w)
    u = v / np.linalg.norm(v, axis=-1, keepdims=True)
    assert_close(rotation.rotate(q, u), w / np.linalg.norm(w, axis=-1, keepdims=True))
    assert_close(np.vecdot(q[:, 1:], u), np.zeros(50))
    assert_close(np.linalg.norm(q, axis=-1), np.ones(50))


@pytest.mark.parametrize("direction", [*np.eye(3), [1.0, 2.0, 3.0], [1e-9, 1.0, 0.0]])
def test_between_opposites_is_pi_about_a_fixed_axis(direction, backend):
    direction = np.asarray(direction)
    q = rotation.between(direction, -direction)
    assert_close(q[0], 0.0)
    assert_close(rotation.rotate(q, direction), -direction, 4 * ROUNDING)
    assert (rotation.between(direction, -2 * direction) == q).all()


@pytest.mark.parametrize("angle", [1e-12, 1e-8, 1e-4, 3.0, np.pi - 1e-4, np.pi - 1e-7])
def test_between_is_accurate_near_zero_and_near_opposite(angle, backend):
    end = [np.cos(angle), np.sin(angle), 0.0]
    q = rotation.between([1.0, 0.0, 0.0], end)
    assert q[3] == pytest.approx(np.sin(angle / 2), rel=1e-8)
    assert_close(rotation.rotate(q, [1.0, 0.0, 0.0]), end, 2e-9)


@pytest.mark.parametrize(("short", "long"), [(1e-200, 1.0), (1e-300, 1e74), (1e-308, 1e-308)])
def test_between_needs_directions_of_any_length(short, long, rng, backend):
    a, b = rng.standard_normal((2, 20, 3))
    assert_close(rotation.between(short * a, long * b), rotation.between(a, b), 1e-14)


def test_between_without_a_direction_is_the_identity(backend):
    zero, x = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]
    assert_close(rotation.between([zero, x, zero], [x, zero, zero]), rotation.identity(3))


@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3))
def test_the_logarithm_undoes_the_exponential(v):
    v = np.array(v)
    length = np.linalg.norm(v)
    if length <= np.pi:
        assert_close(rotation.logarithm(rotation.exponential(v)), v, 1e-13)
    else:
        shorter = v * (1.0 - 2 * np.pi / length)
        back = rotation.logarithm(rotation.exponential(v))
        if length < 2 * np.pi:
            assert_close(back, shorter, 1e-13)


# The last two of each lie beside the end of its series.
@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-9, 0.1, 3.1, 6.2, 50.0, 1.5748, 1.5749])
def test_the_exponential_agrees_with_extended_precision(angle, backend):
    with mpmath.workdps(40):
        w, x = float(mpmath.cos(mpmath.mpf(angle) / 2)), float(mpmath.sin(mpmath.mpf(angle) / 2))
    Q = rotation.exponential([angle, 0.0, 0.0])
    np.testing.assert_allclose(Q, [w, x, 0.0, 0.0], rtol=ROUNDING)
    assert_close(Q, [w, x, 0.0, 0.0], FEW_ROUNDINGS)


@pytest.mark.parametrize("angle", [0.0, 1e-300, -1e-9, 0.1, -3.1, 6.2, -50.0, 3.1496, -3.1497])
def test_half_an_angle_agrees_with_extended_precision(angle):
    with mpmath.workdps(40):
        half = mpmath.mpf(angle) / 2
        c, s = float(mpmath.cos(half)), float(mpmath.sin(half))
    assert_close(half_angle(angle), [c, s], FEW_ROUNDINGS)
    assert half_angle(angle)[1] == pytest.approx(s, rel=ROUNDING, abs=0)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-9, 1e-8, 1e-7, 0.1, 3.1, np.pi - 1e-7])
def test_the_logarithm_is_accurate_near_zero_and_near_pi(angle, backend):
    q = [np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0]
    np.testing.assert_allclose(rotation.logarithm(q), [angle, 0.0, 0.0], rtol=ROUNDING)


def test_random_rotations_are_uniform(rng):
    """Moments of the uniform distribution on the 3-sphere, to five of their standard errors."""
    q = rotation.random(rng, 100_000)
    assert_close(np.linalg.norm(q, axis=-1), np.ones(len(q)))
    assert_close(q.mean(axis=0), np.zeros(4), 0.008)
    assert_close(q.T @ q / len(q), np.eye(4) / 4, 0.004)
    assert_close((q**4).mean(axis=0), np.full(4, 1 / 8), 0.003)


def test_the_angle_between_rotations_is_that_of_the_rotation(a):
    Q = rotation.exponential([0.0, 0.7, 0.0])
    assert_close(rotation.angle(a, rotation.multiply(a, Q)), np.full(50, 0.7), 1e-14)
    assert_close(rotation.angle(a, -a), np.zeros(50), 1e-7)


def test_lengths_within_a_millionth_are_normalised_and_others_refused():
    q = rotation.unit("q", [1.0 + 5e-7, 0.0, 0.0, 0.0])
    assert q[0] == 1.0
    with pytest.raises(ValueError, match=r"q: expected unit quaternions .* length 1.000002"):
        rotation.unit("q", [1.0 + 2e-6, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("pitch", [0.3, -1.2, 0.5 * np.pi, -0.5 * np.pi, 0.5 * np.pi - 1e-9])
def test_roll_pitch_and_yaw_turn_about_the_fixed_axes_also_where_pitch_is_a_right_angle(pitch):
    x, y, z = (
        rotation.exponential(a * e) for a, e in zip((0.7, pitch, -2.1), np.eye(3), strict=True)
    )
    R = rotation.to_matrix(rotation.multiply(z, rotation.multiply(y, x)))
    x, y, z = map(rotation.exponential, np.diag(rotation.roll_pitch_yaw(R)))
    back = rotation.to_matrix(rotation.multiply(z, rotation.multiply(y, x)))
    assert np.abs(back - R).max() <= 1e-15 * 8  # a few roundings of entries of at most 1
