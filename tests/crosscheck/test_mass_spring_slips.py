"""The claims about mass-spring systems go red under the slips that real solutions make."""

import dataclasses
from functools import partial

import numpy as np
import pytest

from crosscheck import mass_spring
from crosscheck.identities import CLAIMS, MASS_SPRING_CLAIMS
from crosscheck.verdict import judge
from reference.explicit import symplectic_euler
from reference.implicit_euler import ImplicitEuler
from reference.mass_spring import (
    MassSpring,
    State,
    damper_forces,
    forces,
    kinetic_energy,
    potential_energy,
    spring_energy,
    spring_forces,
)

# One pin and two, and a spring whose ends coincide.
FEW = 2

# Slips in the model or the forces: (system, state, h, external) -> (system, external).
MODEL_SLIPS = {
    "gravity times mass twice": lambda s, state, h, f: (s, f + (s.masses - 1)[:, None] * weight(s)),
    "gravity left out": lambda s, state, h, f: (altered(s, gravity=(0, 0, 0)), f),
    "gravity without h²": lambda s, state, h, f: (altered(s, gravity=s.gravity / h**2), f),
    "rest lengths left out": lambda s, state, h, f: (altered(s, rest_lengths=0.0), f),
    "L in place of M + h² L": lambda s, state, h, f: (
        altered(s, masses=1e-9 * s.masses, gravity=(0, 0, 0)),
        f + weight(s),
    ),
    "external forces left out": lambda s, state, h, f: (s, 0.0 * f),
    "dampers left out": lambda s, state, h, f: (altered(s, dampings=0.0), f),
    "dampers twice": lambda s, state, h, f: (altered(s, dampings=2 * s.dampings), f),
    "dampers push": lambda s, state, h, f: (s, f - 2.0 * damper_forces(s, state)),
}


def altered(system, **changes):
    names = ["masses", "springs", "rest_lengths", "stiffnesses", "dampings", "pinned", "gravity"]
    return MassSpring(**{name: changes.get(name, getattr(system, name)) for name in names})


def weight(system):
    return system.masses[:, None] * system.gravity


def slipped_springs(system, positions, *, slip):
    pulls = spring_forces(system, positions)
    if slip == "push":
        return -pulls
    if slip == "twice":
        return spring_forces(altered(system, stiffnesses=2 * system.stiffnesses), positions)
    if slip == "rest lengths left out":
        return spring_forces(altered(system, rest_lengths=0.0), positions)
    if slip == "one spring forgotten":
        k = np.where(np.arange(len(system.springs)) == 0, 0.0, system.stiffnesses)
        return spring_forces(altered(system, stiffnesses=k), positions)
    return pulls


def slipped_dampers(system, state, *, slip):
    pulls = damper_forces(system, state)
    if slip == "across the spring too":
        v = np.where(system.free[:, None], state.velocities, 0.0)
        i, j = system.springs.T
        pulls = np.zeros_like(v)
        np.add.at(pulls, i, -system.dampings[:, None] * (v[i] - v[j]))
        np.add.at(pulls, j, system.dampings[:, None] * (v[i] - v[j]))
    if slip == "pins with a velocity":
        return damper_forces(altered(system, pinned=()), state)
    return {"push": -1.0, "twice": 2.0}.get(slip, 1.0) * pulls


def slipped_potential(system, positions, *, slip):
    energy, springs = potential_energy(system, positions), spring_energy(system, positions)
    gravity = energy - springs
    if slip == "pinned weights left out":
        return energy + np.sum((weight(system) * positions)[system.pinned])
    if slip == "gravity times mass twice":
        return springs - np.sum(system.masses[:, None] * weight(system) * positions)
    return {"k (l - r)²": energy + springs, "gravity upwards": springs - gravity}.get(slip, energy)


def slipped_kinetic(system, state, *, slip):
    energy = kinetic_energy(system, state)
    pins = kinetic_energy(altered(system, pinned=()), state)
    massless = 0.5 * np.sum(state.velocities[system.free] ** 2)
    return {"m |v|²": 2 * energy, "pins counted": pins, "mass left out": massless}.get(slip, energy)


