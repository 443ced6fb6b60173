"""Every solver's solution of a step of a heavy cloth, certified and compared with Newton's."""

import copy
import functools
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from plumbob.reference import STEP_SOLVERS, ImplicitEuler, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.implicit_euler.certificate import certify

from ..measure.block import Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Fact, Values
from ..peers import catalogue
from ..problems.cloth_swing import TOLERANCE, ClothSwing, integrator_of
from ..problems.step_minima import minima_of

# Stiffness of the cloths [N/m].
STIFFNESSES = (1e3, 1e4, 1e5)
GRAVITY = 9.81  # [m/s²]
# The converged frames before the step: their length [s] and number.
FRAME, FRAMES = 1 / 30, 15
# Iterations of a quick solver; solvers allowed more than `SLOW` count as slow.
USUAL, SLOW = 10, 1000
# At this stiffness [N/m] and above slow solvers also start near Newton's solution, every coordinate
# perturbed by about `PERTURBATION` [m].
STIFF, PERTURBATION = 1e5, 1e-6
FROM_Y, NEAR_NEWTON = "y", "beside Newton’s answer"
# Particles a side, and the number of random targets of a full scale.
QUICK, FULL, _FULL_TARGETS = 10, 30, 2000


class CertifiedStep(Values, frozen=True, kw_only=True):
    """A solver's solution of the step; lengths in metres."""

    stiffness: Fact[float]  # of the cloth [N/m]
    tolerance: Fact[float]
    start: Fact[str]
    coverage: Fact[str] = ""  # the kind of bound
    size: int  # particles along a side
    iterations: int
    residual: float
    at_floor: bool  # whether the residual is at the rounding floor
    balance: float  # the residual in MuJoCo's forces
    distance: float  # proven bound on the distance to a minimiser, infinite if there is none
    error: float  # |x - x*| / |y - x*|
    above: float  # g above Newton's limit, see `StepMinima.measure`
    covered: bool  # whether there is a bound
    same: bool  # whether it provably belongs to Newton's minimiser
    different: bool  # whether it provably does not


KINDS = {"": CertifiedStep}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield, for each stiffness, every solver to its limit and ten local/global iterations."""
    size = FULL if scale.targets >= _FULL_TARGETS else QUICK
    for stiffness in STIFFNESSES:
        for name, solver in catalogue.step_solvers().items():
            limit = solver.certified
            yield _block(size, stiffness, name, FROM_Y, limit)
            if stiffness >= STIFF and limit >= SLOW:
                yield _block(size, stiffness, name, NEAR_NEWTON, limit)
        yield _block(size, stiffness, "local_global", FROM_Y, USUAL)


def _block(size: int, stiffness: float, solver: str, start: str, limit: int) -> Block:
    settings = {"h": FRAME, "start": start, "iterations": limit, "tolerance": TOLERANCE}
    measure = partial(certified_step, size, stiffness, solver, start, limit)
    facts = {"stiffness": stiffness}
    return Block("newton", f"swing/k{stiffness:g}", solver, measure, settings, size, facts)


@functools.cache
def mid_swing(stiffness: float, size: int) -> ClothSwing:
    """Return the lab's cloth under real gravity in mid-swing, after converged frames from rest."""
    system, state = scenes.lab_cloth(size=size, stiffness=stiffness, gravity=GRAVITY)
    integrator = ImplicitEuler(system, h=FRAME)
    for _ in range(FRAMES):
        state = integrator.step(state).state
    return ClothSwing(f"swing/k{stiffness:g}", system, state, FRAME)


def certified_step(size: int, stiffness: float, solver: str, start: str, limit: int) -> Measured:
    """Solve the step; keep the certificate of the solution, and its distance to Newton's."""
    from plumbob.crosscheck.mass_spring.steps import balance_residual

    problem = mid_swing(stiffness, size)
    minima = minima_of(problem.system, problem.start, problem.h)
    solve = _solve_from_y if start == FROM_Y else _solve_near_newton
    x, iterations = solve(problem, solver, limit)
    newton, certificate = minima.newton, certify(minima.objective, x)
    measured = minima.measure([x])
    same = certificate.shares_minimiser(newton.certificate, newton.distance(x))
    return {
        "size": size,
        "iterations": iterations,
        **{name: getattr(certificate, name) for name in ("residual", "distance", "covered")},
        "error": measured["error"][0],
        "above": measured["above"][0],
        "at_floor": minima.objective.iterate_at(x).at_floor,
        "balance": balance_residual(problem.system, problem.start, x, problem.h),
        "same": same is True,
        "different": same is False,
        "coverage": certificate.coverage.name,
    }


