"""Draw the pictures of README.md and of docs: `python tools/draw_lab.py`."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from plumbob.bench.experiments import pictures
from plumbob.bench.figures.sketch import drawn
from plumbob.bench.measure.block import SCALES
from plumbob.bench.measure.measure import record_of
from plumbob.bench.tables.results import Results
from plumbob.reference import ImplicitEuler, scenes

DOCS = Path(__file__).parents[1] / "docs"
H = 1 / 60
STYLES = {1e2: ("#0b7a5b", "o"), 1e4: ("#c4500c", "s"), 1e6: ("#8a4a9f", "^")}
ITERATIONS = 60


def draw_scene(scene: str, name: str, *options: str, folder: Path = DOCS) -> None:
    """Draw a scene by `plumbob show`, run in a folder."""
    plumbob = Path(sys.executable).with_name("plumbob")
    command = [plumbob, "show", scene, *options, "-o", DOCS / name]
    subprocess.run(command, check=True, cwd=folder)


def draw_heart_beside(name: str) -> None:
    """Draw the heart by the solver of docs/show.md beside ours."""
    page = (DOCS / "show.md").read_text(encoding="utf-8")
    source = re.search(r"```python\n(# my_ik.py\n.*?)```", page, re.DOTALL)
    assert source
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "my_ik.py").write_text(source[1], encoding="utf-8")
        draw_scene("heart", name, "--with", "my_ik.py", folder=Path(folder))


def draw_plumb_bob(name: str) -> None:
    """Draw the custom curve as the report does, before and after resampling."""
    records = [
        record_of(block, block.measure(), 0.0)
        for block in pictures.blocks(SCALES["quick"])
        if block.facts["task"] == pictures.ARM
    ]
    sketch = pictures.arm_draws(Results(records))
    assert sketch
    paper = '<rect width="100%" height="100%" fill="white"/>\n <defs>'
    text = drawn(sketch).svg.replace("<defs>", paper, 1)
    (DOCS / name).write_text(text, encoding="utf-8")


def shorten(path: Path) -> None:
    """Write the numbers of a picture to a hundredth of a point."""
    text = path.read_text(encoding="utf-8")
    short = re.sub(r"\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", text)
    path.write_text(short, encoding="utf-8")


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
    draw_heart_beside("show_with.svg")
    draw_plumb_bob("plumb_bob.svg")
    for path in DOCS.glob("*_*.svg"):
        shorten(path)
