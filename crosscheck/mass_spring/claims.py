"""The claims about mass-spring systems."""

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
)
from ..verdict import Claim, each_case
from . import balances, equilibria, forces, integrators, invariants, lines, orders, steps

MANY = 20  # cases: two rounds of all sizes from 5 to 500 particles
FEW = 10  # one round
TENDONS = "MuJoCo's spatial tendons"

FORCES = [
    Claim(
        "spring forces",
        "spring_forces: -k (l - r) u, none of slack tension-only springs",
        f"{TENDONS} with stiffness",
        each_case(forces.tendon_springs),
        FORCE,
        cases=MANY,
    ),
    Claim(
        "damper forces",
        "damper_forces: -c ((v_i - v_j)·u) u",
        f"{TENDONS} with damping",
        each_case(forces.tendon_dampers),
        FORCE,
        cases=MANY,
    ),
    Claim(
        "stiffness matrix",
        "stiffness_matrix, geometric terms included, times a direction",
        f"differences of the forces of {TENDONS}",
        each_case(forces.tendon_stiffness),
        STIFFNESS,
        cases=8,
    ),
    Claim(
        "potential energy",
        "potential_energy: springs and gravity",
        "MuJoCo's potential energy",
        each_case(forces.tendon_potential),
        ENERGY,
        cases=MANY,
    ),
    Claim(
        "kinetic energy",
        "kinetic_energy: m/2 |v|²",
        "MuJoCo's kinetic energy",
        each_case(forces.point_kinetic),
        ENERGY,
        cases=MANY,
    ),
    Claim(
        "flex forces",
        "spring_forces and damper_forces, all springs alike",
        "edges of MuJoCo's one-dimensional flex",
        each_case(forces.flex_forces),
        FORCE,
        cases=FEW,
    ),
    Claim(
        "flex energy",
        "potential_energy, all springs alike",
        "MuJoCo's potential energy of a one-dimensional flex",
        each_case(forces.flex_potential),
        ENERGY,
        cases=FEW,
    ),
]

STEPS = [
    Claim(
        "symplectic Euler step",
        "symplectic_euler with dampers and external forces",
        "MuJoCo's integrator Euler",
        each_case(steps.symplectic_steps),
        STEP,
        cases=MANY,
    ),
    Claim(
        "symplectic Euler step, flex",
        "symplectic_euler with dampers and external forces, all springs alike",
        "MuJoCo's integrator Euler on a one-dimensional flex",
        each_case(steps.flex_steps),
        STEP,
        cases=FEW,
    ),
    Claim(
        "symplectic Euler, 1,000 steps",
        "symplectic_euler with dampers and external forces",
        "MuJoCo's integrator Euler",
        each_case(partial(integrators.long_simulations, "symplectic Euler", "MuJoCo Euler", 1000)),
        MOTION,
        cases=4,
    ),
    Claim(
        "Runge-Kutta step",
        "runge_kutta with dampers and external forces",
        "MuJoCo's integrator RK4",
        each_case(steps.runge_kutta_steps),
        STEP,
        cases=MANY,
    ),
    Claim(
        "Runge-Kutta, 2,000 steps",
        "runge_kutta with dampers and external forces",
        "MuJoCo's integrator RK4",
        each_case(partial(integrators.long_simulations, "Runge-Kutta", "MuJoCo RK4", 2000)),
        MOTION,
        cases=1,
    ),
    Claim(
        "damper diagonal step",
        "(M + h diag(C)) dv = h f, springs explicit, with C from damping_matrix",
        "MuJoCo's integrator implicitfast, on bodies with a diagonal mass matrix",
        each_case(steps.damper_diagonal_steps),
        STEP,
        cases=MANY,
    ),
    Claim(
        "damper block step",
        "(M + h blockdiag3(C)) dv = h f, springs explicit, with C from damping_matrix",
        "MuJoCo's integrator implicit",
        each_case(steps.damper_block_steps),
        STEP,
        cases=MANY,
    ),
    Claim(
        "Gauss-Newton step",
        "ImplicitEuler, gauss_newton, without dampers",
        "MuJoCo's integrator discrete",
        each_case(partial(steps.gauss_newton_steps, damped=False)),
        STEP,
        cases=FEW,
    ),
    Claim(
        "Gauss-Newton step, damped",
        "ImplicitEuler, gauss_newton, with dampers",
        "MuJoCo's integrator discrete",
        each_case(partial(steps.gauss_newton_steps, damped=True)),
        STEP,
        cases=MANY,
    ),
    Claim(
        "implicit Euler on a line",
        "ImplicitEuler, newton, 100 steps of damped chains along x",
        "MuJoCo's integrator discrete on nested slide joints and hinges with springs",
        each_case(lines.joint_chains),
        LINE,
        cases=2,
    ),
    Claim(
        "implicit Euler balance",
        "ImplicitEuler, newton, converged: M (x - y)",
        "h² f(x) with MuJoCo's forces at our x",
        each_case(partial(balances.implicit_balances, damped=False)),
        BALANCE,
        cases=6,
    ),
    Claim(
        "implicit Euler balance, damped",
        "ImplicitEuler, newton, converged: M (x - y)",
        "h² f(x) with MuJoCo's forces at our x, dampers as tendons at rest length l_n",
        each_case(partial(balances.implicit_balances, damped=True)),
        BALANCE,
        cases=6,
    ),
]

