"""Let a cloth fall by implicit Euler; each step is proven to be near a minimum."""

import numpy as np

from plumbob import ImplicitEuler, scenes

cloth, state = scenes.lab_cloth(damping=0.2)
integrator = ImplicitEuler(cloth, h=1 / 60)  # Newton's method
for frame in range(10):
    result = integrator.step(state)
    proven = integrator.certify(state, result).distance
    lowest = np.min(result.state.positions[:, 1])  # y is up, as gravity says
    print(
        f"frame {frame}: {result.outcome.name} in {result.iterations} iterations, "
        f"lowest {lowest:.4f} m, a minimum within {proven:.1e} m"
    )
    state = result.state
