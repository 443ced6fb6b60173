"""Convergence of implicit Euler's solvers on the lab's cloth, and the error of few iterations."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import ImplicitEuler, MassSpring, State
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import damper_forces, lengths, spring_forces

from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Fact, Floats1, Values
from ..peers import catalogue
from ..problems.cloth_swing import (
    FALLING,
    MIDDLE,
    STEPS,
    ClothSwing,
    H,
    cloth_swing,
    converged_motion,
    integrator_of,
    motion,
)
from ..problems.cloth_truth import rms_distance
from ..problems.step_minima import minima_of

# The tasks of its records.
ONE_STEP, FEW, DAMPERS = "one step", "few iterations", "dampers"
FACTORS = (1, 10, 100)  # of the stiffness, from the lab's soft cloth to a stiff one
DAMPING = 0.2  # of the lab's own cloth; elsewhere it swings undamped
FEW_ITERATIONS = (1, 10, 100)  # 10 as in Liu et al. 2013, and a tenth and ten times as many
# Steps in which the two laws of dampers are compared [s], each half as long as the last.
HALVED = tuple(H / 2**i for i in range(-1, 6))


class StepFacts(Values, frozen=True, kw_only=True):
    """The number of iterations of a step, where fixed."""

    iterations: Fact[int] = 0


class IterationErrors(StepFacts, frozen=True):
    """Residual and error of a step at the start and after each iteration, (iteration + 1,)."""

    residual: Floats1
    error: Floats1
    above: Floats1 | None = None  # g above Newton's limit, see `StepMinima.measure`


class TruncatedSteps(StepFacts, frozen=True):
    """Steps of a few iterations compared with converged steps, (step,): relative error, and [m]."""

    error: Floats1
    drift: Floats1
    path: Floats1


class DamperDifferences(Values, frozen=True):
    """Relative difference between the forces of two laws of dampers in steps of h [s]."""

    h: Floats1
    difference: Floats1


KINDS = {ONE_STEP: IterationErrors, FEW: TruncatedSteps, DAMPERS: DamperDifferences}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield, for each stiffness: the iterations of a step, few iterations, dampers.

    The cloth is the same at every scale.
    """
    swing = {"h": H, "first": FALLING, "steps": STEPS}
    for factor in FACTORS:
        problem, block = cloth_swing(factor), partial(_block, factor)
        for solver in catalogue.followed_step_solvers():
            measure = partial(one_step, problem, solver.name, solver.followed)
            settings = {"h": H, "step": MIDDLE, "iterations": solver.followed}
            yield block(ONE_STEP, solver.name, measure, **settings)
        for count in FEW_ITERATIONS:
            measure = partial(few_iterations, problem, count)
            yield block(FEW, "local_global", measure, **swing, iterations=count)
        measure = partial(two_dampers, cloth_swing(factor, damping=DAMPING))
        settings = {"first": MIDDLE, "damping": DAMPING}
        settings |= {"longest": HALVED[0], "halvings": len(HALVED) - 1}
        yield block(DAMPERS, "newton", measure, **settings)


def _block(
    factor: float, task: str, solver: str, measure: Callable[[], Measured], **settings: Any
) -> Block:
    problem = f"{cloth_swing(factor).name}/{task}"
    facts = {"title": f"stiffness × {factor:g}", "task": task}
    return Block("cloth", problem, solver, measure, settings, facts=facts)


def one_step(problem: ClothSwing, solver: str, iterations: int) -> Measured:
    """Iterate a step from mid-swing; keep residual and error after each iteration."""
    state = converged_motion(problem)[MIDDLE]
    minima = minima_of(problem.system, state, problem.h)
    iterates = ImplicitEuler(problem.system, h=problem.h, solver=solver).iterates(state)
    first = list(itertools.islice(iterates, iterations + 1))
    residual = np.array([minima.objective.residual(iterate) for iterate in first])
    measured = minima.measure([iterate.positions for iterate in first])
    return {"residual": residual, "error": measured["error"], "above": measured["above"]}


def few_iterations(problem: ClothSwing, iterations: int) -> Measured:
    """Compare steps of a few local/global iterations with converged steps.

    The error is measured after a single step from each state of the converged motion.
    The drift is the distance between the converged motion and a motion of only truncated steps. The
    path is the distance of the converged motion from its start.
    """
    integrator = integrator_of(problem, "local_global", 0.0, iterations)
    start, *exact = converged = converged_motion(problem)[FALLING:]
    ends = [integrator.step(state).state for state in converged[:-1]]
    errors = [
        minima_of(problem.system, state, problem.h).measure([end.positions])["error"]
        for state, end in zip(converged, ends, strict=False)
    ]

    def distances(states: Sequence[State]) -> FloatArray:
        pairs = zip(states, exact, strict=True)
        return np.array([rms_distance(a.positions, b.positions) for a, b in pairs])

    return {
        "error": np.concatenate(errors),
        "drift": distances(motion(start, STEPS, integrator)[1:]),
        "path": distances([start] * STEPS),
    }


