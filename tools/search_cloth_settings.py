"""Search the settings of every cloth solver on a tuning cloth; print a table in Markdown.

The cloth, 16 x 16 particles at 3,000 N/m, is in no published table. Each solver takes three frames
with at most 64 settings. A setting is better if its motion ends within 1 % of the distance that
the cloth moved from the truth, and among those if its frames take less time. The table lists the
settings that no other beats in both. On a quiet machine: `python tools/search_cloth_settings.py`.
"""

import importlib
import timeit

import numpy as np

from plumbob.bench.peers import catalogue
from plumbob.bench.peers.peer import EXPLICIT, ITERATED, LINEARISED
from plumbob.bench.problems.cloth_truth import rms_distance, truth_of
from plumbob.bench.problems.falling_cloth import FRAME, explicit_substeps, falling_cloth
from plumbob.reference import MassSpring, State

SIZE, STIFFNESS, FRAMES, REPEATS = 16, 3e3, 3, 3
SUBSTEPS, ITERATIONS = (1, 2, 5, 10, 20, 40, 80), (1, 2, 5, 10, 20, 50)
MARGINS, XPBD_ITERATIONS = (1.1, 1.5, 2, 3, 4, 8), (1, 2, 4, 10)
SETTLED = {"iterations": 5000, "tolerance": 1e-15}
CONJUGATE_GRADIENTS = ({"iterations": 100}, {"iterations": 1000}, SETTLED)
LIMIT = 0.01


def grid(peer):
    """The settings of a solver that are tried."""
    frequency = falling_cloth(SIZE, STIFFNESS).frequency
    stable = [explicit_substeps(frequency, margin) for margin in MARGINS]
    substeps, options = SUBSTEPS, [{}]
    if "XPBD" in peer.title:
        substeps, options = [10, *stable], [{"iterations": count} for count in XPBD_ITERATIONS]
    elif peer.run.kind == EXPLICIT:
        substeps = stable
    elif peer.title.startswith("MuJoCo discrete"):
        options = CONJUGATE_GRADIENTS
    elif peer.run.kind != LINEARISED:
        counts = ITERATIONS[:4] if peer.run.converges else ITERATIONS
        options = [{"iterations": count} for count in counts]
    return [{"substeps": count, **option} for count in substeps for option in options]


def prepare(peer, system, settings):
    """The mover of a solver, by its adapter."""
    adapter = importlib.import_module(peer.module)
    return adapter.prepare(system, FRAME, **{**peer.run.settings, **settings})


def result(peer, settings):
    """The error of the motion over the distance moved, and the time for a frame [ms]."""
    cloth = falling_cloth(SIZE, STIFFNESS)
    truth = truth_of(cloth, FRAMES).true[-1]
    mover = prepare(peer, cloth.system, settings)
    seconds = []
    for _ in range(REPEATS):
        mover.begin(cloth.start)
        seconds += timeit.repeat(mover.advance, number=1, repeat=FRAMES)
    path = rms_distance(cloth.start.positions, truth)
    return rms_distance(mover.positions(), truth) / path, 1e3 * float(np.median(seconds))


def fixed_costs():
    """Print the time of a step of two particles and a spring: what is not work on a cloth [µs]."""
    system = MassSpring([1.0, 1.0], [[0, 1]], 1.0, 10.0, pinned=[0], gravity=(0.0, 0.0, 0.0))
    start = State([[0.0, 0.0, 0.0], [1.01, 0.0, 0.0]], np.zeros((2, 3)))
    print("| solver | a step [µs] |")
    print("| --- | ---: |")
    for peer in filter(lambda peer: peer.is_installed, catalogue.cloth_peers()):
        iterations = {"iterations": 1} if peer.run.kind == ITERATED else {}
        try:
            mover = prepare(peer, system, {"substeps": 100, **iterations})
        except ValueError:
            continue  # takes square cloths only
        mover.begin(start)
        seconds = min(timeit.repeat(mover.advance, number=10, repeat=20)) / 1000
        print(f"| {peer.title} | {1e6 * seconds:.2g} |", flush=True)


def main():
    """Print the settings of each solver that no other setting beats in both time and error."""
    print("| solver | tried | within 1 % | setting | error | ms a frame |")
    print("| --- | ---: | ---: | --- | ---: | ---: |")
    for peer in filter(lambda peer: peer.is_installed, catalogue.cloth_peers()):
        results = []
        for settings in grid(peer):
            try:
                results.append((*result(peer, settings), settings))
            except FloatingPointError:
                results.append((np.inf, np.inf, settings))
        near = sum(error <= LIMIT for error, *_ in results)
        smallest = np.inf
        for error, ms, settings in sorted(results, key=lambda row: row[1]):
            if error < smallest:
                smallest = error
                words = ", ".join(f"{name} {number:g}" for name, number in settings.items())
                cells = (peer.title, len(results), near, words, f"{100 * error:.3g} %")
                print("|", " | ".join(map(str, (*cells, f"{ms:.3g}"))), "|", flush=True)


if __name__ == "__main__":
    main()
    fixed_costs()
