"""Records made up for the tests, and a stamp that does not depend on the machine."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.experiments import SUITES
from bench.harness.record import FINISHED, Record

STAMP = {
    "machine": {"processor": "a <b>slide</b> rule", "cores": 1, "memory_gib": 0.5, "system": "x"},
    "versions": {"python": "3.11.0", "plumbob": "0.0", "numpy": "2", "cholespy": ""},
    "source": "0123456789ab",
}
WHEN = "2000-01-02T03:04:05+00:00"


def record(suite, problem, solver, settings=None, arrays=None, **more):
    """A record with a stamp; lists become arrays."""
    made = {name: np.asarray(values) for name, values in (arrays or {}).items()}
    given = {"stamp": STAMP, "when": WHEN, **more}
    return Record(suite, problem, solver, settings or {}, arrays=made, **given)


def drawn(solver, warm, turn):
    """The arm drawing a curve, in three frames."""
    return record(
        "arm",
        "arm/circle",
        solver,
        {"tolerance": 1e-4, "max_iterations": 100, "warm": warm},
        {
            "residual": [1e-5, 2e-5, 3e-4],
            "iterations": [4, 5, 6] if solver == "ccd" else [1, 2, 3],
            "largest_turn": [turn, turn / 2],
            "mean_turn": [turn / 4, turn / 4],
        },
    )


def followed(solver, **turns):
    """A closed curve of three points followed in three ways; every second turn is half as large."""
    return [
        record(
            "tracking",
            "arm/circle",
            solver,
            {"tolerance": 1e-4, "max_iterations": 100, "way": way},
            {
                "residual": [1e-5, 2e-5, 3e-5 if way == "coherent" else 3e-4],
                "iterations": [12, 11, 10] if way == "coherent" else [5, 4, 3],
                "largest_turn": [turn, turn / 2, turn / 2],
                "mean_turn": [turn / 4, turn / 4, turn / 8],
            },
        )
        for way, turn in turns.items()
    ]


def drifted(solver):
    """Three rounds, warm and coherent."""
    ways = {"warm": [0.1, 0.2, 0.3], "coherent": [0.0, 1e-9, 0.0]}
    return [
        record("tracking", "drift/heart", solver, {"way": way}, {"drift": drift})
        for way, drift in ways.items()
    ]


def beyond(solver, bend):
    """Two targets out of the arm's reach of 2 m."""
    return record(
        "arm",
        "arm/beyond",
        solver,
        {"tolerance": 1e-6, "max_iterations": 10},
        {
            "residual": [1.0, 2.0],
            "iterations": [1, 1],
            "distance": [3.0, 4.0],
            "bend": [0.0, bend],
            "excess": [0.0, 0.0],
            "reach": 2.0,
        },
        size=2,
    )


def claim(name="spring forces", held=True, **notes):
    """A verdict of the cross-check."""
    return record(
        "check",
        name,
        "MuJoCo",
        arrays={"cases": 5, "difference": 5e-13, "tolerance": 1e-12, "moved": 1.0, "held": held},
        notes={"ours": "ours", "reason": "rounding", "missed": "" if held else "they differ"}
        | notes,
    )


def timed(solver, seconds, problem="kinematics/10 balls/one pose a call"):
    """Three rounds of a benchmark."""
    rounds = [seconds, 2 * seconds, 3 * seconds]
    return record("timing", problem, solver, {"operations": 1}, {"seconds": rounds, "moved": 0})


def reached(stratum, solver):
    """Two targets for the chain, with the residual of three iterations."""
    history = {f"history_{name}": [1.0, 0.1, f] for name, f in
               (("low", 1e-6), ("median", 1e-5), ("high", 1e-4))}  # fmt: skip
    arrays = {"residual": [1e-5, 1e-6], "iterations": [2, 30], "distance": [0.5, 0.6]}
    limits = {"tolerance": 1e-4, "max_iterations": 1000}
    return record("ik", f"chain/{stratum}", solver, limits, arrays | history, size=2)


