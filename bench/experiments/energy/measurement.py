"""The energy of a swinging cloth by integrator, over ten thousand steps."""

import functools
from collections.abc import Callable, Iterator
from functools import partial

from plumbob.crosscheck.mass_spring.equilibria import equilibrium
from plumbob.crosscheck.mass_spring.integrators import (
    SIMULATORS,
    Simulation,
    energy_series,
    implicit,
    mechanical_energy,
)
from plumbob.reference import MassSpring, State, scenes, symplectic_euler

from ...harness.block import Block, Measured, Scale
from . import DAMPINGS, SIZE

H, STEPS, EVERY = 1 / 60, 10_000, 10
# Steps after which the cloth hangs well below its start, near its rest.
FALLING = 120
TOLERANCE = 1e-10
# The faster of two integrators in agreement step by step. Local/global converges in a dozen
# iterations at this stiffness, each a hundredth of the cost of a Newton iteration.
INTEGRATORS: dict[str, Callable[[MassSpring, float], Simulation]] = {
    "symplectic Euler": SIMULATORS["symplectic Euler"],
    "implicit Euler": partial(implicit, "local_global", tolerance=TOLERANCE),
    **{
        name: SIMULATORS[f"MuJoCo {name}"]
        for name in ("implicit", "implicitfast", "discrete", "RK4")
    },
}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every integrator, undamped and damped; the cloth is the same at every scale."""
    settings = {"h": H, "steps": STEPS, "every": EVERY, "tolerance": TOLERANCE}
    for name, damping in DAMPINGS.items():
        facts = {"title": name, "damping": damping}
        for integrator in INTEGRATORS:
            measure = partial(swing, name, integrator)
            yield Block("energy", f"swing/{name}", integrator, measure, settings, facts=facts)


def swing(name: str, integrator: str, steps: int = STEPS) -> Measured:
    """Let the cloth swing; keep its energy above rest, relative to the start."""
    system, start, rest = long_swing(name)
    simulation = INTEGRATORS[integrator]
    times, energies = energy_series(simulation, system, start, H, steps=steps, every=EVERY)
    above = energies - rest
    return {"time": times, "left": above / above[0]}


@functools.cache
def long_swing(name: str) -> tuple[MassSpring, State, float]:
    """Return a small cloth, its start, and the minimum energy near its fall [J]."""
    system, start = scenes.lab_cloth(size=SIZE, damping=DAMPINGS[name])
    state = start
    for _ in range(FALLING):
        state = symplectic_euler(system, state, H)
    low = equilibrium(system, state)
    return system, start, mechanical_energy(system, State(low, 0.0 * low))
