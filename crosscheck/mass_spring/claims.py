"""The claims about mass-spring systems."""

from collections.abc import Callable
from functools import partial

from ..tolerances import (
    BALANCE,
    DECAY,
    ENERGY,
    FORCE,
    LINE,
    MOMENTUM,
    MOTION,
    ORDER,
    REST,
    STEP,
    STIFFNESS,
    Tolerance,
)
from ..verdict import Claim, Comparison, each_case
from . import balances, equilibria, forces, integrators, invariants, lines, orders, steps

MANY = 20  # cases: two rounds of all sizes from 5 to 500 particles
FEW = 10  # one round
TENDONS = "MuJoCo's spatial tendons"


def _claims(
    *rows: tuple[str, str, str, Callable[[int], Comparison], Tolerance, int],
) -> list[Claim]:
    """Return claims of their name, our quantity, theirs, comparison, tolerance and cases."""
    return [
        Claim(name, ours, theirs, each_case(compare), tolerance, cases)
        for name, ours, theirs, compare, tolerance, cases in rows
    ]


FORCES = _claims(
    ("spring forces", "spring_forces: -k (l - r) u, none of slack tension-only springs",
     f"{TENDONS} with stiffness", forces.tendon_springs, FORCE, MANY),
    ("damper forces", "damper_forces: -c ((v_i - v_j)·u) u", f"{TENDONS} with damping",
     forces.tendon_dampers, FORCE, MANY),
    ("stiffness matrix", "stiffness_matrix, geometric terms included, times a direction",
     f"differences of the forces of {TENDONS}", forces.tendon_stiffness, STIFFNESS, 8),
    ("potential energy", "potential_energy: springs and gravity", "MuJoCo's potential energy",
     forces.tendon_potential, ENERGY, MANY),
    ("kinetic energy", "kinetic_energy: m/2 |v|²", "MuJoCo's kinetic energy", forces.point_kinetic,
     ENERGY, MANY),
    ("flex forces", "spring_forces and damper_forces, all springs alike",
     "edges of MuJoCo's one-dimensional flex", forces.flex_forces, FORCE, FEW),
    ("flex energy", "potential_energy, all springs alike",
     "MuJoCo's potential energy of a one-dimensional flex", forces.flex_potential, ENERGY, FEW),
)  # fmt: skip

STEPS = _claims(
    ("symplectic Euler step", "symplectic_euler with dampers and external forces",
     "MuJoCo's integrator Euler", steps.symplectic_steps, STEP, MANY),
    ("symplectic Euler step, flex",
     "symplectic_euler with dampers and external forces, all springs alike",
     "MuJoCo's integrator Euler on a one-dimensional flex", steps.flex_steps, STEP, FEW),
    ("symplectic Euler, 1,000 steps", "symplectic_euler with dampers and external forces",
     "MuJoCo's integrator Euler",
     partial(integrators.long_simulations, "symplectic Euler", "MuJoCo Euler", 1000), MOTION, 4),
    ("Runge-Kutta step", "runge_kutta with dampers and external forces", "MuJoCo's integrator RK4",
     steps.runge_kutta_steps, STEP, MANY),
    ("Runge-Kutta, 2,000 steps", "runge_kutta with dampers and external forces",
     "MuJoCo's integrator RK4",
     partial(integrators.long_simulations, "Runge-Kutta", "MuJoCo RK4", 2000), MOTION, 1),
    ("damper diagonal step",
     "(M + h diag(C)) dv = h f, springs explicit, with C from damping_matrix",
     "MuJoCo's integrator implicitfast, on bodies with a diagonal mass matrix",
     steps.damper_diagonal_steps, STEP, MANY),
    ("damper block step",
     "(M + h blockdiag3(C)) dv = h f, springs explicit, with C from damping_matrix",
     "MuJoCo's integrator implicit", steps.damper_block_steps, STEP, MANY),
    ("Gauss-Newton step", "ImplicitEuler, gauss_newton, without dampers",
     "MuJoCo's integrator discrete", partial(steps.gauss_newton_steps, damped=False), STEP, FEW),
    ("Gauss-Newton step, damped", "ImplicitEuler, gauss_newton, with dampers",
     "MuJoCo's integrator discrete", partial(steps.gauss_newton_steps, damped=True), STEP, MANY),
    ("implicit Euler on a line", "ImplicitEuler, newton, 100 steps of damped chains along x",
     "MuJoCo's integrator discrete on nested slide joints and hinges with springs",
     lines.joint_chains, LINE, 2),
    ("implicit Euler balance", "ImplicitEuler, newton, converged: M (x - y)",
     "h² f(x) with MuJoCo's forces at our x", partial(balances.implicit_balances, damped=False),
     BALANCE, 6),
    ("implicit Euler balance, damped", "ImplicitEuler, newton, converged: M (x - y)",
     "h² f(x) with MuJoCo's forces at our x, dampers as tendons at rest length l_n",
     partial(balances.implicit_balances, damped=True), BALANCE, 6),
)  # fmt: skip

