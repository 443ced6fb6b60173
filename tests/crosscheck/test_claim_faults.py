"""The claims go red where our side reads the skeleton, the system, the loads or h wrongly.

Each stand-in calls our own function with a faulty argument, so that it shows whether a claim
compares that function at all. How small a difference a claim sees is tested in `test_claims.py`.
"""

import numpy as np
import pytest

from plumbob.crosscheck import kinematics
from plumbob.crosscheck.claims import CLAIMS, MASS_SPRING_CLAIMS, TASK_CLAIMS, skeleton_claims
from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.mass_spring import equilibria, forces, integrators, steps
from plumbob.crosscheck.mass_spring.integrators import SIMULATORS
from plumbob.crosscheck.verdict import check_claim
from plumbob.reference import rotation, tasks
from plumbob.reference.mass_spring import MassSpring
from plumbob.reference.skeleton import Skeleton

# A chain and a tree; one pin and two, and a spring whose ends coincide; of many steps one case.
FEW = 2
PARTS = ("masses", "springs", "rest_lengths", "stiffnesses", "dampings", "pinned", "gravity",
         "tension_only")  # fmt: skip


def longer(skeleton):
    offsets = np.vstack([skeleton.offsets[:1], 1.001 * skeleton.offsets[1:]])
    return Skeleton(skeleton.parents, offsets, skeleton.names)


def altered(system, **changes):
    return MassSpring(**{name: changes.get(name, getattr(system, name)) for name in PARTS})


def first_removed(system):
    return np.where(np.arange(len(system.springs)) > 0, system.stiffnesses, 0.0)


# What a stand-in does to the arguments of our function: the model and whatever comes after it.
FAULTS = {
    "w last": lambda skeleton, q, *rest: (skeleton, np.roll(q, -1, axis=-1), *rest),
    "rotations inverted": lambda skeleton, q, *rest: (skeleton, rotation.conjugate(q), *rest),
    "longer links": lambda skeleton, *rest: (longer(skeleton), *rest),
    "gravity left out": lambda s, *rest: (altered(s, gravity=(0, 0, 0)), *rest),
    "rest lengths left out": lambda s, *rest: (altered(s, rest_lengths=0.0), *rest),
    "slack springs push": lambda s, *rest: (altered(s, tension_only=~s.tension_only), *rest),
    "springs twice": lambda s, *rest: (altered(s, stiffnesses=2.0 * s.stiffnesses), *rest),
    "one spring forgotten": lambda s, *rest: (altered(s, stiffnesses=first_removed(s)), *rest),
    "dampers left out": lambda s, *rest: (altered(s, dampings=0.0), *rest),
    "dampers twice": lambda s, *rest: (altered(s, dampings=2.0 * s.dampings), *rest),
    "masses of one": lambda s, *rest: (altered(s, masses=np.ones(len(s.masses))), *rest),
    "pins free": lambda s, *rest: (altered(s, pinned=()), *rest),
    "h halved": lambda s, state, h, *rest: (s, state, h / 2.0, *rest),
    "loads left out": lambda s, state, h, loads, *rest: (s, state, h, 0.0 * loads, *rest),
    "order of the step": lambda s, h: (s, h / 2.0),
    "coordinates negated": lambda model, q: (model, -q),
    "masses equal": lambda masses, *rest: (np.ones(len(masses)), *rest),
    "centres left out": lambda masses, centres, *rest: (masses, 0.0 * centres, *rest),
    "": lambda *arguments: arguments,
}
SYSTEM = ("gravity left out", "rest lengths left out", "dampers twice", "masses of one")
STEP = (*SYSTEM, "slack springs push", "pins free", "h halved", "loads left out")
EULER = ("gravity left out", "rest lengths left out", "masses of one")

