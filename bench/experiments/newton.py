"""Every solver's solution of a step of a heavy cloth, certified and compared with Newton's."""

import copy
import functools
from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from plumbob.crosscheck.mass_spring.exact_step import ExactStep, exact_step
from plumbob.reference import STEP_SOLVERS, ImplicitEuler, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.implicit_euler.certificate import Certificate, certify
from plumbob.reference.implicit_euler.objective import Objective

from ..measure.block import Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Fact, Values
from ..peers import catalogue
from ..problems.cloth_swing import TOLERANCE, ClothSwing, integrator_of

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
# The numbers of a certificate on record.
_CERTIFIED = ("residual", "distance", "curvature", "lipschitz", "newton_step", "covered")
# Particles a side, and the number of random targets of a full scale.
QUICK, FULL, _FULL_TARGETS = 10, 30, 2000


class CertifiedStep(Values, frozen=True, kw_only=True):
    """A solver's solution of the step; lengths in metres."""

    stiffness: Fact[float]  # of the cloth [N/m]
    tolerance: Fact[float]
    start: Fact[str]
    coverage: Fact[str] = ""  # the kind of bound
    why: Fact[str] = ""  # the sentence of the bound
    size: int  # particles along a side
    iterations: int
    residual: float
    at_floor: bool  # whether the residual is at the rounding floor
    balance: float  # the residual in MuJoCo's forces
    distance: float  # proven bound on the distance to a minimiser, infinite if there is none
    curvature: float  # proven lower bound on the smallest eigenvalue of the Hessian
    lipschitz: float  # Lipschitz constant of the Hessian
    newton_step: float  # its length
    newton_distance: float  # to Newton's solution
    error: float  # |x - x*| / |y - x*|
    above: float  # g above that of Newton's solution [kg m²]
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
    newton, objective = newton_solution(problem), _objective(problem)
    solve = _solve_from_y if start == FROM_Y else _solve_near_newton
    x, iterations = solve(problem, solver, limit)
    certificate, point = certify(objective, x), objective.evaluate(x)
    distance = float(np.linalg.norm(x - newton.x))
    same = certificate.shares_minimiser(newton.certificate, distance)
    return {
        "size": size,
        "iterations": iterations,
        **{name: getattr(certificate, name) for name in _CERTIFIED},
        "at_floor": point.at_floor,
        "balance": balance_residual(problem.system, problem.start, x, problem.h),
        "newton_distance": distance,
        "error": newton.exact.error(x, objective.y),
        "above": point.value - newton.minimum,
        "same": same is True,
        "different": same is False,
        "coverage": certificate.coverage.name,
        "why": certificate.coverage.sentence,
    }


class NewtonSolution(NamedTuple):
    """Newton's x, the same to 25 digits, its certificate, and the minimum of g."""

    x: FloatArray
    exact: ExactStep
    certificate: Certificate
    minimum: float


@functools.cache
def newton_solution(problem: ClothSwing) -> NewtonSolution:
    """Return the limit of Newton's method, iterated far beyond the rounding floor."""
    integrator = integrator_of(problem, tolerance=0.0, max_iterations=50)
    x, objective = integrator.step(problem.start).state.positions, _objective(problem)
    exact = exact_step(problem.system, problem.start, problem.h, x)
    return NewtonSolution(x, exact, certify(objective, x), objective.value(x))


def _objective(problem: ClothSwing) -> Objective:
    return Objective(problem.system, problem.start, problem.h)


def _solve_from_y(problem: ClothSwing, solver: str, limit: int) -> tuple[FloatArray, int]:
    result = integrator_of(problem, solver, TOLERANCE, limit).step(problem.start)
    return result.state.positions, result.iterations


def _solve_near_newton(problem: ClothSwing, solver: str, limit: int) -> tuple[FloatArray, int]:
    """Return the solution from a start near Newton's, and the number of iterations.

    Solvers start where the objective starts; the residual is still of the step from y.
    """
    objective = _objective(problem)
    perturbed = copy.copy(objective)
    noise = np.random.default_rng(20130).standard_normal(objective.y.shape)
    noise[problem.system.pinned] = 0.0
    perturbed.start = objective.evaluate(newton_solution(problem).x + PERTURBATION * noise)
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
    Column(
        "distance to Newton’s solution", "m", folded=True, read=lambda r: r.values.newton_distance
    ),
    Column("error", folded=True, read=lambda r: r.values.error),
    Column("g above Newton’s", "kg m²", folded=True, read=lambda r: r.values.above),
)


def _summary(records: Sequence[Record]) -> Summary:
    newton = [record for record in records if record.solver == "newton"]
    rivals = [record for record in records if record.solver != "newton"]
    solved = sum(r.values.at_floor or r.values.residual <= r.values.tolerance for r in newton)
    distances = [record.values.newton_distance for record in rivals if record.values.same]
    nearby = f", at most {words(max(distances))} m from Newton’s" if distances else ""
    first = (
        f"Newton reached the tolerance or the rounding floor in {words(solved)} of "
        f"{counted(len(newton), 'cloth')}. "
    )
    return Summary(
        f"{first if newton else ''}{words(len(distances))} of "
        f"{counted(len(rivals), 'solution')} by other solvers are proven to belong to the "
        f"same minimiser{nearby}."
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