def two_dampers(problem: ClothSwing, first: int = MIDDLE) -> Measured:
    """Take a step of each length from mid-swing; compare the two laws at its end."""
    state = motion(problem.start, first, integrator_of(problem))[-1]
    differences = []
    for h in HALVED:
        end = ImplicitEuler(problem.system, h=h).step(state).state
        rates = damper_forces(problem.system, end)
        offsets = step_damper_forces(problem.system, state, end, h) - rates
        differences.append(np.linalg.norm(offsets) / np.linalg.norm(rates))
    return {"h": np.array(HALVED), "difference": np.array(differences)}


def step_damper_forces(system: MassSpring, before: State, after: State, h: float) -> FloatArray:
    """Return the forces -(c/h) (l - l_n) u of a step's dampers at its end [N], (particle, 3)."""
    dampers = system.replaced(
        stiffnesses=system.dampings / h,
        rest_lengths=lengths(system, before.positions),
        tension_only=np.zeros(len(system.springs), dtype=bool),
    )
    return spring_forces(dampers, after.positions)


# What is shown.

from ..figures.chart import Panel, declared_chart, series
from ..figures.sketch import Sketch
from ..tables.captions import Captions
from ..tables.columns import text, words_in
from ..tables.results import (
    Results,
    by_problem,
    counted,
    grouped,
    label,
    listed,
    most_often,
    settings,
)
from ..tables.table import Column, Summary, words
from .cloth_peers import DECADES, SOLVED
from .pictures import falling_cloth

CAPTIONS = Captions(__file__)


# A row: the records of a solver on a cloth, of a step and of steps of few iterations.
SolverRecords = Sequence[Record]


def _of(task: str, read: Callable[[Any], Any], count: int = 0) -> Callable[[SolverRecords], Any]:
    """Return a reader of the record of a task, if given with so many iterations; else None."""

    def cell(row: SolverRecords) -> Any:
        values = (r.values for r in row if r.task == task)
        return next((read(v) for v in values if count in (0, v.iterations)), None)

    return cell


def _after(quantity: str, count: int, **looks: Any) -> Column:
    """Return the column of a quantity after so many iterations."""

    def read(step: IterationErrors) -> float | None:
        numbers = getattr(step, quantity)
        return numbers[count] if count < numbers.size else None

    title, group = f"{quantity} after {words(count)}", f"{quantity} after"
    return Column(title, group=group, read=_of(ONE_STEP, read), **looks)


def _iterations_to(error: str, **looks: Any) -> Column:
    read = _of(ONE_STEP, lambda step: metrics.first_below(step.error, float(error)))
    return Column(f"iterations to {error}", best="least", group="iterations to", read=read, **looks)


def _truncated(count: int) -> Iterator[Column]:
    """Yield the columns of steps of so many iterations."""
    title = f"steps of {counted(count, 'iteration')}"
    quantities: tuple[tuple[str, str, Callable[[TruncatedSteps], float]], ...] = (
        ("median error", "", lambda steps: metrics.spread(steps.error).median),
        ("largest error", "", lambda steps: metrics.spread(steps.error).largest),
        ("drift", "m", lambda steps: steps.drift[-1]),
        ("drift relative to the path", "%", _relative_drift),
    )
    for name, unit, read in quantities:
        cell = _of(FEW, read, count)
        yield Column(f"{title}, {name}", unit, group=title, folded=True, read=cell)


def _relative_drift(steps: TruncatedSteps) -> float:
    return metrics.ratio(float(steps.drift[-1]), float(steps.path[-1]))


def _cloth(row: SolverRecords) -> str:
    return f"lab cloth, {row[0].title}"


_solved = _iterations_to(SOLVED).read
_trials = _of(ONE_STEP, lambda step: step.error.size - 1)
_last_above = _of(ONE_STEP, lambda step: None if step.above is None else step.above[-1])

CONVERGENCE = (
    text("cloth", _cloth),
    text("solver", lambda row: label(row[0].solver)),
    *(_after("error", count, best="least") for count in (1, 10, 100)),
    *map(_iterations_to, ("1e-2", "1e-4")),
    Column("smallest error", best="least", read=_of(ONE_STEP, lambda step: step.error.min())),
    _after("error", 1000, best="least", folded=True),
    *(_iterations_to(d, folded=True) for d in DECADES if d not in ("1e-2", "1e-4")),
    Column("iterations tried", read=_trials, folded=True),
    Column("g above Newton’s", read=_last_above, folded=True),
    *(_after("residual", count, folded=True) for count in (1, 10, 100, 1000)),
    *(column for count in FEW_ITERATIONS for column in _truncated(count)),
)


