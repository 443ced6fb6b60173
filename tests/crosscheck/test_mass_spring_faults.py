"""The claims about mass-spring systems go red under the faults that real solutions make."""

import dataclasses
from functools import partial

import numpy as np
import pytest

from plumbob.crosscheck.claims import CLAIMS
from plumbob.crosscheck.mass_spring import equilibria, integrators, steps
from plumbob.crosscheck.mass_spring import forces as force_claims
from plumbob.crosscheck.mass_spring.claims import MASS_SPRING_CLAIMS
from plumbob.crosscheck.mass_spring.steps import damper_blocks, semi_implicit
from plumbob.crosscheck.verdict import check_claim
from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import (
    MassSpring,
    State,
    damper_forces,
    derivation,
    forces,
    kinetic_energy,
    potential_energy,
    spring_blocks,
    spring_energy,
    spring_forces,
    stiffness_matrix,
)
from plumbob.reference.sparse.assembly import BlockSum

# One pin and two, and a spring whose ends coincide.
FEW = 2

PARTS = ["masses", "springs", "rest_lengths", "stiffnesses", "dampings", "pinned", "gravity"]
PARTS += ["tension_only"]

# Faults in the system.
SYSTEM_FAULTS = {
    "gravity left out": lambda s: altered(s, gravity=(0, 0, 0)),
    "rest lengths left out": lambda s: altered(s, rest_lengths=0.0),
    "slack springs push": lambda s: altered(s, tension_only=False),
    "springs twice": lambda s: altered(s, stiffnesses=2 * s.stiffnesses),
    "one spring forgotten": lambda s: altered(s, stiffnesses=s.stiffnesses - first_stiffness(s)),
    "dampers left out": lambda s: altered(s, dampings=0.0),
    "dampers twice": lambda s: altered(s, dampings=2 * s.dampings),
    "pins with a velocity": lambda s: altered(s, pinned=()),
}
# Faults in the external forces: (system, state, forces) -> forces.
FORCE_FAULTS = {
    "gravity times mass twice": lambda s, state, f: f + (s.masses - 1)[:, None] * weight(s),
    "external forces left out": lambda s, state, f: 0.0 * f,
    "dampers push": lambda s, state, f: f - 2.0 * damper_forces(s, state),
    "dampers across the springs too": lambda s, state, f: (
        f - damper_forces(s, state) + all_round(s, state)
    ),
    "L in place of M + h² L": lambda s, state, f: f + weight(s),
    "springs pull one end only": lambda s, state, f: f + one_sided(s, state),
}


def altered(system, **changes):
    return MassSpring(**{name: changes.get(name, getattr(system, name)) for name in PARTS})


def first_stiffness(system):
    return np.where(np.arange(len(system.springs)) == 0, system.stiffnesses, 0.0)


def faulted(system, fault):
    return SYSTEM_FAULTS.get(fault, lambda same: same)(system)


def weight(system):
    return system.masses[:, None] * system.gravity


def all_round(system, state):
    """Dampers that act on the whole relative velocity, not only on its part along the spring."""
    v = np.where(system.free[:, None], state.velocities, 0.0)
    i, j = system.springs.T
    pulls = np.zeros_like(v)
    np.add.at(pulls, i, -system.dampings[:, None] * (v[i] - v[j]))
    np.add.at(pulls, j, system.dampings[:, None] * (v[i] - v[j]))
    return pulls


def one_sided(system, state):
    """The force that cancels the first spring's pull at its second end."""
    pulls = spring_forces(altered(system, stiffnesses=first_stiffness(system)), state.positions)
    pulls[system.springs[0, 0]] = 0.0
    return -pulls


def changed(fault, system, state, h, external):
    """The system and the external forces as the fault has them."""
    loads = np.zeros_like(state.positions) if external is None else external
    model = faulted(system, fault)
    if fault == "gravity without h²":
        model = altered(system, gravity=system.gravity / h**2)
    if fault == "L in place of M + h² L":
        model = altered(system, masses=1e-9 * system.masses, gravity=(0, 0, 0))
    return model, FORCE_FAULTS.get(fault, lambda s, state, f: f)(system, state, loads)


def faulty_springs(system, positions, *, fault):
    pulls = spring_forces(faulted(system, fault), positions)
    return -pulls if fault == "push" else pulls