def stepped(solver):
    """One step of a cloth in three iterations."""
    arrays = {"residual": [1.0, 0.1, 1e-7, 0.0], "error": [1.0, 0.2, 1e-7, 0.0]}
    return record("cloth", "cloth/x1/one step", solver, {"h": 0.02, "step": 3}, arrays)


def few(iterations):
    """Two steps of a few iterations."""
    settings = {"h": 0.02, "first": 5, "steps": 2, "iterations": iterations}
    arrays = {"error": [0.5, 0.5], "distance": [0.1, 0.1], "drift": [0.1, 0.2], "path": [1, 2]}
    return record("cloth", "cloth/x1/few iterations", "local_global", settings, arrays)


def two_dampers(apart=(0.04, 0.02)):
    """How far the two laws of dampers are apart in two steps."""
    settings = {"first": 5, "longest": 0.02, "halvings": len(apart) - 1, "damping": 0.2}
    h = 0.02 / 2.0 ** np.arange(len(apart))
    return record("cloth", "cloth/x1/dampers", "newton", settings, {"h": h, "apart": apart})


def swung(solver, problem="swing/undamped", left=(1.0, 0.5)):
    """What an integrator leaves of the energy of a long swing."""
    settings = {"h": 1 / 60, "steps": 100, "every": 10, "tolerance": 1e-10}
    times = np.arange(len(left)) / 6
    return record("energy", problem, solver, settings, {"time": times, "left": left})


def certified(solver="newton", settings=None, arrays=None, notes=None):
    """One step of a cloth in mid-swing, its answer covered unless told otherwise."""
    usual = {"h": 1 / 30, "start": "y", "iterations": 100, "tolerance": 1e-10}
    found = {"size": 10, "iterations": 4, "residual": 1e-12, "balance": 1e-15, "distance": 1e-11}
    found |= {"at_floor": True, "apart": 0.0, "error": 0.0, "above": 0.0}
    found |= {"covered": True, "same": True, "different": False}
    return record("newton", "swing/k100000", solver, usual | (settings or {}),
                  found | (arrays or {}), notes=notes or {"coverage": "COVERED"})  # fmt: skip


def stepping():
    """Three steps by Newton."""
    settings = {"h": 0.02, "first": 5, "steps": 3, "tolerance": 1e-10}
    arrays = {"iterations": [2, 2, 3], "residual": [1e-12, 1e-12, 1e-11], "outcome": [0, 0, 0]}
    return record("cloth", "cloth/x1", "newton", settings, arrays | {"at_floor": [True] * 3})


def called_first(name, solver, cold=0.6, warm=0.3):
    """A call in a process that compiled two kernels, and in the next one."""
    arrays = {"cold compiled": 2, "cold processor": cold, "cold wall": 2 * cold}
    arrays |= {"warm compiled": 0, "warm processor": warm, "warm wall": 2 * warm}
    return record("first_call", name, solver, {}, arrays)


def raced(solver, kind, family="robots", robot="arm", **changed):
    """Four targets in two strata: one solved, one not, one denied, one beyond the limits."""
    arrays = {
        "solved": [True, False, False, True], "claimed": [1, 0, 1, 1], "stratum": [0, 1, 0, 1],
        "seconds": [1e-5, 1e-3, 1e-4, 1e-4], "position": [1e-9, 0.5, 0.1, 1e-7],
        "rotation": [1e-8, 0.5, 0.1, 1e-6], "beyond": [0.0, 0.0, 0.0, 0.0], "setup": 0.25,
    } | changed  # fmt: skip
    settings = {"kind": kind, "tolerance": 1e-3, "tolerance_rotation": 1e-3, "version": "1.2"}
    notes = {"robot": f"the {robot}", "strata": "joint space, space", "remark": ""}
    notes |= {"tips": "hand", "joints": "7", "freedom": "7", "wanted": "pose"}
    return record("ik", f"{family}/{robot}", solver, settings, arrays, notes=notes, size=4)


