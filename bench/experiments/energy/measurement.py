"""What integrators do to the energy of a swinging cloth over ten thousand steps."""

from collections.abc import Callable, Iterator
from functools import partial

from plumbob.crosscheck.mass_spring.energy import energy_series
from plumbob.crosscheck.mass_spring.integrators import SIMULATORS, Simulation, implicit
from plumbob.reference import MassSpring

from ...harness.block import Block, Measured, Scale
from .problem import DAMPINGS, H, long_swing
from .values import Swing

STEPS = 10_000
EVERY = 10
TOLERANCE = 1e-10
# Of two that are the same step for step, the faster. Local/global converges in a dozen iterations
# at this stiffness, each a hundredth of one of Newton's.
INTEGRATORS: dict[str, Callable[[MassSpring, float], Simulation]] = {
    "symplectic Euler": SIMULATORS["symplectic Euler"],
    "implicit Euler": partial(implicit, "local_global", tolerance=TOLERANCE),
    **{
        name: SIMULATORS[f"MuJoCo {name}"]
        for name in ("implicit", "implicitfast", "discrete", "RK4")
    },
}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every integrator, without dampers and with; the cloth is the same at every scale."""
    settings = {"h": H, "steps": STEPS, "every": EVERY, "tolerance": TOLERANCE}
    for name in DAMPINGS:
        for integrator in INTEGRATORS:
            measure = partial(swing, name, integrator)
            facts = {"title": name, "damping": DAMPINGS[name]}
            yield Block("energy", f"swing/{name}", integrator, measure, settings, facts=facts)


def swing(name: str, integrator: str, steps: int = STEPS) -> Measured:
    """Let the cloth swing; keep its energy above rest, over that of the start."""
    problem = long_swing(name)
    times, energies = energy_series(
        INTEGRATORS[integrator], problem.system, problem.start, H, steps=steps, every=EVERY
    )
    above = energies - problem.rest
    return Measured(Swing(times, above / above[0]))