# For each claim: where our function is, its name, and the faults of its arguments.
PLANTED = {
    "joint positions": (kinematics, "forward_kinematics", ("w last", "longer links")),
    "joint rotations": (kinematics, "forward_kinematics", ("w last", "rotations inverted")),
    "local rotations": (kinematics, "local_from_global", ("w last", "rotations inverted")),
    "IK answers": (kinematics, "solve_ik", ("longer links",)),
    "task frames": (tasks, "configuration", ("coordinates negated",)),
    "task centre of mass": (tasks, "CentreOfMass", ("masses equal", "centres left out")),
    "task look-at": (tasks, "configuration", ("coordinates negated",)),
    "task posture": (tasks, "configuration", ("coordinates negated",)),
    "task closures": (tasks, "configuration", ("coordinates negated",)),
    "task equalities": (tasks, "configuration", ("coordinates negated",)),
    "spring forces": (forces, "spring_forces", ("springs twice", "rest lengths left out",
                      "one spring forgotten", "slack springs push")),
    "damper forces": (forces, "damper_forces", ("dampers twice", "pins free")),
    "stiffness matrix": (forces, "stiffness_matrix", ("springs twice", "rest lengths left out",
                         "one spring forgotten")),
    "potential energy": (forces, "potential_energy", ("springs twice", "gravity left out",
                         "masses of one")),
    "kinetic energy": (forces, "kinetic_energy", ("masses of one", "pins free")),
    "flex forces": (forces, "spring_forces", ("springs twice", "one spring forgotten")),
    "flex energy": (forces, "potential_energy", ("springs twice", "gravity left out")),
    "symplectic Euler step": (steps, "symplectic_euler", STEP),
    "symplectic Euler step, flex": (steps, "symplectic_euler", (*SYSTEM, "h halved")),
    "Runge-Kutta step": (steps, "runge_kutta", STEP),
    "damper diagonal step": (steps, "semi_implicit", STEP),
    "damper block step": (steps, "semi_implicit", STEP),
    "Gauss-Newton step": (steps, "ImplicitEuler", (*EULER, "slack springs push", "pins free")),
    "Gauss-Newton step, damped": (steps, "ImplicitEuler", ("dampers left out", "dampers twice")),
    "implicit Euler balance": (steps, "ImplicitEuler", (*EULER, "slack springs push")),
    "implicit Euler balance, damped": (steps, "ImplicitEuler", ("dampers left out",
                                       "dampers twice")),
    "implicit Euler on a line": (integrators, "ImplicitEuler", ("dampers twice", "masses of one")),
    "rope at rest, closed form": (equilibria, "ImplicitEuler", EULER),
    "rope at rest": (equilibria, "ImplicitEuler", EULER),
    "cloth at rest": (equilibria, "ImplicitEuler", ("gravity left out",)),
    "symplectic Euler, 1,000 steps": (SIMULATORS, "symplectic Euler", ("dampers twice",)),
    "Runge-Kutta, 2,000 steps": (SIMULATORS, "Runge-Kutta", ("dampers twice",)),
    "order of symplectic Euler": (SIMULATORS, "symplectic Euler", ("dampers twice",)),
    "order of implicit Euler": (SIMULATORS, "implicit Euler", ("dampers left out",)),
    "order of Runge-Kutta": (SIMULATORS, "Runge-Kutta", ("dampers twice",)),
    "order of MuJoCo's integrators": (SIMULATORS, "Runge-Kutta", ("dampers twice",)),
    "order between implicit Euler and discrete": (SIMULATORS, "implicit Euler", ("dampers twice",)),
    "linear momentum": (SIMULATORS, "symplectic Euler", ("masses of one",)),
    "angular momentum": (SIMULATORS, "symplectic Euler", ("masses of one",)),
    "angular momentum lost by implicit Euler": (SIMULATORS, "implicit Euler", ("masses of one",)),
    "angular momentum lost by Runge-Kutta": (SIMULATORS, "Runge-Kutta", ("masses of one",)),
    "energy lost on one spring": (SIMULATORS, "implicit Euler", ("order of the step",)),
}  # fmt: skip


def plant(monkeypatch, quantity, fault):
    """Let our function read its arguments as the fault has them."""
    place, name, _ = PLANTED[quantity]
    is_table = isinstance(place, dict)
    function = place[name] if is_table else getattr(place, name)

    def faulty(*arguments, **options):
        return function(*FAULTS[fault](*arguments), **options)

    (monkeypatch.setitem if is_table else monkeypatch.setattr)(place, name, faulty)


def claims_of(quantity):
    names = [name for name in CLAIMS if name.removesuffix(f", {engine_of(name)}") == quantity]
    return [CLAIMS[name] for name in names]


def engine_of(name):
    return next((engine for engine in SKELETON_ENGINES if name.endswith(f", {engine}")), "")


def is_long(quantity):
    return claims_of(quantity)[0].cases < 5


def parameters():
    """Every fault of every claim, of one that takes many steps only the first by default."""
    for quantity, (*_, faults) in PLANTED.items():
        for i, fault in enumerate(faults):
            marks = [pytest.mark.slow] if i and is_long(quantity) else []
            yield pytest.param(quantity, fault, marks=marks)


@pytest.mark.parametrize(("quantity", "fault"), list(parameters()))
def test_claim_goes_red_under_the_fault(monkeypatch, quantity, fault):
    plant(monkeypatch, quantity, fault)
    for claim in claims_of(quantity):
        assert check_claim(claim, 1 if is_long(quantity) else FEW).failure == "they differ"


@pytest.mark.parametrize("quantity", [name for name in PLANTED if not is_long(name)])
def test_without_a_fault_the_stand_in_holds(monkeypatch, quantity):
    plant(monkeypatch, quantity, "")
    assert all(check_claim(claim, FEW).holds for claim in claims_of(quantity))


def test_every_claim_has_a_fault():
    claims = [
        *MASS_SPRING_CLAIMS,
        *TASK_CLAIMS,
        *(c for e in SKELETON_ENGINES for c in skeleton_claims(e)),
    ]
    assert {claim.name for claim in claims} == {c.name for q in PLANTED for c in claims_of(q)}


def test_positions_of_a_skeleton_are_over_the_longest_way_from_its_root():
    """Two branches of three and of four metres; the root's own offset does not count."""
    parents, lengths = [-1, 0, 1, 0, 3, 3], [9.0, 1.0, 2.0, 3.0, 1.0, 0.5]
    tree = Skeleton(parents, np.outer(lengths, [0.6, 0.0, 0.8]))
    assert kinematics.full_reach(tree) == pytest.approx(4.0)
