"""How far the end of a step is from balance, all forces by MuJoCo."""

import numpy as np

from plumbob.crosscheck import samples
from plumbob.crosscheck.mass_spring.steps import balance_residual
from plumbob.crosscheck.tolerances import TOLERANCES
from plumbob.reference.implicit_euler import ImplicitEuler


def test_moved_pins_are_where_the_step_took_them():
    system, state, external, h = samples.network(0, damped=False)
    pins_at = state.positions[system.pinned] + 0.1
    settings = {"h": h, "tolerance": 1e-14}
    x = ImplicitEuler(system, **settings).step(state, external, pins_at).state.positions
    assert balance_residual(system, state, x, h, external) < TOLERANCES["balance"].value
    x = ImplicitEuler(system, **settings).step(state, external).state.positions
    x = np.where(system.free[:, None], x, x + 0.1)
    assert balance_residual(system, state, x, h, external) > 1e-6