def lacking(solver, kind, why, robot="all"):
    """A solver that is missing or cannot."""
    notes = {"robot": "every robot", "remark": why}
    return record("ik", f"robots/{robot}", solver, {"kind": kind, "version": ""}, notes=notes)


def compared(engine, cause=""):
    """One file beside one engine."""
    sizes = {"links": 3, "joints": 2, "freedoms": 2}
    apart = {"positions": 1e-15, "rotations": 2e-15, "jacobians": 3e-15}
    notes = {"cause": cause, "free mimics": ""}
    settings = {"configurations": 5}
    return record("robot_models", "robots/arm", engine, settings, sizes | apart, notes=notes)


def scaled(solver):
    """A cloth of a thousand particles: factored by one library, and stepped if by ours."""
    settings = {"particles": 1024, "iterations": 10, "stiffness": 1000.0, "h": 0.02}
    arrays = {"entries": 30_000, "factor": 0.01, "refactor": 0.004, "memory": 2**28}
    arrays |= {"residual": 0.1, "solve": [1e-4] * 3, "local": [5e-5] * 3, "step": [2e-3] * 3}
    return record("cloth_scale", "cloth/32x32", solver, settings, arrays | {"limit": [1e-4] * 3})


def republished():
    """One record for each published table."""
    arrays = {"solved": [True, False], "claimed": [1, 0], "seconds": [1e-3, 3e-3], "setup": 0.1}
    counts = {"iterations": [4, 6], "residual": [1e-7, 1e-8]}
    return [
        record("ik", "published/trac_ik/ur5", "TRAC-IK, 5 ms", {}, arrays),
        record("ik", "published/toolbox/ur5", "ik_LM, NR", {"method": "NR"}, arrays),
        *(record("ik", f"published/fabrik/{s}", "fabrik", {"tolerance": 1e-6}, counts)
          for s in ("reachable", "unreachable")),
    ]  # fmt: skip


def pictured():
    """The arm on a curve of three points, as drawn and evened out, and a cloth of 2 x 2."""
    curve = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.3, 0, 0.1]])
    ghosts = [[[0, 1, 0], [0, 0.5, 0.2], point] for point in curve]
    arrays = {"curve": curve, "spacing": [0.1, 0.2], "ghosts": ghosts, "residual": [1e-5] * 3}
    arrays |= {"iterations": [1, 2, 3], "largest_turn": [0.1, 0.2], "mean_turn": [0.1, 0.1]}
    spacing = {"min_spacing": 0.01, "max_spacing": 0.02}
    cloth = {"positions": [np.eye(4, 3), 2 * np.eye(4, 3)], "time": [0.0, 1.0], "pinned": [0, 1]}
    return [
        *(record("pictures", "arm/x", "ccd", {"evened": e, **spacing}, arrays) for e in (0, 1)),
        record("pictures", "cloth/x1", "newton", {}, cloth),
    ]


def worked(solver, stiffness=1e3, sizes=(20, 20), seconds=(1e-3, 1e-2), error=(0.5, 1e-4)):
    """One step of a cloth with ever more work."""
    arrays = {"particles": sizes, "seconds": seconds, "error": error}
    labels = "; ".join(f"{10**i} iterations" for i in range(len(sizes)))
    settings = {"stiffness": stiffness, "frame": 1 / 60, "version": "1"}
    notes = {"rungs": labels, "remark": "20 × 20, 10 iterations: tired"}
    return record("cloth", f"peers/one step/k{stiffness:g}", solver, settings, arrays, notes=notes)


