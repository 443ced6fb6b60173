"""The energy of a swinging cloth by integrator, over ten thousand steps."""

import functools
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from plumbob.reference import MassSpring, State, scenes, symplectic_euler

from ..measure.block import Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Fact, Floats1, Values

# Particles along a side, and the dampings of the springs [N s/m].
SIZE = 5
DAMPINGS = {"undamped": 0.0, "damped": 0.2}
# A frame [s]; steps of nearly three minutes, of which every tenth is drawn.
H, STEPS, EVERY = 1 / 60, 10_000, 10
# Steps after which the cloth hangs well below its start, near its rest.
FALLING = 120
# The default of `ImplicitEuler`.
TOLERANCE = 1e-10
# Two of ours, and MuJoCo's by its names.
INTEGRATORS = (
    *("symplectic Euler", "implicit Euler"),
    *("implicit", "implicitfast", "discrete", "RK4"),
)


class Swing(Values, frozen=True, kw_only=True):
    """The energy of a swing by an integrator, (state,)."""

    damping: Fact[float]  # of every spring [N s/m]
    every: Fact[int]  # each such step counts
    time: Floats1  # [s]
    left: Floats1  # the energy above that of the cloth at rest, over that of the start


KINDS = {"": Swing}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every integrator, undamped and damped; the cloth is the same at every scale."""
    settings = {"h": H, "steps": STEPS, "every": EVERY, "tolerance": TOLERANCE}
    for name, damping in DAMPINGS.items():
        facts = {"title": name, "damping": damping}
        for integrator in INTEGRATORS:
            measure = partial(swing, name, integrator)
            yield Block("energy", f"swing/{name}", integrator, measure, settings, facts=facts)


def swing(name: str, integrator: str, steps: int = STEPS) -> Measured:
    """Return times [s] of a swing, and the energy above rest over the energy at the start."""
    from plumbob.crosscheck.mass_spring.integrators import SIMULATORS, energy_series, implicit

    system, start, rest = long_swing(name)
    # The faster of two integrators in agreement step by step. Local/global converges in a dozen
    # iterations at this stiffness, each a hundredth of the cost of a Newton iteration.
    integrators: dict[str, Any] = {
        "symplectic Euler": SIMULATORS["symplectic Euler"],
        "implicit Euler": partial(implicit, "local_global", tolerance=TOLERANCE),
    }
    simulation = integrators.get(integrator) or SIMULATORS[f"MuJoCo {integrator}"]
    times, energies = energy_series(simulation, system, start, H, steps=steps, every=EVERY)
    above = energies - rest
    return {"time": times, "left": above / above[0]}


@functools.cache
def long_swing(name: str) -> tuple[MassSpring, State, float]:
    """Return a small cloth, its start, and the minimum energy near its fall [J]."""
    from plumbob.crosscheck.mass_spring.equilibria import equilibrium
    from plumbob.crosscheck.mass_spring.integrators import mechanical_energy

    system, start = scenes.lab_cloth(size=SIZE, damping=DAMPINGS[name])
    state = symplectic_euler(system, start, H, steps=FALLING)
    low = equilibrium(system, state)
    return system, start, mechanical_energy(system, State(low, 0.0 * low))


# What is shown.

from ..figures.chart import Panel, declared_chart, series
from ..figures.sketch import Sketch
from ..tables.captions import Captions
from ..tables.columns import text, words_in
from ..tables.results import Results, by_problem, label, settings
from ..tables.table import Column, Summary, words

CAPTIONS = Captions(__file__, size=str(SIZE), damping=f"{DAMPINGS['damped']:g}")


def _left_after(count: int) -> Column:
    """Return the column of the energy left after so many steps, None in shorter swings."""

    def read(record: Record) -> float | None:
        left, place = record.values.left, count // record.values.every
        return left[place] if place < left.size else None

    return Column(f"left after {words(count)} steps", unit="%", group="left after", read=read)


COLUMNS = (
    text("cloth", lambda record: record.title),
    text("integrator", lambda record: label(record.solver)),
    *map(_left_after, (100, 1_000, 10_000)),
    Column("maximum", unit="%", read=lambda record: record.values.left.max()),
    Column("minimum", unit="%", read=lambda record: record.values.left.min()),
)


def _summary(records: Sequence[Record]) -> Summary:
    undamped = [record for record in records if record.values.damping == 0.0]
    if not undamped:
        return Summary()
    changes = {abs(record.values.left[-1] - 1.0): label(record.solver) for record in undamped}
    order = (
        f"; after {settings(undamped, 'steps')} steps {changes[min(changes)]} is nearest to that, "
        f"and {changes[max(changes)]} farthest."
    )
    return Summary(
        "Without dampers the energy should stay constant" + (order if len(changes) > 1 else "."),
        tuple(map(_point, undamped)),
    )


def _point(record: Record) -> str:
    left = record.values.left
    last, low, high = (words_in(float(x), "%") for x in (left[-1], left.min(), left.max()))
    return f"{label(record.solver)}: {last} (minimum {low}, maximum {high})"


def energy_chart(results: Results) -> Sketch | None:
    """Show the energy left by each integrator over time, undamped and damped."""
    panels = (
        Panel(group[0].title, tuple(series(r.solver, r.values.time, r.values.left) for r in group))
        for group in by_problem(results.all("energy")).values()
    )
    return declared_chart(CAPTIONS.figure("energy"), panels, results.user_solvers)


energy = CAPTIONS.layout(
    "energy",
    lambda results: results.all("energy"),
    _summary,
    columns=COLUMNS,
    figures=(energy_chart,),
)

LAYOUTS = (energy,)
