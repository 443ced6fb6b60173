"""How far the end of a step is from balance, all forces by MuJoCo."""

import numpy as np

from plumbob.crosscheck import samples
from plumbob.crosscheck.mass_spring.steps import balance_residual
from plumbob.crosscheck.tolerances import TOLERANCES
from plumbob.reference.implicit_euler import ImplicitEuler


def stepped(case, damped, **settings):
    """A motion, and the end of a step of it."""
    motion = samples.network(case, damped=damped)
    integrator = ImplicitEuler(motion.system, h=motion.h, **settings)
    x = integrator.step(motion.state, motion.external_forces).state.positions
    assert np.abs(x - motion.state.positions).max() > 1e-3
    return motion, x


def residual(motion, x, external="its own"):
    given = motion.external_forces if external == "its own" else external
    return balance_residual(motion.system, motion.state, x, motion.h, given)


def test_external_forces_and_gauss_newtons_linearisation_are_seen():
    motion, x = stepped(0, damped=True, tolerance=1e-14)
    assert residual(motion, x, external=None) > 1e-6
    assert residual(*stepped(0, damped=True, solver="gauss_newton")) > 1e-6


def test_moved_pins_are_where_the_step_took_them():
    system, state, external, h = samples.network(0, damped=False)
    pins_at = state.positions[system.pinned] + 0.1
    settings = {"h": h, "tolerance": 1e-14}
    x = ImplicitEuler(system, **settings).step(state, external, pins_at).state.positions
    assert balance_residual(system, state, x, h, external) < TOLERANCES["balance"].value
    x = ImplicitEuler(system, **settings).step(state, external).state.positions
    x = np.where(system.free[:, None], x, x + 0.1)
    assert balance_residual(system, state, x, h, external) > 1e-6
