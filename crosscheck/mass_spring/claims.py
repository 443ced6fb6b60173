"""The claims about mass-spring systems: `claims.toml` with the comparison behind each."""

import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path

from ..tolerances import TOLERANCES
from ..verdict import Claim, Comparison, each_case
from . import equilibria, forces, integrators, orders, steps

OUR_INTEGRATORS = ("symplectic Euler", "Runge-Kutta", "implicit Euler", "Gauss-Newton")
FIRST_ORDER = ("MuJoCo Euler", "MuJoCo implicit", "MuJoCo implicitfast", "MuJoCo discrete")

COMPARISONS: dict[str, Callable[[int], Comparison]] = {
    "spring forces": partial(forces.tendon_forces, "springs"),
    "damper forces": partial(forces.tendon_forces, "dampers"),
    "stiffness matrix": forces.tendon_stiffness,
    "potential energy": forces.tendon_potential,
    "kinetic energy": forces.point_kinetic,
    "flex forces": forces.flex_forces,
    "flex energy": forces.flex_potential,
    "symplectic Euler step": partial(steps.explicit_steps, "Euler"),
    "symplectic Euler step, flex": steps.flex_steps,
    "symplectic Euler, 1,000 steps": partial(
        integrators.compare_long_runs, "symplectic Euler", "MuJoCo Euler", 1000
    ),
    "Runge-Kutta step": partial(steps.explicit_steps, "RK4"),
    "Runge-Kutta, 2,000 steps": partial(
        integrators.compare_long_runs, "Runge-Kutta", "MuJoCo RK4", 2000
    ),
    "damper diagonal step": partial(steps.damper_steps, "implicitfast"),
    "damper block step": partial(steps.damper_steps, "implicit"),
    "Gauss-Newton step": partial(steps.gauss_newton_steps, damped=False),
    "Gauss-Newton step, damped": partial(steps.gauss_newton_steps, damped=True),
    "implicit Euler on a line": integrators.joint_chains,
    "implicit Euler balance": partial(steps.implicit_balances, damped=False),
    "implicit Euler balance, damped": partial(steps.implicit_balances, damped=True),
    "rope at rest, closed form": equilibria.ropes_in_closed_form,
    "rope at rest": equilibria.ropes,
    "cloth at rest": equilibria.cloths,
    "order of symplectic Euler": partial(
        orders.orders_to_the_limit, ["symplectic Euler"], 1, "MuJoCo RK4"
    ),
    "order of implicit Euler": partial(
        orders.orders_to_the_limit, ["implicit Euler"], 1, "MuJoCo RK4"
    ),
    "order of Runge-Kutta": partial(orders.orders_to_the_limit, ["Runge-Kutta"], 4, "MuJoCo RK4"),
    "order of MuJoCo's integrators": partial(
        orders.orders_to_the_limit, FIRST_ORDER, 1, "Runge-Kutta"
    ),
    "order between implicit Euler and discrete": partial(
        orders.orders_to_each_other, "implicit Euler", "MuJoCo discrete", 1
    ),
    "linear momentum": partial(orders.linear_momenta, OUR_INTEGRATORS),
    "angular momentum": partial(orders.angular_momenta, ["symplectic Euler"]),
    "angular momentum lost by implicit Euler": partial(
        orders.angular_momentum_orders, "implicit Euler", 1
    ),
    "angular momentum lost by Runge-Kutta": partial(
        orders.angular_momentum_orders, "Runge-Kutta", 4
    ),
    "energy lost on one spring": orders.scalar_spring_energies,
}

MASS_SPRING_CLAIMS = [
    Claim(
        name,
        compare=each_case(COMPARISONS[name]),
        **fields | {"tolerance": TOLERANCES[fields["tolerance"]]},
    )
    for name, fields in tomllib.loads(
        Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    ).items()
]
