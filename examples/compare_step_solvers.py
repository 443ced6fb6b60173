"""Take one step of a cloth by every solver and compare it with Newton's."""

import numpy as np

from plumbob import STEP_SOLVERS, ImplicitEuler, scenes

cloth, state = scenes.lab_cloth()
exact = ImplicitEuler(cloth, h=1 / 60, solver="newton", tolerance=1e-12).step(state)
for solver in STEP_SOLVERS:
    result = ImplicitEuler(cloth, h=1 / 60, solver=solver).step(state)
    distance = np.linalg.norm(result.state.positions - exact.state.positions, axis=1).max()
    print(
        f"{solver:14} {result.outcome.name:14} {result.iterations:4} iterations, "
        f"{distance:.1e} m from Newton's"
    )
