"""Laws of many steps: orders of convergence in h, conserved quantities and dissipation.

Each simulation starts from a problem of `samples`; a refinement divides its h.
"""

from collections.abc import Callable, Sequence

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import MassSpring, State

from .. import samples
from ..verdict import Comparison
from .integrators import SIMULATORS, mechanical_energy

# Steps of the coarser of two runs.
STEPS = 40
# Refinement of the accurate solution: at order 4 its error is 8**-4 of the error in as many steps.
REFINEMENT = 8


def orders_to_the_limit(names: Sequence[str], order: int, truth: str, case: int) -> Comparison:
    """Compare the orders of convergence to an accurate solution with the expected order."""
    limit = _end_positions(case, truth, REFINEMENT)
    errors = [[_end_positions(case, name, k) - limit for k in (1, 2)] for name in names]
    return _compare_orders(errors, order)


def orders_to_each_other(first: str, second: str, order: int, case: int) -> Comparison:
    """Compare the order of the difference between two integrators with the expected order."""
    differences = [_end_positions(case, first, k) - _end_positions(case, second, k) for k in (1, 2)]
    return _compare_orders([differences], order)


def angular_momentum_orders(name: str, order: int, case: int) -> Comparison:
    """Compare the order in h of the error of the angular momentum with the expected order."""
    errors = []
    for refinement in (1, 2):
        system, state, end = _simulate(samples.drifting, case, name, refinement)
        errors.append(angular_momentum(system, end) - angular_momentum(system, state))
    return _compare_orders([errors], order)


def linear_momenta(names: Sequence[str], case: int) -> Comparison:
    """Compare the momentum after many steps with P + t F, relative to the sum of |m v| and |t F|.

    F is the sum of the weights and the external forces; springs and dampers cancel.
    """
    system, state, external, h = samples.unpinned(case)
    impulse = STEPS * h * (system.masses[:, None] * system.gravity + external)
    start = linear_momentum(system, state)
    ends = [linear_momentum(system, _simulate(samples.unpinned, case, n)[2]) for n in names]
    momenta = np.abs(system.masses[:, None] * state.velocities).sum()
    return Comparison(
        np.array(ends),
        np.tile(start + impulse.sum(axis=0), (len(names), 1)),
        baseline=np.tile(start, (len(names), 1)),
        scale=float(momenta + np.abs(impulse).sum()),
    )


def angular_momenta(names: Sequence[str], case: int) -> Comparison:
    """Compare the angular momentum before and after, relative to the sum of |x| |m v|."""
    system, state, _, _ = samples.drifting(case)
    ends = [_simulate(samples.drifting, case, name)[2] for name in names]
    speeds = np.linalg.norm(state.velocities, axis=1)
    distances = np.linalg.norm(state.positions, axis=1)
    return Comparison(
        np.array([angular_momentum(system, end) for end in ends]),
        np.tile(angular_momentum(system, state), (len(names), 1)),
        baseline=np.zeros((len(names), 3)),
        scale=float(np.sum(distances * (system.masses * speeds))),
    )


def scalar_spring_energies(case: int) -> Comparison:
    """Compare the ratio of the energies of a spring after and before n steps of implicit Euler.

    The ratio is (1 + h² omega²)^-n for a spring of rest length zero, whose force is linear in x.
    """
    system, state, h = samples.oscillator(case)
    omega = np.sqrt(system.stiffnesses[0] / system.masses[1])
    end = SIMULATORS["implicit Euler"](system, h)(state, None, STEPS)
    expected = (1.0 + (h * omega) ** 2) ** -STEPS
    ratio = mechanical_energy(system, end) / mechanical_energy(system, state)
    return Comparison(np.array(ratio), np.array(expected), np.array(1.0), scale=float(expected))


def linear_momentum(system: MassSpring, state: State) -> FloatArray:
    """Return the sum of m v [kg m/s], shape (3,)."""
    return np.sum(system.masses[:, None] * state.velocities, axis=0)


def angular_momentum(system: MassSpring, state: State) -> FloatArray:
    """Return the sum of x × m v [kg m²/s], shape (3,)."""
    return np.sum(np.cross(state.positions, system.masses[:, None] * state.velocities), axis=0)


def _simulate(
    problem: Callable[[int], samples.StepProblem], case: int, name: str, refinement: int = 1
) -> tuple[MassSpring, State, State]:
    """Return the system of a problem, its state and the state after `STEPS` of its steps."""
    system, state, external, h = problem(case)
    simulate = SIMULATORS[name](system, h / refinement)
    return system, state, simulate(state, external, STEPS * refinement)


def _end_positions(case: int, name: str, refinement: int) -> FloatArray:
    return _simulate(samples.smooth, case, name, refinement)[2].positions


def _compare_orders(errors: Sequence[Sequence[FloatArray]], order: int) -> Comparison:
    """Compare the orders of convergence, from the errors for h and h/2, with an order."""
    norms = np.array([[np.linalg.norm(error) for error in pair] for pair in errors])
    observed = np.log2(norms[:, 0] / norms[:, 1])
    return Comparison(observed, np.full_like(observed, order), np.zeros_like(observed), scale=1.0)