def faulty_dampers(system, state, *, fault):
    if fault == "across the spring too":
        return all_round(system, state)
    pulls = damper_forces(faulted(system, fault), state)
    return -pulls if fault == "push" else pulls


def faulty_stiffness(system, positions, *, fault):
    K = stiffness_matrix(faulted(system, fault), positions)
    blocks = spring_blocks(system, np.array(positions), geometric=False)
    along = BlockSum(derivation(system).A).matrix(blocks)
    return {"geometric term dropped": along, "negated": -K,
            "geometric term with the wrong sign": 2 * along - K}.get(fault, K)  # fmt: skip


def faulty_potential(system, positions, *, fault):
    energy, springs = potential_energy(system, positions), spring_energy(system, positions)
    gravity = energy - springs
    if fault == "pinned weights left out":
        return energy + np.sum((weight(system) * positions)[system.pinned])
    if fault == "gravity times mass twice":
        return springs - np.sum(system.masses[:, None] * weight(system) * positions)
    return {"k (l - r)²": energy + springs, "gravity upwards": springs - gravity}.get(fault, energy)


def faulty_kinetic(system, state, *, fault):
    energy = kinetic_energy(system, state)
    pins = kinetic_energy(altered(system, pinned=()), state)
    massless = 0.5 * np.sum(state.velocities[system.free] ** 2)
    return {"m |v|²": 2 * energy, "pins counted": pins, "mass left out": massless}.get(
        fault, energy
    )


def faulty_symplectic(system, state, h, external, *, fault):
    model, given = changed(fault, system, state, h, external)
    end = symplectic_euler(model, state, h, given)
    x, pins = end.positions.copy(), system.pinned
    if fault == "old velocities move":
        x[system.free] = (state.positions + h * state.velocities)[system.free]
    if fault == "pins fall":
        pull = forces(system, state, external) / system.masses[:, None]
        x[pins] += h * h * pull[pins]
    return State(x, end.velocities)


def accelerations(system, state, external):
    pull = forces(system, state, external) / system.masses[:, None]
    return np.where(system.free[:, None], pull, 0.0)


def faulty_runge_kutta(system, state, h, external, *, fault):
    model, given = changed(fault, system, state, h, external)
    weights = {"equal weights": np.full(4, 0.25)}.get(fault, np.array([1, 2, 2, 1]) / 6)
    middle = {"whole steps to the middle": 1.0}.get(fault, 0.5)

    def rates(share, before):
        dx, dv = before
        at = State(state.positions + share * h * dx, v + share * h * dv)
        return at.velocities, accelerations(model, at, given)

    v = np.where(system.free[:, None], state.velocities, 0.0)
    k = [(v, accelerations(model, state, given))]
    for share in (middle, middle, 1.0):
        k.append(rates(share, k[-1]))
    dx, dv = np.tensordot(weights, k, 1)
    return State(state.positions + h * dx, v + h * dv)


def faulty_semi_implicit(system, state, h, external, D, *, fault):
    model, given = changed(fault, system, state, h, external)
    D = {
        "nothing implicit": 0.0 * D,
        "D twice": 2.0 * D,
        "D with the wrong sign": -D,
        "the whole block": damper_blocks(system, state),
        "only the diagonal": np.eye(3) * D,
    }.get(fault, D)
    end = semi_implicit(model, state, h, given, D)
    v = np.where(system.free[:, None], state.velocities, 0.0)
    positions = state.positions + h * (v if fault == "old velocities move" else end.velocities)
    return State(positions, end.velocities)


def faulty_euler(system, *, h, fault, **settings):
    """Stand in for ImplicitEuler, with one fault in model, settings or result."""
    settings |= {
        "one iteration": {"max_iterations": 1},
        "one local/global iteration": {"solver": "local_global", "max_iterations": 1},
        "the converged step": {"solver": "newton", "max_iterations": 30},
    }.get(fault, {})
    return _SlippedEuler(system, h, fault, settings)


@dataclasses.dataclass
class _SlippedEuler:
    system: MassSpring
    h: float
    fault: str | None
    settings: dict

    def step(self, state, external=None):
        model, given = changed(self.fault, self.system, state, self.h, external)
        if self.fault == "pins put back after the solve":
            model = altered(model, pinned=())
        result = ImplicitEuler(model, h=self.h, **self.settings).step(state, given)
        x, v = result.state.positions.copy(), result.state.velocities.copy()
        if self.fault == "pins put back after the solve":
            x[self.system.pinned], v[self.system.pinned] = state.positions[self.system.pinned], 0.0
        if self.fault == "velocities not recomputed":
            v = state.velocities
        return dataclasses.replace(result, state=State(x, v))