RESTS = _claims(
    ("rope at rest, closed form", "Newton on the potential energy of a hanging rope, shaken",
     "each spring's load over its stiffness", equilibria.ropes_in_closed_form, REST, 3),
    ("rope at rest", "Newton on the potential energy of a hanging rope, shaken",
     "where MuJoCo's Euler comes to rest under drag", equilibria.ropes, REST, 3),
    ("cloth at rest", "Newton on the potential energy of the lab's cloth, fallen for 2 s",
     "where MuJoCo's Euler comes to rest under drag, from the same state", equilibria.cloths, REST,
     2),
)  # fmt: skip

FIRST = ("MuJoCo Euler", "MuJoCo implicit", "MuJoCo implicitfast", "MuJoCo discrete")
LIMITS = _claims(
    ("order of symplectic Euler",
     "symplectic_euler as h is halved: order of its distance from the truth",
     "1, with MuJoCo's RK4 at h/8 as the truth",
     partial(orders.orders_to_the_limit, ["symplectic Euler"], 1, "MuJoCo RK4"), ORDER, 4),
    ("order of implicit Euler",
     "ImplicitEuler, newton, as h is halved: order of its distance from the truth",
     "1, with MuJoCo's RK4 at h/8 as the truth",
     partial(orders.orders_to_the_limit, ["implicit Euler"], 1, "MuJoCo RK4"), ORDER, 2),
    ("order of Runge-Kutta", "runge_kutta as h is halved: order of its distance from the truth",
     "4, with MuJoCo's RK4 at h/8 as the truth",
     partial(orders.orders_to_the_limit, ["Runge-Kutta"], 4, "MuJoCo RK4"), ORDER, 2),
    ("order of MuJoCo's integrators",
     "runge_kutta at h/8 as the truth for MuJoCo's Euler, implicit, implicitfast, discrete",
     "1, as h is halved", partial(orders.orders_to_the_limit, FIRST, 1, "Runge-Kutta"), ORDER, 2),
    ("order between implicit Euler and discrete",
     "ImplicitEuler, newton, and MuJoCo's discrete as h is halved: order of their distance", "1",
     partial(orders.orders_to_each_other, "implicit Euler", "MuJoCo discrete", 1), ORDER, 2),
)  # fmt: skip

OURS = ("symplectic Euler", "Runge-Kutta", "implicit Euler", "Gauss-Newton")
INVARIANTS = _claims(
    ("linear momentum", f"momentum of a free system after 40 steps of {', '.join(OURS)}",
     "P + t F, springs and dampers giving nothing", partial(invariants.linear_momenta, OURS),
     MOMENTUM, 2),
    ("angular momentum", "angular momentum of a free system after 40 steps of symplectic_euler",
     "that before: positions move along the new velocities, forces along the springs",
     partial(invariants.angular_momenta, ["symplectic Euler"]), ENERGY, 4),
    ("angular momentum lost by implicit Euler",
     "ImplicitEuler, newton, as h is halved: order of what it loses", "1",
     partial(invariants.angular_momentum_orders, "implicit Euler", 1), ORDER, 2),
    ("angular momentum lost by Runge-Kutta", "runge_kutta as h is halved: order of what it loses",
     "4", partial(invariants.angular_momentum_orders, "Runge-Kutta", 4), ORDER, 2),
    ("energy lost on one spring",
     "ImplicitEuler, newton, 40 steps of one spring: share of its energy left",
     "(1 + h² omega²)^-40", invariants.scalar_spring_energies, DECAY, FEW),
)  # fmt: skip

MASS_SPRING_CLAIMS = [*FORCES, *STEPS, *RESTS, *LIMITS, *INVARIANTS]