def fell(solver, stiffness=1e3, **changed):
    """A motion of a cloth by three settings: diverged, whole, cut short."""
    arrays = {
        "particles": [20, 20, 20], "frames": [6, 6, 3], "wanted": [6, 6, 6],
        "seconds": [1e-4, 1e-3, 1.0], "setup": [0.1, 0.2, 0.3],
        "implicit": [np.nan, 1e-2, 1e-3], "true": [np.nan, 2e-2, 1e-3],
        "diverged": [True, False, False], "order": [3.5], "unsure": [1e-9],
    } | changed  # fmt: skip
    settings = {"stiffness": stiffness, "frame": 1 / 60, "version": "1"}
    notes = {"rungs": "1 step; 4 steps; 16 steps", "remark": ""}
    return record("cloth", f"peers/motion/k{stiffness:g}", solver, settings, arrays, notes=notes)


def needed(solver, counts, tried=100):
    """Iterations to each power of ten."""
    settings = {"size": 20, "stiffness": 1e3, "frame": 1 / 60}
    arrays = {"needed": counts, "tried": tried, "least": 1e-3}
    return record("cloth", "peers/iterations/k1000", solver, settings, arrays)


def bounded(solver, limit):
    """The longest stable step at a frequency of 100 rad/s."""
    arrays = {"stiffness": [1e3], "limit": [limit], "frequency": [100.0]}
    notes = {"remark": ""}
    return record("cloth", "peers/stability", solver, {"size": 6}, arrays, notes=notes)


def as_liu(solver, seconds):
    """A frame of as many vertices as in the paper."""
    arrays = {"seconds": [seconds], "error": 0.5, "vertices": 6561}
    return record("cloth", "peers/liu2013", solver, {"size": 81}, arrays)


@pytest.fixture
def make():
    """The makers of records, by name."""
    return SimpleNamespace(
        record=record,
        drawn=drawn,
        followed=followed,
        drifted=drifted,
        beyond=beyond,
        claim=claim,
        timed=timed,
        stepped=stepped,
        swung=swung,
        two_dampers=two_dampers,
        stepping=stepping,
        certified=certified,
        called_first=called_first,
        raced=raced,
        lacking=lacking,
        republished=republished,
        worked=worked,
        fell=fell,
        needed=needed,
        bounded=bounded,
        as_liu=as_liu,
    )


@pytest.fixture(scope="session")
def records():
    """A small report's worth of records; every suite went through."""
    finished = [record(FINISHED, suite, "") for suite in SUITES]
    turns = {"ccd": (1.0, 0.1), "fabrik": (2.0, 0.3)}
    arm = [drawn(s, warm, turns[s][warm]) for s in turns for warm in (False, True)]
    return [
        claim(),
        *arm,
        *followed("ccd", cold=1.0, warm=0.5, coherent=0.25),
        *drifted("ccd"),
        beyond("ccd", 0.5),
        beyond("fabrik", 0.0),
        *(reached("near", solver) for solver in ("ccd", "fabrik")),
        *(stepped(solver) for solver in ("local_global", "newton")),
        *(few(iterations) for iterations in (1, 10)),
        stepping(),
        two_dampers(),
        certified(),
        *(swung(s, f"swing/{c}") for c in ("undamped", "damped") for s in ("RK4", "discrete")),
        *(
            raced("Plumbob LM", kind, family)
            for kind in ("one start", "restarts")
            for family in ("robots", "unreachable")
        ),
        *republished(),
        *(scaled(solver) for solver in ("supernodal", "cholespy")),
        compared("MuJoCo"),
        compared("Pinocchio", "it forgets the hand"),
        *(worked(solver) for solver in ("Plumbob Newton", "MuJoCo Euler")),
        fell("Plumbob Newton"),
        needed("newton", [1, 2, 3, 4, 5, 6, 7, np.nan]),
        bounded("MuJoCo Euler", 0.02),
        as_liu("local_global", 0.03),
        called_first("forward_kinematics/skeleton", "Plumbob"),
        *pictured(),
        timed("Plumbob, compiled", 1e-6),
        timed("Pinocchio", 5e-7),
        *(timed("Plumbob, compiled", 1e-6, f"{work}/near/ccd") for work in ("ik", "cloth")),
        *finished,
    ]