RESTS = [
    Claim(
        "rope at rest, closed form",
        "Newton on the potential energy of a hanging rope, shaken",
        "each spring's load over its stiffness",
        each_case(equilibria.ropes_in_closed_form),
        REST,
        cases=3,
    ),
    Claim(
        "rope at rest",
        "Newton on the potential energy of a hanging rope, shaken",
        "where MuJoCo's Euler comes to rest under drag",
        each_case(equilibria.ropes),
        REST,
        cases=3,
    ),
    Claim(
        "cloth at rest",
        "Newton on the potential energy of the lab's cloth, fallen for 2 s",
        "where MuJoCo's Euler comes to rest under drag, from the same state",
        each_case(equilibria.cloths),
        REST,
        cases=2,
    ),
]

FIRST = ("MuJoCo Euler", "MuJoCo implicit", "MuJoCo implicitfast", "MuJoCo discrete")
LIMITS = [
    Claim(
        "order of symplectic Euler",
        "symplectic_euler as h is halved: order of its distance from the truth",
        "1, with MuJoCo's RK4 at h/8 as the truth",
        each_case(partial(orders.orders_to_the_limit, ["symplectic Euler"], 1, "MuJoCo RK4")),
        ORDER,
        cases=4,
    ),
    Claim(
        "order of implicit Euler",
        "ImplicitEuler, newton, as h is halved: order of its distance from the truth",
        "1, with MuJoCo's RK4 at h/8 as the truth",
        each_case(partial(orders.orders_to_the_limit, ["implicit Euler"], 1, "MuJoCo RK4")),
        ORDER,
        cases=2,
    ),
    Claim(
        "order of Runge-Kutta",
        "runge_kutta as h is halved: order of its distance from the truth",
        "4, with MuJoCo's RK4 at h/8 as the truth",
        each_case(partial(orders.orders_to_the_limit, ["Runge-Kutta"], 4, "MuJoCo RK4")),
        ORDER,
        cases=2,
    ),
    Claim(
        "order of MuJoCo's integrators",
        "runge_kutta at h/8 as the truth for MuJoCo's Euler, implicit, implicitfast, discrete",
        "1, as h is halved",
        each_case(partial(orders.orders_to_the_limit, FIRST, 1, "Runge-Kutta")),
        ORDER,
        cases=2,
    ),
    Claim(
        "order between implicit Euler and discrete",
        "ImplicitEuler, newton, and MuJoCo's discrete as h is halved: order of their distance",
        "1",
        each_case(partial(orders.orders_to_each_other, "implicit Euler", "MuJoCo discrete", 1)),
        ORDER,
        cases=2,
    ),
]

OURS = ("symplectic Euler", "Runge-Kutta", "implicit Euler", "Gauss-Newton")
INVARIANTS = [
    Claim(
        "linear momentum",
        f"momentum of a free system after 40 steps of {', '.join(OURS)}",
        "P + t F, springs and dampers giving nothing",
        each_case(partial(invariants.linear_momenta, OURS)),
        MOMENTUM,
        cases=2,
    ),
    Claim(
        "angular momentum",
        "angular momentum of a free system after 40 steps of symplectic_euler",
        "that before: positions move along the new velocities, forces along the springs",
        each_case(partial(invariants.angular_momenta, ["symplectic Euler"])),
        ENERGY,
        cases=4,
    ),
    Claim(
        "angular momentum lost by implicit Euler",
        "ImplicitEuler, newton, as h is halved: order of what it loses",
        "1",
        each_case(partial(invariants.angular_momentum_orders, "implicit Euler", 1)),
        ORDER,
        cases=2,
    ),
    Claim(
        "angular momentum lost by Runge-Kutta",
        "runge_kutta as h is halved: order of what it loses",
        "4",
        each_case(partial(invariants.angular_momentum_orders, "Runge-Kutta", 4)),
        ORDER,
        cases=2,
    ),
    Claim(
        "energy lost on one spring",
        "ImplicitEuler, newton, 40 steps of one spring: share of its energy left",
        "(1 + h² omega²)^-40",
        each_case(invariants.scalar_spring_energies),
        DECAY,
        cases=FEW,
    ),
]

MASS_SPRING_CLAIMS = [*FORCES, *STEPS, *RESTS, *LIMITS, *INVARIANTS]