def _solve_from_y(problem: ClothSwing, solver: str, limit: int) -> tuple[FloatArray, int]:
    result = integrator_of(problem, solver, TOLERANCE, limit).step(problem.start)
    return result.state.positions, result.iterations


def _solve_near_newton(problem: ClothSwing, solver: str, limit: int) -> tuple[FloatArray, int]:
    """Return the solution from a start near Newton's, and the number of iterations.

    Solvers start where the objective starts; the residual is still of the step from y.
    """
    minima = minima_of(problem.system, problem.start, problem.h)
    objective, perturbed = minima.objective, copy.copy(minima.objective)
    noise = np.random.default_rng(20130).standard_normal(objective.y.shape)
    noise[problem.system.pinned] = 0.0
    perturbed.start = objective.evaluate(minima.newton.positions + PERTURBATION * noise)
    iterates = STEP_SOLVERS[solver](problem.system, problem.h).iterates(perturbed)
    for k, iterate in enumerate(iterates):
        if k == limit or iterate.at_floor or objective.residual(iterate) <= TOLERANCE:
            break
    return iterate.positions, k


# What is shown.

from ..tables.captions import Captions
from ..tables.columns import text
from ..tables.results import counted, label, listed
from ..tables.table import Column, Summary, words

CAPTIONS = Captions(__file__, gravity=f"{GRAVITY:g}", time=f"{FRAMES * FRAME:g}")


def _minimiser(record: Record) -> str:
    step = record.values
    return "yes" if step.same else "no" if step.different else "not proven"


def _bound(record: Record) -> str:
    step = record.values
    return "yes" if step.covered else step.coverage.lower().replace("_", " ")


def _distance(record: Record) -> float | None:
    distance: float = record.values.distance
    return distance if np.isfinite(distance) else None


COLUMNS = (
    Column("stiffness", "N/m", read=lambda r: r.values.stiffness),
    text("solver", lambda r: label(r.solver)),
    text("start", lambda r: r.values.start),
    Column("iterations", read=lambda r: r.values.iterations),
    Column("residual", best="least", read=lambda r: r.values.residual),
    Column("distance to a minimiser, at most", "m", best="least", read=_distance),
    text("same minimiser as Newton", _minimiser),
    Column("residual in MuJoCo’s forces", folded=True, read=lambda r: r.values.balance),
    text("bound", _bound, folded=True),
    Column("error", folded=True, read=lambda r: r.values.error),
    Column("g above Newton’s", folded=True, read=lambda r: r.values.above),
)


def _summary(records: Sequence[Record]) -> Summary:
    newton = [record for record in records if record.solver == "newton"]
    rivals = [record for record in records if record.solver != "newton"]
    solved = sum(r.values.at_floor or r.values.residual <= r.values.tolerance for r in newton)
    same = sum(record.values.same for record in rivals)
    first = (
        f"Newton reached the tolerance or the rounding floor in {words(solved)} of "
        f"{counted(len(newton), 'cloth')}. "
    )
    return Summary(
        f"{first if newton else ''}{words(same)} of "
        f"{counted(len(rivals), 'solution')} by other solvers are proven to belong to the "
        "same minimiser."
    )


def _sizes(records: Sequence[Record]) -> dict[str, str]:
    sizes = sorted({record.values.size for record in records})
    return {"sizes": listed([f"{size} × {size}" for size in sizes], "or")}


proofs = CAPTIONS.layout(
    "cloth_proofs",
    lambda results: results.all("newton"),
    _summary,
    measured=_sizes,
    columns=COLUMNS,
)

LAYOUTS = (proofs,)