def slipped_symplectic(system, state, h, external, *, slip):
    model, given = MODEL_SLIPS.get(slip, lambda *same: (same[0], same[3]))(
        system, state, h, external
    )
    end = symplectic_euler(model, state, h, given)
    x, pins = end.positions.copy(), system.pinned
    if slip == "old velocities move":
        x[system.free] = (state.positions + h * state.velocities)[system.free]
    if slip == "pins fall":
        pull = forces(system, state, external) / system.masses[:, None]
        x[pins] += h * h * pull[pins]
    return State(x, end.velocities)


def slipped_euler(system, *, h, slip, **settings):
    """Stand in for ImplicitEuler, with one slip in model, settings or result."""
    settings |= {
        "one iteration": {"max_iterations": 1},
        "one local/global iteration": {"solver": "local_global", "max_iterations": 1},
        "the converged step": {"solver": "newton", "max_iterations": 30},
    }.get(slip, {})
    return _SlippedEuler(system, h, slip, settings)


@dataclasses.dataclass
class _SlippedEuler:
    system: MassSpring
    h: float
    slip: str | None
    settings: dict

    def step(self, state, external):
        change = MODEL_SLIPS.get(self.slip, lambda *same: (same[0], same[3]))
        model, given = change(self.system, state, self.h, external)
        if self.slip == "pins put back after the solve":
            model = altered(model, pinned=())
        result = ImplicitEuler(model, h=self.h, **self.settings).step(state, given)
        x, v = result.state.positions.copy(), result.state.velocities.copy()
        if self.slip == "pins put back after the solve":
            x[self.system.pinned], v[self.system.pinned] = state.positions[self.system.pinned], 0.0
        if self.slip == "velocities not recomputed":
            v = state.velocities
        return dataclasses.replace(result, state=State(x, v))


STEP_SLIPS = [
    "gravity times mass twice",
    "gravity left out",
    "rest lengths left out",
    "external forces left out",
]
IMPLICIT_SLIPS = [
    *STEP_SLIPS,
    "gravity without h²",
    "L in place of M + h² L",
    "pins put back after the solve",
    "one local/global iteration",
]
DAMPER_SLIPS = ["dampers left out", "dampers twice", "dampers push"]

# For each claim: the name that its comparison uses, what takes its place, and the slips of that.
SLIPS = {
    "spring forces": (
        "spring_forces",
        slipped_springs,
        ["push", "twice", "rest lengths left out", "one spring forgotten"],
    ),
    "damper forces": (
        "damper_forces",
        slipped_dampers,
        ["push", "twice", "across the spring too", "pins with a velocity"],
    ),
    "potential energy": (
        "potential_energy",
        slipped_potential,
        ["k (l - r)²", "gravity upwards", "gravity times mass twice", "pinned weights left out"],
    ),
    "kinetic energy": (
        "kinetic_energy",
        slipped_kinetic,
        ["m |v|²", "pins counted", "mass left out"],
    ),
    "symplectic Euler step": (
        "symplectic_euler",
        slipped_symplectic,
        [*STEP_SLIPS, *DAMPER_SLIPS, "old velocities move", "pins fall"],
    ),
    "Gauss-Newton step": (
        "ImplicitEuler",
        slipped_euler,
        [*IMPLICIT_SLIPS, "velocities not recomputed", "the converged step"],
    ),
    "Gauss-Newton step, damped": ("ImplicitEuler", slipped_euler, DAMPER_SLIPS),
    "implicit Euler balance": (
        "ImplicitEuler",
        slipped_euler,
        [*IMPLICIT_SLIPS, "one iteration"],
    ),
    "implicit Euler balance, damped": ("ImplicitEuler", slipped_euler, DAMPER_SLIPS),
}


@pytest.mark.parametrize(
    ("claim", "slip"), [(claim, slip) for claim in SLIPS for slip in SLIPS[claim][2]]
)
def test_claim_goes_red_under_the_slip(monkeypatch, claim, slip):
    name, slipped, _ = SLIPS[claim]
    monkeypatch.setattr(mass_spring, name, partial(slipped, slip=slip))
    assert judge(CLAIMS[claim], FEW).missed == "they differ"


@pytest.mark.parametrize("claim", SLIPS)
def test_without_a_slip_the_copy_holds(monkeypatch, claim):
    name, slipped, _ = SLIPS[claim]
    monkeypatch.setattr(mass_spring, name, partial(slipped, slip=None))
    assert judge(CLAIMS[claim], FEW).held


def test_every_claim_has_a_slip():
    assert {claim.name for claim in MASS_SPRING_CLAIMS} == set(SLIPS)