def faulty_motion(step, *, fault):
    """Stand in for an integrator of `SIMULATORS`, faultping in every step."""

    def over(system, h):
        def move(state, external, count):
            for _ in range(count):
                state = step(system, state, h, external, fault=fault)
            return state

        return move

    return over


def faulty_implicit_step(system, state, h, external, *, fault):
    if fault == "symplectic Euler in its place":
        return symplectic_euler(system, state, h, external)
    if fault == "the trapezoid in its place":
        half = faulty_implicit_step(system, state, h / 2, external, fault=None)
        return State(2 * half.positions - state.positions, 2 * half.velocities - state.velocities)
    return faulty_euler(system, h=h, fault=fault).step(state, external).state


STEP_FAULTS = ["gravity times mass twice", "gravity left out", "rest lengths left out",
               "external forces left out"]  # fmt: skip
LOOSE = "slack springs push"
IMPLICIT_FAULTS = [*STEP_FAULTS, "gravity without h²", "L in place of M + h² L",
                   "pins put back after the solve", "one local/global iteration"]  # fmt: skip
DAMPER_FAULTS = ["dampers left out", "dampers twice", "dampers push",
                 "dampers across the springs too"]  # fmt: skip
ENERGY_FAULTS = ["k (l - r)²", "gravity upwards", "gravity times mass twice"]
SPRING_FAULTS = ["push", "springs twice", "rest lengths left out", "one spring forgotten"]
REST_FAULTS = ["gravity times mass twice", "gravity left out", "rest lengths left out"]

# What a claim uses, and what takes its place: (module or SIMULATORS, name, stand-in).
SYMPLECTIC_MOTION = (integrators.SIMULATORS, "symplectic Euler",
                     partial(faulty_motion, faulty_symplectic))  # fmt: skip
RUNGE_KUTTA_MOTION = (integrators.SIMULATORS, "Runge-Kutta",
                      partial(faulty_motion, faulty_runge_kutta))  # fmt: skip
IMPLICIT_MOTION = (integrators.SIMULATORS, "implicit Euler",
                   partial(faulty_motion, faulty_implicit_step))  # fmt: skip

