"""Laws of the certificate of a pose: what it says is proven, and it says why where it is silent."""

import math

import mpmath
import numpy as np
import pytest

from plumbob.reference import (
    Articulation,
    IKCoverage,
    Mimic,
    Skeleton,
    Target,
    certify_ik,
    forward_kinematics,
    rotation,
    scenes,
    solve_ik,
)
from plumbob.reference.inverse_kinematics import certificate, reach
from plumbob.reference.inverse_kinematics.certificate import Equations, path_bounds, path_of
from plumbob.reference.inverse_kinematics.problem import checked_targets
from plumbob.reference.jacobians import integrate

UPPER, LOWER = 0.5, 0.3  # links of the elbow [m]
MIXED = ["free", "hinge", "slide", "ball", "hinge", "fixed", "slide", "hinge"]
HINGES = ["hinge"] * 7


def elbow(low=-math.pi, high=math.pi):
    """A shoulder that turns and nods, and an elbow with limits; closed forms are in its plane."""
    links = Skeleton([-1, 0, 1, 2], [[0, 0, 0.2], [0, 0, 0], [UPPER, 0, 0], [LOWER, 0, 0]])
    kinds, axes = ["hinge", "hinge", "hinge", "fixed"], [[0, 0, 1], *[[0, 1, 0]] * 3]
    return Articulation(
        links, kinds, axes, lower=[-np.inf, -np.inf, low, 0], upper=[np.inf, np.inf, high, 0]
    )


def distance_at(angle):
    """The law of cosines: from shoulder to hand."""
    return math.sqrt(UPPER**2 + LOWER**2 + 2 * UPPER * LOWER * math.cos(angle))


def seven(limit=2.0):
    """An arm of seven hinges with a shoulder and a wrist of three axes each."""
    axes = [[0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1]]
    heights = [0.2, 0.0, 0.3, 0.0, 0.3, 0.0, 0.1]
    offsets = [[0, 0, height] for height in heights]
    return Articulation(
        Skeleton(np.arange(7) - 1, offsets), "hinge", axes, lower=-limit, upper=limit
    )


