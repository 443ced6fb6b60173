"""Cloths from a thousand particles to a million: factors, solves, iterations, memory.

Each cloth is measured in a process of its own, since only a process can say how much memory it ever
had.
"""

import importlib.util
import resource
import sys
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import ImplicitEuler, MassSpring, State, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.implicit_euler.factor_cache import clear as clear_factor_cache
from plumbob.reference.implicit_euler.factor_cache import prefactored
from plumbob.reference.implicit_euler.objective import global_matrix
from plumbob.reference.sparse import CholeskyFactor
from plumbob.reference.sparse.linear_solver import factorize

from ...harness.block import Block, Measured, Scale
from ...harness.isolation import in_a_fresh_process
from ...harness.progress import announce
from ...harness.stopwatch import time_call
from ...harness.values import read
from ...peers import registry
from .values import Scaled

H = 1 / 60
STIFFNESS = 1e4
ITERATIONS = 10
# Particles along a side, and how long a benchmark may take [s] where the cloth is to be measured.
SIZES = {32: 0.0, 100: 0.0, 316: 1.0, 1000: 1.0}
OURS = registry.SUPERNODAL.name
LIBRARIES = tuple(library.name for library in registry.FACTORS)
# Rounds in each of which everything is timed once: so many particles in all, within limits.
ROUNDS_PARTICLES, ROUNDS = 1_000_000, (3, 15)
# What the yardstick of memory reads again and again: more than most caches hold [bytes].
STRETCH = 2**28
# So long [s] a part may take, such as the factor of a million particles, compilation included.
PATIENCE = 1800.0


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every size by our own factorisation and by CHOLMOD."""
    for size, seconds in SIZES.items():
        if scale.seconds < seconds:
            continue
        settings: dict[str, Any] = {"particles": size * size, "h": H, "stiffness": STIFFNESS}
        settings["iterations"] = ITERATIONS
        for library in LIBRARIES:
            measure_it = partial(in_its_own_process, size, library)
            yield Block("cloth_scale", f"cloth/{size}x{size}", library, measure_it, settings)


def in_its_own_process(size: int, library: str) -> Measured:
    """Measure one cloth in a process that does nothing else; say so if there is no such library."""
    if library != OURS and importlib.util.find_spec(library) is None:
        return Measured(None, {"missing": f"{library} is not installed"})
    numbers = in_a_fresh_process(PATIENCE, compiled_and_measured, size, library)
    return Measured(read(Scaled, numbers))


def compiled_and_measured(size: int, library: str) -> dict[str, Any]:
    """Return what is measured after a small cloth, for which everything is compiled."""
    measure(min(SIZES), library)
    clear_factor_cache()
    return measure(size, library)


def _say(size: int, library: str, what: str) -> None:
    """Say what is being done now."""
    announce(f"cloth/{size}x{size}, {library}: {what}")


def billowing_cloth(size: int) -> tuple[MassSpring, State]:
    """Return the lab's cloth, a hundred times as stiff, with two waves across it that rise."""
    system, flat = scenes.lab_cloth(size=size, stiffness=STIFFNESS)
    x = flat.positions.copy()
    wave = np.sin(np.pi * x[:, 0]) * np.cos(np.pi * x[:, 2])
    x[:, 1] += 0.1 * wave
    v = np.zeros_like(x)
    v[:, 1] = wave
    return system, State(x, v)


def measure(size: int, library: str) -> dict[str, Any]:
    """Return the times [s] and the memory [bytes] of one cloth."""
    before, say = memory(), partial(_say, size, library)
    say("cloth")
    system, state = billowing_cloth(size)
    rounds = int(np.clip(ROUNDS_PARTICLES // size**2, *ROUNDS))
    if library != OURS:
        matrix = global_matrix(system, H)
        say("factor")
        factor, seconds = time_call(lambda: factorize(matrix, library))
        sides = np.array(state.positions)
        times = in_turn({"solve": lambda: factor.solve(sides)}, rounds, say)
        return {"factor": seconds, **times, "memory": memory(), "before": before}
    return {"before": before, **steps(system, state, rounds, say)}


def steps(
    system: MassSpring, state: State, rounds: int, say: Callable[[str], None]
) -> dict[str, Any]:
    """Return the times of iterations and of their parts, and the residual reached."""
    say("matrix")
    matrix, assembly = time_call(lambda: global_matrix(system, H))
    say("factor")
    factor, seconds = time_call(lambda: prefactored(matrix))
    assert isinstance(factor, CholeskyFactor)
    integrator = ImplicitEuler(
        system, h=H, solver="local_global", tolerance=0.0, max_iterations=ITERATIONS
    )
    objective = integrator.objective(state)
    gradient = objective.start.gradient
    limit = reading(2 * 8 * factor.entries + local_bytes(system))
    work = {
        "solve": lambda: factor.solve(gradient),
        "local": lambda: objective.evaluate(objective.y),
        "step": lambda: integrator.step(state),
        "limit": limit,
    }
    times = in_turn(work, rounds, say)
    say("factor, once more")
    used, result = memory(), integrator.step(state)
    twice = global_matrix(system, 2 * H)
    _, again = time_call(lambda: factor.refactorize(twice))
    sizes = {"entries": factor.entries, "matrix_entries": matrix.nnz, "memory": used}
    found = {"residual": result.residual, "history": result.history.tolist()}
    return {"assembly": assembly, "factor": seconds, "refactor": again, **times, **sizes, **found}


def in_turn(
    work: dict[str, Callable[[], Any]], rounds: int, say: Callable[[str], None]
) -> dict[str, list[float]]:
    """Return how long each took in each round; a first, uncounted round warms up."""
    times: dict[str, list[float]] = {name: [] for name in work}
    for done in range(rounds + 1):
        say(f"round {done} of {rounds}")
        for name, call in work.items():
            times[name].append(time_call(call)[1])
    return {name: seconds[1:] for name, seconds in times.items()}


def local_bytes(system: MassSpring) -> int:
    """Return what a local step has to read: the springs, and six numbers of each particle's."""
    arrays = system.arrays
    springs = (arrays.springs, arrays.rest_lengths, arrays.stiffnesses, arrays.tension_only)
    return sum(array.nbytes for array in springs) + 6 * 3 * 8 * system.particle_count


def reading(size: int) -> Callable[[], float]:
    """Return a call that reads so many bytes, as fast as memory or the caches give them."""
    numbers = np.ones(min(size // 2, STRETCH) // 8)
    passes, rest = divmod(size // 8, len(numbers))

    def run() -> float:
        whole = sum(_total(numbers) for _ in range(passes))
        return whole + _total(numbers[:rest])

    return run


def total(numbers: FloatArray) -> float:
    """Return the sum, in whatever order is fastest."""
    result = 0.0
    for i in range(len(numbers)):
        result += numbers[i]
    return result


_total = Kernel(total, relaxed=True)


def memory() -> int:
    """Return the most memory that this process ever had [bytes]."""
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else 1024 * most