# For each claim: what its comparison uses and what takes its place, and the faults of that.
FAULTS = {
    "spring forces": ((force_claims, "spring_forces", faulty_springs), [*SPRING_FAULTS, LOOSE]),
    "damper forces": ((force_claims, "damper_forces", faulty_dampers),
        ["push", "dampers twice", "across the spring too", "pins with a velocity"]),
    "stiffness matrix": ((force_claims, "stiffness_matrix", faulty_stiffness),
        ["geometric term dropped", "geometric term with the wrong sign", "rest lengths left out",
         "negated", "one spring forgotten"]),
    "potential energy": ((force_claims, "potential_energy", faulty_potential),
        [*ENERGY_FAULTS, "pinned weights left out"]),
    "kinetic energy": ((force_claims, "kinetic_energy", faulty_kinetic),
        ["m |v|²", "pins counted", "mass left out"]),
    "flex forces": ((force_claims, "spring_forces", faulty_springs), SPRING_FAULTS),
    "flex energy": ((force_claims, "potential_energy", faulty_potential), ENERGY_FAULTS),
    "symplectic Euler step": ((steps, "symplectic_euler", faulty_symplectic),
        [*STEP_FAULTS, *DAMPER_FAULTS, LOOSE, "old velocities move", "pins fall"]),
    "symplectic Euler step, flex": ((steps, "symplectic_euler", faulty_symplectic),
        [*STEP_FAULTS, *DAMPER_FAULTS, "old velocities move", "pins fall"]),
    "symplectic Euler, 1,000 steps": (SYMPLECTIC_MOTION,
        ["gravity left out", "dampers twice", "old velocities move"]),
    "Runge-Kutta step": ((steps, "runge_kutta", faulty_runge_kutta),
        [*STEP_FAULTS, *DAMPER_FAULTS, "equal weights", "whole steps to the middle"]),
    "Runge-Kutta, 2,000 steps": (RUNGE_KUTTA_MOTION, ["equal weights"]),
    "damper diagonal step": ((steps, "semi_implicit", faulty_semi_implicit),
        [*STEP_FAULTS, LOOSE, "nothing implicit", "D twice", "D with the wrong sign",
         "the whole block", "old velocities move"]),
    "damper block step": ((steps, "semi_implicit", faulty_semi_implicit),
        ["nothing implicit", "D twice", "D with the wrong sign", "only the diagonal"]),
    "Gauss-Newton step": ((steps, "ImplicitEuler", faulty_euler),
        [*IMPLICIT_FAULTS, LOOSE, "velocities not recomputed", "the converged step"]),
    "Gauss-Newton step, damped": ((steps, "ImplicitEuler", faulty_euler), DAMPER_FAULTS),
    "implicit Euler on a line": ((integrators, "ImplicitEuler", faulty_euler),
        ["gravity times mass twice", "external forces left out", "dampers left out",
         "dampers twice", "velocities not recomputed"]),
    "implicit Euler balance": ((steps, "ImplicitEuler", faulty_euler),
        [*IMPLICIT_FAULTS, LOOSE, "one iteration"]),
    "implicit Euler balance, damped": ((steps, "ImplicitEuler", faulty_euler), DAMPER_FAULTS),
    "rope at rest, closed form": ((equilibria, "ImplicitEuler", faulty_euler), REST_FAULTS),
    "rope at rest": ((equilibria, "ImplicitEuler", faulty_euler), [*REST_FAULTS, "one iteration"]),
    "cloth at rest": ((equilibria, "ImplicitEuler", faulty_euler), ["gravity left out"]),
    "order of symplectic Euler": (SYMPLECTIC_MOTION, ["gravity left out", "dampers twice"]),
    "order of implicit Euler": (IMPLICIT_MOTION,
        ["dampers left out", "gravity times mass twice", "the trapezoid in its place"]),
    "order of Runge-Kutta": (RUNGE_KUTTA_MOTION, ["equal weights", "dampers twice"]),
    "order of MuJoCo's integrators": (RUNGE_KUTTA_MOTION, ["dampers twice"]),
    "order between implicit Euler and discrete": (IMPLICIT_MOTION,
        ["dampers twice", "external forces left out"]),
    "linear momentum": (SYMPLECTIC_MOTION,
        ["gravity times mass twice", "external forces left out", "springs pull one end only"]),
    "angular momentum": (SYMPLECTIC_MOTION,
        ["old velocities move", "dampers across the springs too", "springs pull one end only"]),
    "angular momentum lost by implicit Euler": (IMPLICIT_MOTION,
        ["the trapezoid in its place", "dampers across the springs too"]),
    "angular momentum lost by Runge-Kutta": (RUNGE_KUTTA_MOTION,
        ["equal weights", "dampers across the springs too"]),
    "energy lost on one spring": (IMPLICIT_MOTION,
        ["symplectic Euler in its place", "the trapezoid in its place"]),
}  # fmt: skip


def put(monkeypatch, claim, fault):
    (where, name, faulty), _ = FAULTS[claim]
    if where is integrators.SIMULATORS:
        monkeypatch.setitem(where, name, faulty(fault=fault))
    else:
        monkeypatch.setattr(where, name, partial(faulty, fault=fault))


def long(claim):
    """Whether a claim takes many steps, and therefore few cases."""
    return CLAIMS[claim].cases < 5


def few(claim):
    """Judge a few cases, or of many steps one."""
    return check_claim(CLAIMS[claim], 1 if long(claim) else FEW)


def cases_of_faults():
    """Every fault of every claim; of one that takes many steps only the first by default."""
    for claim, (_, faults) in FAULTS.items():
        for i, fault in enumerate(faults):
            marks = [pytest.mark.slow] if i and long(claim) else []
            yield pytest.param(claim, fault, marks=marks)


def copies():
    for claim in FAULTS:
        yield pytest.param(claim, marks=[pytest.mark.slow] if long(claim) else [])


@pytest.mark.parametrize(("claim", "fault"), list(cases_of_faults()))
def test_claim_goes_red_under_the_fault(monkeypatch, claim, fault):
    put(monkeypatch, claim, fault)
    assert few(claim).failure == "they differ"


@pytest.mark.parametrize("claim", list(copies()))
def test_without_a_fault_the_copy_holds(monkeypatch, claim):
    put(monkeypatch, claim, None)
    assert few(claim).holds


def test_every_claim_has_a_fault():
    assert {claim.name for claim in MASS_SPRING_CLAIMS} == set(FAULTS)