def crane():
    """A beam that turns and slides out by a kilometre: lengths are those of the slide."""
    links = Skeleton([-1, 0, 1, 2], [[0, 0, 0.1], [0, 0, 0], [0.1, 0, 0], [0, 0.2, 0]])
    kinds, axes = ["hinge", "slide", "hinge", "fixed"], [[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    return Articulation(links, kinds, axes, lower=[-3, 900, -3, 0], upper=[3, 1000, 3, 0])


def wrist():
    """Three axes through the effector, which rotates but does not move."""
    return Articulation(Skeleton([-1, 0, 1], np.zeros((3, 3))), "hinge", np.eye(3))


def finger():
    """A hinge that another follows three times as far, and a slide that follows by 50 m/rad."""
    links = Skeleton([-1, 0, 1, 2], [[0, 0, 0.1], [1, 0, 0], [1, 0, 0], [0, 0, 0]])
    axes = [[0, 0, 1], [0, 0, 1], [1, 0, 0], [0, 0, 1]]
    kinds = ["hinge", "hinge", "slide", "fixed"]
    return Articulation(links, kinds, axes, mimics={1: Mimic(0, 3.0), 2: Mimic(0, -50.0, 0.2)})


def spinner():
    """A hinge about its effector."""
    return Articulation(Skeleton([-1], np.zeros((1, 3))), "hinge", [0.6, 0.0, 0.8])


def target_at(model, q, effector=-1):
    """The pose of an effector as a target."""
    pose = forward_kinematics(model, q)
    return Target(pose.positions[effector], pose.rotations[effector], effector)


def equations(model, q, oriented=True, error=0.0):
    """The equations of a target that is so far from the pose [rad or m]."""
    v = error * np.random.default_rng(5).uniform(-1, 1, model.freedom_count)
    target = target_at(model, integrate(model, q, v))
    if not oriented:
        target = target._replace(rotation=None)
    return Equations(model, checked_targets(model, target, None), q)


class Precise:
    """Forward kinematics in 40 digits, quaternions and axes made unit."""

    @mpmath.workdps(40)
    def __init__(self, model, q):
        self.x, self.R, joints = [], [], model.joints
        for j in joints:
            position, frame = self.wide(j["offset"]), self.unit(j["frame"])
            at, axis = j["coordinate"], self.unit(j["axis"])
            kind = int(j["kind"])
            if kind in (1, 2):
                value = mpmath.mpf(float(j["multiplier"])) * float(q[at]) + float(j["shift"])
            if kind == 2:
                position = position + self.rotate(frame, axis * value)
            if kind == 4:
                position = position + self.rotate(frame, self.wide(q[at : at + 3]))
            if kind == 1:
                half = [mpmath.cos(value / 2), *(axis * mpmath.sin(value / 2))]
                frame = self.multiply(frame, np.array(half))
            if kind in (3, 4):
                begin = at + (3 if kind == 4 else 0)
                frame = self.multiply(frame, self.unit(q[begin : begin + 4]))
            if j["parent"] >= 0:
                above = self.R[j["parent"]]
                position = self.x[j["parent"]] + self.rotate(above, position)
                frame = self.multiply(above, frame)
            self.x.append(position)
            self.R.append(frame)

    @staticmethod
    def wide(values):
        return np.array([mpmath.mpf(float(value)) for value in values])

    def unit(self, values):
        values = self.wide(values)
        return values / mpmath.sqrt(np.sum(values * values))

    @staticmethod
    def multiply(a, b):
        v = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
        return np.array([a[0] * b[0] - a[1:] @ b[1:], *v])

    def rotate(self, Q, v):
        return self.multiply(self.multiply(Q, np.array([0, *v])), Q * [1, -1, -1, -1])[1:]


class TestRounding:
    @pytest.mark.parametrize(
        "kinds", [HINGES, MIXED, crane, finger], ids=["hinges", "mixed", "crane", "finger"]
    )
    def test_forward_kinematics_in_40_digits_is_within_the_bound(self, articulated, kinds):
        worst = 0.0
        for seed in range(3):
            model = kinds() if callable(kinds) else articulated(kinds, seed)
            q = model.checked("q", model.random(np.random.default_rng(seed)))
            x, R = model.forward(q)
            precise = Precise(model, q)
            for j in range(model.joint_count):
                bounds = path_bounds(model, path_of(model, j), q)
                error = float(mpmath.norm(precise.x[j] - x[j]))
                sign = -1 if precise.R[j] @ R[j] < 0 else 1
                error_rotation = float(mpmath.norm(sign * precise.R[j] - R[j]))
                assert error <= bounds.position
                assert error_rotation <= bounds.rotation
                worst = max(worst, error / bounds.position, error_rotation / bounds.rotation)
        assert worst > 1e-3  # the bound is not too large to say anything

    def test_of_an_arm_it_is_nine_orders_below_a_tolerance(self):
        model = seven()
        q = model.random(np.random.default_rng(0))
        result = certify_ik(model, q, target_at(model, q))
        assert 0 < result.rounding < 2e-13
        assert result.rounding <= result.residual < 2 * result.rounding
        quaternion = 7 * 48 * 2.0**-53  # of seven joints
        assert 2 * quaternion <= result.residual_rotation < 2.2 * quaternion


class TestLipschitz:
    def test_a_rotation_by_half_a_turn_has_the_second_derivative_one_half(self):
        """Twice the sine of half an angle: minus half of that sine."""
        system = equations(spinner(), np.zeros(1), error=1.0)
        assert system.lipschitz(np.ones(1, dtype=bool)) == pytest.approx(0.5)

    @pytest.mark.parametrize(
        "kinds", [HINGES, MIXED, ["ball"] * 4, crane, wrist, finger],
        ids=["hinges", "mixed", "balls", "crane", "wrist", "finger"],
    )  # fmt: skip
    @pytest.mark.parametrize("oriented", [False, True])
    def test_second_differences_are_below_it(self, articulated, kinds, oriented):
        """|F(p + t v) - 2 F(p) + F(p - t v)| / t² is the second derivative along v."""
        ratios, t = [], 1e-3
        for seed in range(6):
            model = kinds() if callable(kinds) else articulated(kinds, seed)
            rng = np.random.default_rng(seed)
            p = model.random(rng)
            system = equations(model, p, oriented, error=0.5)
            L = system.lipschitz(np.ones(model.freedom_count, dtype=bool))
            if kinds is wrist and not oriented:
                assert L == 0.0
                continue
            for _ in range(10):
                v = rng.standard_normal(model.freedom_count)
                v /= np.linalg.norm(v)
                points = [integrate(model, p, s * t * v) for s in (-1.0, 0.0, 1.0)]
                before, here, after = (system.evaluate(q)[0] for q in points)
                ratios.append(np.linalg.norm(after - 2 * here + before) / t**2 / L)
        assert not ratios or 0.05 < max(ratios) <= 1.0


class TestExactSolution:
    @pytest.mark.parametrize("bend", [0.3, -1.2, 2.5])
    @pytest.mark.parametrize("error", [0.0, 1e-9, 1e-3])
    def test_the_distance_is_that_of_the_closed_form(self, bend, error):
        """Three joints reach a point in four ways; the exact solution is the nearest."""
        model, q = elbow(), np.array([0.4, -0.7, bend])
        target = forward_kinematics(model, q).positions[-1]
        moved = q + error * np.array([0.6, 0.0, -0.8])
        result = certify_ik(model, moved, target)
        assert result.covered
        # The target itself is rounded: a joint moves by some 1e-15.
        assert error - 1e-14 <= result.distance <= error * (1 + 1e-6) + 1e-10
        assert result.reached == (error < 1e-4)

    @pytest.mark.parametrize("bend", [2e-6, 2.5e-6, 3.2e-6, 4e-6, 5e-6, 8e-6])
    def test_a_solution_is_proven_just_where_the_condition_of_kantorovich_holds(self, bend):
        """2 L |B|² |F| < 1 for a nearly straight arm, of whose F only the rounding is left."""
        model, q = elbow(), np.array([0.4, -0.7, bend])
        target = forward_kinematics(model, q).positions[-1]
        result = certify_ik(model, q, target)
        system = Equations(model, checked_targets(model, target, None), q)
        F, J = system.evaluate(q)
        size, inverse = np.linalg.norm(F) + system.rounding()[0], np.linalg.norm(np.linalg.pinv(J))
        L = system.lipschitz(np.array([True, True, True]))
        share = 2.0 * L * inverse**2 * size
        assert 0.1 < share < 5.0
        assert result.covered == (share < 1.0)
        if result.covered:
            radius = 2.0 * size / (1.0 + math.sqrt(1.0 - share))
            assert result.distance == pytest.approx(inverse * radius, rel=1e-2)
        else:
            assert result.coverage == IKCoverage.SINGULAR

    @pytest.mark.parametrize(("way", "is_covered"), [(0.99, True), (1.01, False)])
    def test_bounds_of_slides_hold_within_their_extent_and_prove_nothing_beyond(
        self, way, is_covered
    ):
        """Hinges have no extent: lengths of their arms are the same wherever they are."""
        gantry = Articulation(Skeleton([-1, 0, 1], np.zeros((3, 3))), "slide", np.eye(3))
        result = certify_ik(gantry, [0.1, 0.2, 0.3], [0.1, 0.2, 0.3 + way])
        assert result.covered is is_covered
        assert is_covered or result.coverage == IKCoverage.TOO_FAR
        target = forward_kinematics(elbow(), [0.4, -0.7, 1.2]).positions[-1]
        turned = certify_ik(elbow(), [0.4 + way, -0.7, 1.2], target)
        assert turned.covered
        assert turned.distance == pytest.approx(way)

    def test_redundant_arms_and_chains_of_balls_are_covered(self, rng):
        model = seven()
        q = model.random(rng)
        assert certify_ik(model, q + 1e-4 * rng.uniform(-1, 1, 7), target_at(model, q)).covered
        chain, _ = scenes.ball_chain(links=5)
        local = rotation.random(rng, chain.joint_count)
        x = forward_kinematics(chain, local).positions[-1]
        bent = rotation.multiply(local, rotation.exponential(1e-3 * rng.uniform(-1, 1, (6, 3))))
        result = certify_ik(chain, bent, x)
        assert result.covered
        assert 0 < result.distance < 1e-2

    def test_several_effectors_are_covered_together(self, rng):
        """A spine with two arms of two links."""
        tree = Skeleton([-1, 0, 1, 2, 1, 4], rng.uniform(0.2, 0.5, (6, 3)))
        local = rotation.random(rng, 6)
        x = forward_kinematics(tree, local).positions
        targets = [Target(x[effector], effector=effector) for effector in (3, 5)]
        assert certify_ik(tree, local, targets).covered
        beyond = [targets[0], targets[1]._replace(position=x[5] + 5.0)]
        assert certify_ik(tree, local, beyond).impossible


class TestLimits:
    def test_a_joint_at_its_limit_stays_there(self):
        model = seven(limit=1.0)
        q = np.array([0.3, 0.5, 1.0, 0.7, -0.2, 0.6, 0.1])
        result = certify_ik(model, q, target_at(model, q))
        assert result.covered
        assert result.distance < 1e-9

    def test_a_solution_beyond_a_limit_is_not_claimed(self):
        """The elbow would have to bend a little further than it can."""
        free, limited = elbow(), elbow(0.0, 1.0)
        target = forward_kinematics(free, [0.2, 0.3, 1.001]).positions[-1]
        result = certify_ik(limited, [0.2, 0.3, 1.0], target, tolerance=1e-3)
        assert result.reached
        assert not result.covered

    def test_a_pose_beyond_its_limits_has_not_reached(self):
        target = forward_kinematics(elbow(), [0.2, 0.3, 1.01]).positions[-1]
        assert certify_ik(elbow(), [0.2, 0.3, 1.01], target).reached
        assert not certify_ik(elbow(0.0, 1.0), [0.2, 0.3, 1.01], target).reached


class TestImpossible:
    @pytest.mark.parametrize("r", [0.05, 0.15, 0.3, 0.79, 0.85, 2.0])
    @pytest.mark.parametrize("limits", [(-math.pi, math.pi), (0.5, 2.0)])
    def test_the_least_distance_is_that_of_the_closed_form(self, r, limits):
        """Between the distances at the elbow's limits, or with a straight and a folded arm."""
        model = elbow(*limits)
        ends = [distance_at(max(limits[0], 0.0)), distance_at(limits[1])]
        exact = max(0.0, r - ends[0], ends[1] - r)
        position = np.array([0.0, 0.0, 0.2]) + r * np.array([0.6, 0.48, 0.64])
        result = certify_ik(model, [0.1, 0.2, 0.9], position)
        assert result.least_distance <= exact
        # A shell is within 1e-3 of the arm's length.
        assert result.least_distance >= exact - 1e-3 * (UPPER + LOWER)
        assert result.impossible == (result.least_distance > 0.0)
        assert result.covered == (exact == 0.0)
        assert result.lever == 0.0

    @pytest.mark.parametrize(("d", "exact"), [(2.5, 0.5), (0.1, 0.3), (1.0, 0.0)])
    def test_chains_of_balls_have_the_exact_distance(self, rng, d, exact):
        """max(0, d - reach, 2 longest - reach - d)."""
        chain = Skeleton([-1, 0, 1, 2], [[0, 0, 0], [1.2, 0, 0], [0, 0.5, 0], [0.3, 0, 0]])
        local = rotation.random(rng, 4)
        result = certify_ik(chain, local, [0.0, 0.6 * d, 0.8 * d])
        assert result.least_distance == pytest.approx(exact, abs=1e-11)
        assert result.least_distance <= exact

    def test_a_pose_may_be_out_of_reach_where_its_position_is_not(self):
        """The wrist would be 0.1 m further away than the straight arm's 0.6 m."""
        model = seven()
        target = Target([0.6, 0.0, 0.2], rotation.exponential([0.0, -np.pi / 2, 0.0]))
        result = certify_ik(model, model.neutral(), target)
        assert result.impossible
        assert result.lever == pytest.approx(0.1)
        assert 0.09 < result.least_distance <= 0.1
        assert certify_ik(model, model.neutral(), [0.6, 0.0, 0.2]).least_distance == 0.0

    @pytest.mark.parametrize("kinds", [HINGES[:6], MIXED, ["ball", "hinge", "ball", "hinge"]])
    def test_a_pose_that_exists_is_never_impossible(self, articulated, kinds):
        for seed in range(5):
            model = articulated(kinds, seed)
            q = model.random(np.random.default_rng(seed))
            target = target_at(model, q)
            other = model.random(np.random.default_rng(seed + 99))
            assert not certify_ik(model, other, target).impossible
            bound, _ = reach.least_distance(model, model.joint_count - 1, *target[:2])
            assert bound == 0.0

    @pytest.mark.parametrize("count", [5, pytest.param(400, marks=pytest.mark.slow)])
    def test_no_solver_refutes_it(self, count):
        """Distance + lever times angle of the nearest pose of a hundred restarts is no less."""
        model, rng, proven = seven(), np.random.default_rng(7), 0
        for _ in range(count):
            v = rng.standard_normal(3)
            position = rng.uniform(0.4, 0.8) * v / np.linalg.norm(v) + [0, 0, 0.2]
            target = Target(position, rotation.random(rng))
            solution = solve_ik(model, model.neutral(), target, restarts=100)
            result = certify_ik(model, solution.coordinates, target)
            nearest = solution.residual + result.lever * solution.residual_rotation
            assert result.least_distance <= nearest
            assert result.covered <= solution.outcome.solved
            proven += result.impossible
        assert proven > 0.2 * count


class TestReasons:
    """Each reason for no proof has its case."""

    def test_too_few_freedoms(self):
        model = elbow()
        result = certify_ik(model, [0.1, 0.2, 0.5], target_at(model, [0.1, 0.2, 0.5]))
        assert result.coverage == IKCoverage.TOO_FEW_FREEDOMS
        assert result.reached

    def test_a_straight_arm_is_singular(self):
        model = elbow()
        target = forward_kinematics(model, [0.1, 0.2, 0.0]).positions[-1]
        result = certify_ik(model, [0.1, 0.2, 0.0], target)
        assert result.coverage == IKCoverage.SINGULAR

    def test_a_limit_within_the_distance(self, monkeypatch):
        monkeypatch.setattr(certificate, "MARGIN", 0.0)
        model = elbow(0.0, 1.0)
        q = [0.2, 0.3, 1.0 - 1e-16]
        target = forward_kinematics(model, q).positions[-1]
        assert certify_ik(model, q, target).coverage == IKCoverage.AT_LIMIT

    def test_every_reason_has_a_sentence(self):
        sentences = {reason.sentence for reason in IKCoverage}
        assert len(sentences) == len(IKCoverage)
        assert sum(sentence.startswith("Open") for sentence in sentences) == 4
