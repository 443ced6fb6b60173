"""Right programs in C++, JavaScript and Python, what is planted in them, and how to ask them.

They were written from the lab's mathematics, apart from `reference/`; what each fault is stands
here in words, apart from the diagnosis that is to name it.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob.crosscheck.verify import templates

ROOM = Path(__file__).parent / "crosscheck" / "verify" / "programs"
TEMPLATES = Path(templates.__file__).parent
FK, IK, TRACK, RESAMPLE = "forward_kinematics", "inverse_kinematics", "track", "resample"
FORCES, ENERGY, STEP = "mass_spring_forces", "energy", "mass_spring_step"
MOTION = "mass_spring_motion"


class Planted(NamedTuple):
    """A fault of a program: the task that it breaks, and what it is."""

    task: str
    words: str


KINEMATICS = {
    "fk_child_first": Planted(FK, "a child's global rotation is Q R_parent, not R_parent Q"),
    "fk_own_rotation": Planted(FK, "a joint's own rotation is applied to its own offset"),
    "fk_offset_unrotated": Planted(FK, "offsets are added without being rotated"),
    "fk_local_rotation": Planted(FK, "offsets are rotated by the parent's local rotation"),
    "fk_inverse_rotation": Planted(FK, "offsets are rotated by the parent's inverse rotation"),
    "fk_w_last": Planted(FK, "quaternions are read as x, y, z, w"),
    "ccd_world_left": Planted(IK, "the world rotation multiplies the local one from the left"),
    "ccd_world_right": Planted(IK, "the world rotation multiplies the local one from the right"),
    "ccd_conjugated": Planted(IK, "the world rotation is taken to the parent by R d R^-1"),
    "ccd_child": Planted(IK, "a joint's rotation is applied to its child on the chain"),
    "ccd_stale": Planted(IK, "the effector's position is not updated within a sweep"),
    "ccd_root_to_tip": Planted(IK, "a sweep goes from the root to the tip"),
    "ccd_backwards": Planted(IK, "the rotation leads from the target to the effector"),
    "ccd_angle_not_halved": Planted(IK, "the quaternion is made from the whole angle"),
    "ccd_tip": Planted(IK, "the effector is rotated too, by 0/0"),
    "ccd_tolerance": Planted(IK, "the square of the distance is compared with the tolerance"),
    "fabrik_root": Planted(IK, "FABRIK does not put the root back"),
    "fabrik_link": Planted(IK, "FABRIK keeps a neighbouring link's length in one of its passes"),
    "fabrik_global_rotations": Planted(IK, "local rotations are made from global directions"),
    "track_restarts": Planted(TRACK, "every frame starts from the first pose"),
    "resample_by_index": Planted(RESAMPLE, "points are evenly spaced in index, not in length"),
    "resample_end_missing": Planted(RESAMPLE, "an open curve's last point is missing"),
    "resample_left_open": Planted(RESAMPLE, "a closed curve's last side is left out"),
    "resample_nearest": Planted(RESAMPLE, "the nearest given point is taken"),
}
DYNAMICS = {
    "forces_mass_missing": Planted(FORCES, "gravity is not multiplied by the mass"),
    "forces_mass_twice": Planted(FORCES, "gravity is multiplied by the mass twice"),
    "forces_damping_sign": Planted(FORCES, "the damping has the wrong sign"),
    "forces_damping_absent": Planted(FORCES, "there is no damping"),
    "forces_damping_twice": Planted(FORCES, "the damping is added twice"),
    "forces_one_end": Planted(FORCES, "a spring pulls at its first end only"),
    "energy_half": Planted(ENERGY, "the elastic energy lacks the half"),
    "energy_gravity_sign": Planted(ENERGY, "the energy of gravity has the wrong sign"),
    "energy_kinetic": Planted(ENERGY, "the kinetic energy lacks the half"),
    "step_gravity_mass": Planted(STEP, "gravity accelerates by g/m"),
    "step_gravity_doubled": Planted(STEP, "gravity enters as 2 h^2 g"),
    "step_gravity_h": Planted(STEP, "gravity enters as h g, not h^2 g"),
    "step_damping_absent": Planted(STEP, "there is no damping"),
    "step_damping_twice": Planted(STEP, "the damping is added twice"),
    "step_damping_sign": Planted(STEP, "the damping has the wrong sign"),
    "step_pins_overwritten": Planted(STEP, "pins are put back after the solve, free within it"),
    "step_pins_springs": Planted(STEP, "pins are held by springs of stiffness 5e5"),
    "step_pins_free": Planted(STEP, "pins move like other particles"),
    "step_velocity_kept": Planted(STEP, "the velocity stays what it was"),
    "step_velocity_from_y": Planted(STEP, "the velocity is (x' - y) / h"),
    "step_velocity_explicit": Planted(STEP, "the velocity is v + h f(x_n) / m"),
    "step_linearised": Planted(STEP, "one Newton iteration from x_n is taken for convergence"),
    "step_hundredth": Planted(STEP, "Newton's steps have the fixed length 0.01"),
    "step_substeps": Planted(STEP, "ten substeps of h / 10 are made"),
    "step_one_iteration": Planted(STEP, "one iteration is made in place of ten"),
    "step_from_x_n": Planted(STEP, "iterations start from x_n, not from y"),
    "step_random_start": Planted(STEP, "iterations start from noise"),
    "step_stale_factor": Planted(STEP, "the matrix's factor is kept when h changes"),
    "step_laplacian": Planted(STEP, "h^2 L stands in place of M + h^2 L"),
    "step_matrix_without_k": Planted(STEP, "the stiffness along a spring is 1 in the matrix"),
    "step_matrix_sign": Planted(STEP, "the matrix is M - h^2 K"),
    "step_off_diagonals_doubled": Planted(STEP, "the matrix's blocks off the diagonal are doubled"),
    "step_geometric_dropped": Planted(STEP, "the geometric term is dropped"),
    "step_geometric_sign": Planted(STEP, "the geometric term has the wrong sign"),
    "motion_velocity_kept": Planted(MOTION, "every step starts with the first velocities"),
    "motion_frame_early": Planted(MOTION, "the frames begin with the start"),
}
FAULTS = {**KINEMATICS, **DYNAMICS}
IN = {
    language: faults.split()
    for language, faults in {
        "cpp": """
            fk_child_first fk_own_rotation fk_offset_unrotated ccd_world_left
            ccd_world_right ccd_conjugated ccd_child ccd_stale ccd_tolerance fabrik_root
            fabrik_link track_restarts resample_by_index forces_mass_missing
            forces_damping_sign energy_half step_gravity_mass step_gravity_doubled
            step_damping_absent step_pins_overwritten step_pins_springs
            step_velocity_kept step_linearised step_hundredth step_substeps
        """,
        "javascript": """
            fk_offset_unrotated fk_local_rotation fk_inverse_rotation ccd_world_left
            ccd_world_right ccd_child ccd_stale ccd_root_to_tip ccd_backwards ccd_tip
            fabrik_root fabrik_link fabrik_global_rotations resample_end_missing
            forces_mass_twice forces_damping_absent energy_gravity_sign step_gravity_h
            step_damping_absent step_damping_twice step_pins_overwritten step_pins_free
            step_velocity_from_y step_one_iteration step_from_x_n step_random_start
            step_stale_factor step_laplacian motion_velocity_kept
        """,
        "python": """
            fk_child_first fk_own_rotation fk_w_last ccd_world_left ccd_world_right
            ccd_conjugated ccd_stale ccd_root_to_tip ccd_angle_not_halved ccd_tolerance
            fabrik_root fabrik_global_rotations resample_left_open resample_nearest
            forces_damping_twice forces_one_end energy_kinetic step_gravity_mass
            step_gravity_doubled step_damping_sign step_damping_absent
            step_pins_overwritten step_pins_springs step_velocity_explicit
            step_matrix_without_k step_matrix_sign step_off_diagonals_doubled
            step_geometric_dropped step_geometric_sign motion_frame_early
        """,
    }.items()
}
# What makes a program of each source, if anything, and what has to be installed.
COMPILERS = {
    "cpp": ("g++", ["-std=c++17", "-O1", f"-I{TEMPLATES}"]),
    "single": ("g++", ["-std=c++17", "-O1", "-DREAL=float", f"-I{TEMPLATES}"]),
}


def command(language, folder):
    """Compile a program if needed; return what runs it, or None without a compiler."""
    if language == "python":
        return [sys.executable, str(ROOM / "solver.py")]
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
