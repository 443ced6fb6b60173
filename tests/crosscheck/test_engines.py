"""Each convention that an adapter translates, on an example where the wrong one shows."""

import numpy as np
import pytest

from plumbob.crosscheck import samples
from plumbob.crosscheck.engines import (
    SKELETON_ENGINES,
    MujocoFlex,
    MujocoMassSpring,
)
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.crosscheck.tolerances import TOLERANCES
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import MassSpring, State
from plumbob.reference.scenes import lab_cloth

# Second differences of a step of 1e-6 m leave 1e-12; rounding over the step leaves 1e-10.
DIFFERENCE_STEP = 1e-6
DIFFERENCE_TOLERANCE = 1e-8


@pytest.fixture(params=SKELETON_ENGINES)
def engine_of(request):
    return SKELETON_ENGINES[request.param]


def test_jacobian_is_the_derivative_of_the_position(engine_of):
    skeleton = samples.skeleton(5)
    engine = engine_of(skeleton)
    q = coordinates(engine, samples.local_rotations(5, skeleton))
    joint = skeleton.joint_count - 1

    def position(v):
        engine.update_kinematics(engine.integrate(q, v))
        return engine.position(joint)

    steps = DIFFERENCE_STEP * np.eye(3 * skeleton.joint_count)
    J = np.transpose([position(v) - position(-v) for v in steps]) / (2 * DIFFERENCE_STEP)
    assert np.abs(J).max() > 0.1
    assert np.allclose(engine.jacobian(q, joint), J, atol=DIFFERENCE_TOLERANCE)
    jacobian_left = engine.pose()
    engine.update_kinematics(q)
    assert np.array_equal(jacobian_left.positions, engine.pose().positions)


def test_pins_hold_and_move_with_the_state():
    system, state, external, h = samples.network(4)
    engine = MujocoMassSpring(system, h=h)
    displaced = State(state.positions + 1.0, state.velocities)
    for start in (state, displaced):
        end = engine.step(start, external)
        assert np.array_equal(end.positions[system.pinned], start.positions[system.pinned])
    engine.update_forces(state)
    at_home = engine.spring_forces()
    engine.update_forces(displaced)
    assert np.allclose(at_home, engine.spring_forces(), rtol=1e-9)


def test_motion_that_blows_up_is_not_started_afresh(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log of its warnings where it stands
    system = MassSpring([1.0, 1.0], [[0, 1]], 0.5, 1e12)
    engine = MujocoMassSpring(system, h=1.0)
    state = State([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], np.zeros((2, 3)))

    def swing(steps, state):
        for _ in range(steps):
            state = engine.step(state)

    with pytest.raises(ValueError, match=r"positions|velocities"):
        swing(40, state)


def test_discrete_solves_a_stiff_cloth_to_the_end(rng):
    """With MuJoCo's own limit of 100 iterations this step is 3e-6 off."""
    system, rest = lab_cloth(size=20, stiffness=1e5)
    state = State(
        rest.positions + 0.01 * rng.standard_normal(rest.positions.shape), rest.velocities
    )
    theirs = MujocoMassSpring(system, h=1 / 60, integrator="discrete").step(state).velocities
    ours = ImplicitEuler(system, h=1 / 60, solver="gauss_newton").step(state).state.velocities
    assert np.abs(ours - theirs).max() < TOLERANCES["step"].value * np.abs(theirs).max()


def test_flex_stores_no_energy_between_two_pins():
    system = MassSpring(np.ones(3), [[0, 1], [1, 2]], 1.0, 100.0, pinned=[0, 1], gravity=[0, 0, 0])
    flex, tendons = MujocoFlex(system), MujocoMassSpring(system)
    state = State([[0, 0, 0], [3, 0, 0], [3, 2, 0]], np.zeros((3, 3)))
    for engine in (flex, tendons):
        engine.update_forces(state)
    assert tendons.potential_energy() == pytest.approx(50 * 2**2 + 50 * 1**2)
    assert flex.potential_energy() == pytest.approx(50 * 1**2)
