import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from plumbob.reference import curves, resample

pytestmark = pytest.mark.both_backends

# Dividing a gap rounds: each spacing is met but for a few eps of the coordinates.
ROUNDING = 1e-12


def gaps(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=-1)


# ---- the named curves


@pytest.mark.parametrize("name", curves)
@pytest.mark.parametrize("count", [1, 2, 5, 151])
def test_a_curve_has_as_many_points_as_asked_for_in_its_plane(name, count):
    points = curves[name](count)
    assert points.shape == (count, 3)
    assert (points[:, 1] == 0.0).all()


def test_the_lab_s_curves_are_sampled_as_the_lab_does():
    counts = {name: len(curve()) for name, curve in curves.items()}
    lab = {"circle": 150, "square": 150, "heart": 150, "triangle": 150, "star": 400}
    assert counts | lab == counts
    assert counts["plumb_bob"] >= 1000


def test_the_circle_is_round():
    np.testing.assert_allclose(np.linalg.norm(curves["circle"](), axis=-1), 0.6, rtol=1e-15)


@pytest.mark.parametrize("name", ["circle", "square", "heart", "triangle", "star"])
def test_a_closed_curve_runs_once_from_x_towards_z_and_does_not_repeat_its_first_point(name):
    points = curves[name]()
    x, _, z = points.T
    assert (x * np.roll(z, -1) - z * np.roll(x, -1)).sum() > 0
    closing = np.linalg.norm(points[0] - points[-1])
    assert 0.5 * gaps(points).min() < closing < 1.01 * gaps(points).max()


def test_the_heart_is_the_cardioid():
    x, _, z = curves["heart"]().T
    t = np.arctan2(z, x)
    np.testing.assert_allclose(np.hypot(x, z), 0.5 * (1 - np.sin(t)), atol=1e-8)


def test_the_triangle_starts_at_its_corner_at_the_origin():
    points = curves["triangle"](150)
    assert (points[0] == 0.0).all()
    x, _, z = points.T
    on_a_side = np.minimum(np.minimum(np.abs(x), np.abs(z)), np.abs(x + z - 0.5))
    np.testing.assert_allclose(on_a_side, 0.0, atol=1e-15)


def test_the_star_visits_every_second_of_five_points():
    corners = curves["star"](5)
    angles = np.unwrap(np.arctan2(corners[:, 2], corners[:, 0]))
    np.testing.assert_allclose(np.diff(angles), 4 * np.pi / 5)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=-1), 0.4)


# ---- resampling


clouds = arrays.arrays(
    float, st.tuples(st.integers(1, 12), st.just(3)), elements=st.floats(-2.0, 2.0, width=32)
)
spacings = st.floats(0.05, 1.0)
factors = st.floats(2.0, 4.0)


def can_be_spaced(points, minimum):
    """Return whether the ends, or the ends and one more point, are far enough apart."""
    first = np.linalg.norm(points - points[0], axis=-1)
    last = np.linalg.norm(points - points[-1], axis=-1)
    return first[-1] >= minimum or (np.minimum(first, last) >= minimum).any()


@given(points=clouds, minimum=spacings, factor=factors)
def test_every_gap_lies_within_the_two_spacings_and_the_ends_are_kept(points, minimum, factor):
    assume(can_be_spaced(points, minimum))
    even = resample(points, min_spacing=minimum, max_spacing=factor * minimum)
    assert gaps(even).min() >= minimum - ROUNDING
    assert gaps(even).max() <= factor * minimum + ROUNDING
    assert (even[0] == points[0]).all()
    assert (even[-1] == points[-1]).all()


@given(points=clouds, minimum=spacings)
def test_a_curve_shorter_than_the_least_spacing_keeps_its_ends(points, minimum):
    points = points * (0.2 * minimum / max(1.0, np.abs(points).max()))
    even = resample(points, min_spacing=minimum, max_spacing=2 * minimum)
    assert (even == points[[0, -1]][: len(points)]).all()


@given(points=clouds, minimum=spacings)
def test_a_closed_curve_is_spaced_across_its_wrap_too(points, minimum):
    assume(can_be_spaced(np.concatenate([points, points[:1]]), minimum))
    even = resample(points, min_spacing=minimum, max_spacing=2 * minimum, closed=True)
    around = gaps(np.concatenate([even, even[:1]]))
    assert around.min() >= minimum - ROUNDING
    assert around.max() <= 2 * minimum + ROUNDING


def test_points_are_dropped_until_the_end_is_far_enough(backend):
    """The curve comes back to its end: the last two points kept lie within 1 of it."""
    points = np.array([[0.0, 0, 0], [1.5, 0, 0], [2.2, 0.8, 0], [2.2, -0.3, 0], [2.0, 0.2, 0]])
    even = resample(points, min_spacing=1.0, max_spacing=3.0)
    assert even.tolist() == points[[0, -1]].tolist()


def test_where_the_ends_meet_a_point_far_from_both_is_found(backend):
    points = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.99, 0, 0], [0.95, 0, 0]])
    even = resample(points, min_spacing=1.0, max_spacing=2.0)
    assert even.tolist() == points[[0, 2, 3]].tolist()


def test_resampled_points_lie_on_the_curve(backend):
    even = resample([[0, 0, 0], [1, 0, 0], [1, 2, 0]], min_spacing=0.1, max_spacing=0.3)
    x, y, _ = even.T
    assert (((y == 0) & (x <= 1)) | ((x == 1) & (y <= 2))).all()
    assert len(even) == 12