def _convergence_rows(results: Results) -> list[SolverRecords]:
    """Return the records of every solver on every cloth, cloth by cloth."""
    records = [r for task in (ONE_STEP, FEW) for r in results.all("cloth", task=task)]
    cloths = grouped(records, lambda r: r.title).values()
    return [row for cloth in cloths for row in grouped(cloth, lambda r: r.solver).values()]


def _convergence_summary(rows: Sequence[SolverRecords]) -> Summary:
    points = [
        f"{cloth}: {listed([_count(row) for row in of_cloth if _trials(row)])}"
        for cloth, of_cloth in grouped(rows, _cloth).items()
    ]
    few = (record for row in rows for record in row if record.task == FEW)
    points += [_single_iterations(record) for record in few if record.values.iterations == 1]
    cloths = grouped((row for row in rows if _solved(row)), _cloth).values()
    firsts = [label(min(of_cloth, key=_solved)[0].solver) for of_cloth in cloths]
    fewest = f"by {most_often(firsts, 'cloth')}" if firsts else "by no solver"
    sentence = f"An error of {SOLVED} is reached in the fewest iterations {fewest}."
    return Summary(sentence, tuple(points))


def _count(row: SolverRecords) -> str:
    count = _solved(row)
    iterations = f"more than {words(_trials(row))}" if count is None else words(count)
    return f"{label(row[0].solver)} {iterations}"


def _single_iterations(record: Record) -> str:
    steps: TruncatedSteps = record.values
    return (
        f"{_cloth([record])}, {settings([record], 'steps')} steps of one local/global iteration "
        f"each: a median error of {words_in(metrics.spread(steps.error).median, '%')}; the "
        f"cloth drifts by {words(float(steps.drift[-1]))} m, "
        f"{words_in(_relative_drift(steps), '%')} of its path"
    )


def convergence_chart(results: Results) -> Sketch | None:
    """Show residual and error over the iterations of a step, a column for each stiffness."""
    cloths = by_problem(results.all("cloth", task=ONE_STEP)).values()
    rows = {"residual": "residual", "error": "error |x − x*| / |y − x*|"}
    panels = (
        Panel(
            f"cloth, {records[0].title}" if quantity == "residual" else "",
            tuple(
                series(r.solver, np.arange(1, errors.size), errors[1:])
                for r in records
                for errors in [getattr(r.values, quantity)]
            ),
            label=title,
        )
        for quantity, title in rows.items()
        for records in cloths
    )
    chart = CAPTIONS.figure("cloth_convergence")
    return declared_chart(chart, panels, results.user_solvers, columns=len(cloths))


convergence = CAPTIONS.layout(
    "cloth_convergence",
    _convergence_rows,
    _convergence_summary,
    columns=CONVERGENCE,
    figures=(convergence_chart, falling_cloth),
)


class DampedStep(NamedTuple):
    """A step of a damped cloth: its length [s], and the difference of the two laws."""

    record: Record
    h: float
    difference: float
    order: float | None  # observed, from the longer step before

    def __str__(self) -> str:
        return f"{words(self.difference)} at {words_in(self.h, 'ms')}"


DAMPED_STEPS = (
    text("cloth", lambda step: step.record.title),
    Column("h", unit="ms", read=lambda step: step.h),
    Column("difference", read=lambda step: step.difference),
    Column("observed order", read=lambda step: step.order),
)


def _damped_steps(results: Results) -> Iterator[DampedStep]:
    """Yield every step of every damped cloth, the longest step first."""
    for record in results.all("cloth", task=DAMPERS):
        differences = record.values.difference
        orders = [None, *np.log2(differences[:-1] / differences[1:])]
        for h, difference, order in zip(record.values.h, differences, orders, strict=True):
            yield DampedStep(record, float(h), float(difference), order)


def _damper_summary(steps: Sequence[DampedStep]) -> Summary:
    cloths = grouped(steps, lambda step: step.record.title)
    low, high = (words(end(step.difference for step in steps)) for end in (min, max))
    return Summary(
        f"The forces of the two laws differ by {low} to {high} of their size, the less the "
        "shorter the step.",
        tuple(f"{cloth}: {of[0]}, {of[-1]}" for cloth, of in cloths.items()),
    )


dampers = CAPTIONS.layout("cloth_dampers", _damped_steps, _damper_summary, columns=DAMPED_STEPS)

LAYOUTS = (convergence, dampers)
