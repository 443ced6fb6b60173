"""Draw the pictures of docs/lab.md: `python docs/draw_lab.py`."""

import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from reference import ImplicitEuler, scenes

DOCS = Path(__file__).parent
H = 1 / 60
STYLES = {1e2: ("#0b7a5b", "o"), 1e4: ("#c4500c", "s"), 1e6: ("#8a4a9f", "^")}
ITERATIONS = 60


def draw_scene(scene: str, name: str) -> None:
    """Draw four moments of a scene by `plumbob show`."""
    plumbob = Path(sys.executable).with_name("plumbob")
    subprocess.run([plumbob, "show", scene, "-o", DOCS / name], check=True)


def distances(stiffness: float) -> np.ndarray:
    """Return how far each local/global iterate is from a step of the lab's cloth, over y."""
    cloth, state = scenes.lab_cloth(stiffness=stiffness)
    newton = ImplicitEuler(cloth, h=H, tolerance=1e-12)
    for _ in range(30):
        state = newton.step(state).state
    exact = newton.step(state).state.positions
    found = []
    iterates = ImplicitEuler(cloth, h=H, solver="local_global").iterates(state)
    for iterate, _ in zip(iterates, range(ITERATIONS + 1), strict=False):
        found.append(np.linalg.norm(iterate.positions - exact))
    return np.array(found) / found[0]


def draw_convergence(name: str) -> None:
    """Draw the distance to the converged step over the iterations."""
    settings = {"svg.fonttype": "none", "svg.hashsalt": "plumbob", "font.size": 9}
    with mpl.rc_context(settings):
        figure = Figure(figsize=(5.6, 3.2), layout="constrained")
        axes = figure.subplots()
        for stiffness, (colour, marker) in STYLES.items():
            label = f"k = {stiffness:,.0f} N/m"
            axes.semilogy(distances(stiffness), color=colour, marker=marker, ms=3, label=label)
        axes.set(xlabel="local/global iterations", ylabel="distance to the step, over that of y")
        axes.set_ylim(1e-10, 3.0)
        axes.grid(color="#d5d9df")
        axes.legend(frameon=False)
        figure.savefig(DOCS / name, metadata={"Date": None}, facecolor="white")


if __name__ == "__main__":
    draw_scene("heart", "lab_arm.svg")
    draw_scene("cloth", "lab_cloth.svg")
    draw_convergence("lab_convergence.svg")
