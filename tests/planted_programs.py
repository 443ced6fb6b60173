"""Right programs in C++ and JavaScript, what is planted in them, and how to ask them.

They were written from the lab's mathematics, independently of `reference/`; `programs/faults.toml`
lists their faults.
"""

import json
import shutil
import subprocess
import tomllib
from pathlib import Path

import numpy as np

from plumbob.verify import templates

ROOM = Path(__file__).parent / "verify" / "programs"
TEMPLATES = Path(templates.__file__).parent
FK, IK, TRACK, RESAMPLE = "forward_kinematics", "inverse_kinematics", "track", "resample"
FORCES, ENERGY, STEP = "mass_spring_forces", "energy", "mass_spring_step"
MOTION = "mass_spring_motion"


FAULTS = tomllib.loads((ROOM / "faults.toml").read_text(encoding="utf-8"))
IN = {
    language: [key for key, fault in FAULTS.items() if language in fault["languages"]]
    for language in ("cpp", "javascript")
}
# What makes a program of each source, if anything, and what has to be installed.
COMPILERS = {
    "cpp": ("g++", ["-std=c++17", "-O1", f"-I{TEMPLATES}"]),
    "single": ("g++", ["-std=c++17", "-O1", "-DREAL=float", f"-I{TEMPLATES}"]),
}


def command(language, folder):
    """Compile a program if needed; return what runs it, or None without a compiler."""
    if language == "javascript":
        node = shutil.which("node")
        return node and [node, str(ROOM / "solver.js")]
    name, options = COMPILERS[language]
    if (compiler := shutil.which(name)) is None:
        return None
    program = folder / language
    source = ROOM / "solver.cpp"
    subprocess.run([compiler, *options, str(source), "-o", str(program)], check=True, timeout=120)
    return [str(program)]


def ask(run, requests, timeout=60):
    """Return a program's answers to the requests, in order, and what it prints besides."""
    lines = "".join(json.dumps(request) + "\n" for request in requests)
    done = subprocess.run(
        run, input=lines, capture_output=True, text=True, timeout=timeout, check=True
    )
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert [one["id"] for one in answers] == [one["id"] for one in requests]
    return answers, done.stderr


def values(answer):
    """Return what an answer holds as arrays, null as NaN."""
    return {name: np.array(value, dtype=float) for name, value in answer.items()}


def unit_quaternions(rng, count):
    q = rng.normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def kinematic_requests(rng):
    """Return requests on trees, chains and curves, in poses away from rest."""
    tree = {
        "parents": [-1, 0, 1, 1, 3, 3, 0],
        "offsets": rng.normal(size=(7, 3)).round(3).tolist(),
        "local_rotations": unit_quaternions(rng, 7).tolist(),
    }
    chain = {
        "parents": [-1, 0, 1, 2, 3, 4],
        "offsets": rng.normal(size=(6, 3)).round(3).tolist(),
        "local_rotations": unit_quaternions(rng, 6).tolist(),
    }
    target = [chain["offsets"][0][0] + 0.9, chain["offsets"][0][1] - 1.1, 0.7]
    sweep = {"effector": 5, "tolerance": 0.0, "max_iterations": 1, "target": target}
    whole = sweep | {"tolerance": 1e-4, "max_iterations": 200}
    curve = [[target[0] + 0.1 * n, target[1] - 0.2 * n, target[2]] for n in range(4)]
    limits = {name: whole[name] for name in ("effector", "tolerance", "max_iterations")}
    uneven = np.cumsum(rng.uniform(0.05, 0.4, (9, 3)), axis=0).tolist()
    return [
        {"task": FK, **tree},
        {"task": FK, **chain},
        *({"task": IK, **chain, **sweep, "method": one} for one in ("ccd", "fabrik")),
        *({"task": IK, **chain, **whole, "method": one} for one in ("ccd", "fabrik")),
        {"task": IK, **tree, **sweep, "effector": 4, "method": "ccd"},
        {"task": TRACK, **chain, **limits, "curve": curve, "method": "fabrik"},
        *(
            {"task": RESAMPLE, "curve": uneven, "strokes": [0], "closed": closed, "count": 7}
            for closed in (False, True)
        ),
    ]


def cloth(rng, side=3):
    """Return a cloth that was moved, with masses, stiffnesses and dampings of its own."""
    grid = np.array([[i, 0.0, j] for i in range(side) for j in range(side)])
    pairs = [
        (a, b)
        for a in range(side**2)
        for b in range(a)
        if np.linalg.norm(grid[a] - grid[b]) < 1.5 and (a + b) % 7
    ]
    lengths = [float(np.linalg.norm(grid[a] - grid[b])) for a, b in pairs]
    return {
        "masses": rng.uniform(0.5, 2.0, side**2).round(3).tolist(),
        "springs": [list(pair) for pair in pairs],
        "rest_lengths": lengths,
        "stiffnesses": rng.uniform(50.0, 150.0, len(pairs)).round(2).tolist(),
        "dampings": rng.uniform(0.2, 0.6, len(pairs)).round(3).tolist(),
        "gravity": [0.5, -9.0, 0.25],
        "positions": (grid + rng.uniform(-0.15, 0.15, grid.shape)).round(4).tolist(),
        "velocities": rng.normal(size=grid.shape).round(3).tolist(),
    }


def dynamic_requests(rng):
    """Return requests on a cloth, among them one with another h and one that is repeated."""
    system = cloth(rng)
    step = system | {"pinned": [0, 6], "h": 1 / 30}
    step["velocities"] = [
        [0.0] * 3 if i in step["pinned"] else v for i, v in enumerate(step["velocities"])
    ]
    return [
        {"task": FORCES, **system},
        {"task": ENERGY, **system},
        {"task": STEP, **step},
        {"task": STEP, **step, "h": 1 / 60},
        {"task": STEP, **step, "h": 1 / 60},
        {"task": MOTION, **step, "steps": 3},
    ]


def requests():
    """Return the greeting's request and the same others in every run, numbered."""
    rng = np.random.default_rng(24)
    asked = [{"task": "greeting", "protocol": 1}, *kinematic_requests(rng), *dynamic_requests(rng)]
    return [{"id": i, **request} for i, request in enumerate(asked)]
