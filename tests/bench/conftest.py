"""Records made up for the tests, and a stamp that does not depend on the machine."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from plumbob.bench.experiments import SUITES
from plumbob.bench.harness.record import FINISHED, Record

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


def drawn(solver, warm, angle):
    """The arm drawing a curve, in three frames."""
    return record(
        "arm",
        "arm/circle",
        solver,
        {"tolerance": 1e-4, "max_iterations": 100, "warm": warm},
        {
            "residual": [1e-5, 2e-5, 3e-4],
            "iterations": [4, 5, 6] if solver == "ccd" else [1, 2, 3],
            "outcome": [0, 0, 3],
            "largest_angle": [angle, angle / 2],
            "mean_angle": [angle / 4, angle / 4],
        },
        facts={"task": "curve", "title": "arm, circle", "curve": "circle"},
    )


def followed(solver, **angles):
    """A closed curve of three points followed in three modes, its angles halving."""
    return [
        record(
            "tracking",
            "arm/circle",
            solver,
            {"tolerance": 1e-4, "max_iterations": 100, "mode": mode},
            {
                "residual": [1e-5, 2e-5, 3e-5 if mode == "coherent" else 3e-4],
                "iterations": [12, 11, 10] if mode == "coherent" else [5, 4, 3],
                "outcome": [0, 0, 0],
                "largest_angle": [angle, angle / 2, angle / 2],
                "mean_angle": [angle / 4, angle / 4, angle / 8],
            },
            facts={"task": "curve", "title": "arm, circle"},
        )
        for mode, angle in angles.items()
    ]


def drifted(solver, curve="circle"):
    """Three repetitions, warm and coherent."""
    modes = {"warm": [0.1, 0.2, 0.3], "coherent": [0.0, 1e-9, 0.0]}
    return [
        record(
            "tracking",
            f"drift/{curve}",
            solver,
            {"mode": mode, "tolerance": 1e-4},
            {"drift": drift, "residual": [0.0]},
            facts={"task": "drift"},
        )
        for mode, drift in modes.items()
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
            "solved": [False, False],
            "iterations": [1, 1],
            "distance": [3.0, 4.0],
            "bend": [0.0, bend],
            "excess": [0.0, 0.0],
            "reach": 2.0,
        },
        size=2,
        facts={"task": "beyond", "title": "arm, beyond"},
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


def timed(solver, seconds, subject="kinematics", group="10 balls", work="one pose a call"):
    """Three rounds of a benchmark."""
    arrays = {"seconds": [[seconds, 2 * seconds, 3 * seconds]], "moved": 0}
    facts = {"subject": subject, "group": group, "work": work, "title": f"{group}, {work}"}
    problem = f"{subject}/{group}/{work}"
    return record("timing", problem, solver, {"operations": 1}, arrays, facts=facts)


def reached(stratum, solver):
    """Two targets for the chain, with the residual of three iterations."""
    history = {f"history_{name}": [1.0, 0.1, f] for name, f in
               (("low", 1e-6), ("median", 1e-5), ("high", 1e-4))}  # fmt: skip
    arrays = {"residual": [1e-5, 1e-6], "iterations": [2, 30], "distance": [0.5, 0.6]}
    arrays |= {"bend": [0.1, 0.1], "excess": [0.0, 0.0], "reach": 1.0}
    limits = {"tolerance": 1e-4, "max_iterations": 1000}
    facts = {"task": "chain", "stratum": stratum, "title": f"chain, {stratum}"}
    return record("ik", f"chain/{stratum}", solver, limits, arrays | history, size=2, facts=facts)


def entered(made):
    """The same record of a solver that a user entered."""
    facts = {**made.facts, "entrant": True, "door": "my_ik.py", "digest": "0123456789ab"}
    settings = {**made.settings, "version": "1.0"}
    commit = {"solver_commit": "0123456789abcdef with changes"}
    return replace(made, facts=facts, settings=settings, conditions=commit)


def stepped(solver):
    """One step of a cloth in three iterations."""
    arrays = {"residual": [1.0, 0.1, 1e-7, 0.0], "error": [1.0, 0.2, 1e-7, 0.0]}
    settings = {"h": 0.02, "step": 3}
    return record("cloth", "cloth/x1/one step", solver, settings, arrays, facts=cloth("one step"))


def cloth(task):
    """What is known of a record on the lab's cloth as it is."""
    return {"task": task, "title": "stiffness × 1"}


def few(iterations):
    """Two steps of a few iterations."""
    settings = {"h": 0.02, "first": 5, "steps": 2, "iterations": iterations}
    arrays = {"error": [0.5, 0.5], "distance": [0.1, 0.1], "drift": [0.1, 0.2], "path": [1, 2]}
    facts = cloth("few iterations")
    return record("cloth", "cloth/x1/few iterations", "local_global", settings, arrays, facts=facts)


def two_dampers(apart=(0.04, 0.02)):
    """How far the two laws of dampers are apart in two steps."""
    settings = {"first": 5, "longest": 0.02, "halvings": len(apart) - 1, "damping": 0.2}
    h = 0.02 / 2.0 ** np.arange(len(apart))
    arrays = {"h": h, "apart": apart}
    return record("cloth", "cloth/x1/dampers", "newton", settings, arrays, facts=cloth("dampers"))


def swung(solver, cloth="undamped", left=(1.0, 0.5)):
    """What an integrator leaves of the energy of a long swing."""
    settings = {"h": 1 / 60, "steps": 100, "every": 10, "tolerance": 1e-10}
    times = np.arange(len(left)) / 6
    facts = {"title": cloth, "damping": 0.0 if cloth == "undamped" else 0.2}
    arrays = {"time": times, "left": left}
    return record("energy", f"swing/{cloth}", solver, settings, arrays, facts=facts)


def judged(family, fault, laws=("positions",)):
    """What the judge of solvers says of one with a fault, or of an honest one."""
    facts = {"title": fault or "reference", "family": family, "faulty": bool(fault),
             "verdict": "WRONG" if fault else "RIGHT", "laws": list(laws)}  # fmt: skip
    arrays = {"caught": bool(laws), "named": True, "passed": True}
    return record("self_test", f"{family}/{fault}", "verify", {}, arrays, facts=facts)


def certified(solver="newton", settings=None, arrays=None, notes=None):
    """One step of a cloth in mid-swing, its answer covered unless Newton colours them itself."""
    usual = {"h": 1 / 30, "start": "y", "iterations": 100, "tolerance": 1e-10}
    found = {"size": 10, "iterations": 4, "residual": 1e-12, "balance": 1e-15, "distance": 1e-11}
    found |= {"curvature": 1.0, "lipschitz": 1.0, "newton_step": 0.0}
    found |= {"at_floor": True, "apart": 0.0, "error": 0.0, "above": 0.0}
    found |= {"covered": True, "same": True, "different": False}
    return record("newton", "swing/k100000", solver, usual | (settings or {}),
                  found | (arrays or {}), notes=notes or {"coverage": "COVERED"},
                  facts={"stiffness": 1e5})  # fmt: skip


def stepping():
    """Three steps by Newton."""
    settings = {"h": 0.02, "first": 5, "steps": 3, "tolerance": 1e-10}
    arrays = {"iterations": [2, 2, 3], "residual": [1e-12, 1e-12, 1e-11], "outcome": [0, 0, 0]}
    arrays |= {"at_floor": [True] * 3}
    return record("cloth", "cloth/x1", "newton", settings, arrays, facts=cloth("swing"))


def raced(solver, kind, task="reachable", robot="arm", size=4, **changed):
    """Four targets in two strata: one solved, one missed, one claim denied, one solved."""
    arrays = {
        "solved": [True, False, False, True], "claimed": [1, 0, 1, 1], "stratum": [0, 1, 0, 1],
        "seconds": [1e-5, 1e-3, 1e-4, 1e-4], "position": [1e-9, 0.5, 0.1, 1e-7],
        "rotation": [1e-8, 0.5, 0.1, 1e-6], "beyond": [0.0, 0.0, 0.0, 0.0], "setup": 0.25,
    } | changed  # fmt: skip
    settings = {"kind": kind, "tolerance": 1e-3, "tolerance_rotation": 1e-3, "version": "1.2"}
    facts = {"task": task, "title": f"the {robot}", "strata": ["joint space", "space"]}
    facts |= {"tips": ["hand"], "joints": 7, "freedom": 7, "wanted": "pose"}
    problem = f"{'robots' if task == 'reachable' else task}/{robot}"
    return record("ik", problem, solver, settings, arrays, notes={"remark": ""}, size=size,
                  facts=facts)  # fmt: skip


def solving(
    solver, hits, kind="one start", robot="arm", *, count=200, begun=None, size=None,
    seconds=1e-3, mine=False, facts=(), **changed,
):  # fmt: skip
    """The first `begun` of so many targets, the first `hits` of them solved, each in so long."""
    times = np.resize(seconds, np.size(seconds) if np.ndim(seconds) else begun or count)
    solved = np.arange(len(times)) < hits
    arrays = {"solved": solved, "claimed": solved.astype(int), "seconds": times}
    arrays |= {"stratum": np.arange(len(times)) % 2, "position": np.where(solved, 1e-9, 0.5)}
    arrays |= dict.fromkeys(("rotation", "beyond"), np.zeros(len(times)))
    arrays |= {name: np.resize(values, len(times)) for name, values in changed.items()}
    made = raced(solver, kind, robot=robot, size=size or count, **arrays)
    more = {"entrant": True, "door": "mine.py"} if mine else {}
    return replace(made, facts={**made.facts, **more, **dict(facts)})


def entrant(suite):
    """What is on record of a solver that a user entered, and that was not asked for anything."""
    whose = {"entrant": True, "door": "mine.py", "digest": "0a1b2c"}
    if suite == "ik":
        facts = {"task": "reachable", "title": "every robot", **whose}
        settings = {"kind": "any", "version": "1"}
        return record("ik", "robots/all", "mine", settings, notes={"remark": ""}, facts=facts)
    facts = {"task": "stability", **whose}
    arrays = {"stiffness": [], "limit": [], "frequency": []}
    settings, notes = {"size": 6, "version": "1"}, {"remark": ""}
    return record("cloth", "peers/stability", "mine", settings, arrays, notes=notes, facts=facts)


def lacking(solver, kind, why, robot="all"):
    """A solver that is missing or cannot."""
    facts = {"task": "reachable", "title": "every robot"}
    settings = {"kind": kind, "version": ""}
    return record("ik", f"robots/{robot}", solver, settings, notes={"remark": why}, facts=facts)


def compared(engine, cause=""):
    """One file beside one engine."""
    sizes = {"links": 3, "joints": 2, "freedoms": 2}
    apart = {"positions": 1e-15, "rotations": 2e-15, "jacobians": 3e-15}
    notes = {"cause": cause, "free mimics": ""}
    settings = {"configurations": 5}
    return record("robot_models", "robots/arm", engine, settings, sizes | apart, notes=notes,
                  facts={"title": "arm"})  # fmt: skip


def read_by_a_peer(engine):
    """One robot of the bench in the engine of a peer."""
    notes, facts = {"remark": ""}, {"task": "peers", "title": "the arm"}
    settings = {"configurations": 100, "version": "1.2"}
    arrays = {"positions": 3e-8, "rotations": 2e-7}
    return record("robot_models", "peers/arm", engine, settings, arrays, notes=notes, facts=facts)


def scaled(solver):
    """A cloth of a thousand particles: factored by one library, and stepped if by ours."""
    settings = {"particles": 1024, "iterations": 10, "stiffness": 1000.0, "h": 0.02}
    arrays = {"entries": 30_000, "factor": 0.01, "refactor": 0.004, "memory": 2**28}
    arrays |= {"before": 2**20, "residual": 0.1, "solve": [1e-4] * 3, "local": [5e-5] * 3}
    arrays |= {"step": [2e-3] * 3, "limit": [1e-4] * 3}
    return record("cloth_scale", "cloth/32x32", solver, settings, arrays)


def republished():
    """One record for each published table."""
    arrays = {"solved": [True, False], "claimed": [1, 0], "seconds": [1e-3, 3e-3], "setup": 0.1}
    counts = {"iterations": [4, 6], "residual": [1e-7, 1e-8]}
    return [
        record("ik", "published/trac_ik/ur5", "TRAC-IK, 5 ms", {}, arrays,
               facts={"task": "TRAC-IK’s table", "robot": "ur5"}),
        record("ik", "published/toolbox/ur5", "ik_LM, NR", {"method": "NR"}, arrays,
               facts={"task": "the toolbox’s table", "title": "ur5", "infeasible": 11.0}),
        *(record("ik", f"published/fabrik/{s}", "fabrik", {"tolerance": 1e-6}, counts,
                 facts={"task": "FABRIK’s table", "stratum": s})
          for s in ("reachable", "unreachable")),
    ]  # fmt: skip


def pictured():
    """The arm on a curve of three points, as drawn and evened out, and a cloth of 2 x 2."""
    curve = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.3, 0, 0.1]])
    ghosts = [[[0, 1, 0], [0, 0.5, 0.2], point] for point in curve]
    arrays = {"curve": curve, "spacing": [0.1, 0.2], "ghosts": ghosts, "residual": [1e-5] * 3}
    arrays |= {"iterations": [1, 2, 3], "largest_angle": [0.1, 0.2], "mean_angle": [0.1, 0.1]}
    spacing = {"min_spacing": 0.01, "max_spacing": 0.02}
    cloth = {"positions": [np.eye(4, 3), 2 * np.eye(4, 3)], "time": [0.0, 1.0], "pinned": [0, 1]}
    return [
        *(record("pictures", "arm/x", "ccd", {"evened": e, **spacing}, arrays,
                 facts={"task": "arm"}) for e in (False, True)),
        record("pictures", "cloth/x1", "newton", {}, cloth, facts={"task": "cloth"}),
    ]  # fmt: skip


def moved():
    """The arm on a curve by two solvers, in five frames, and a cloth of 3 x 3 by two."""
    curve = np.array([[0.1 * k, 0.0, 0.2] for k in range(5)])
    arm = np.array([[[0, 1, 0], [0.3, 0.5, 0], point] for point in curve])
    rows, columns = np.divmod(np.arange(9), 3)
    cloth = np.array([[columns, -0.2 * k * rows, rows] for k in range(4)]).swapaxes(1, 2)
    return [
        *(record("pictures", "motion/arm/x", s, {"coherent": s == "fabrik", "every": 1},
                 {"positions": arm + 0.05 * i, "curve": curve, "error": [10.0 ** (-3 - i)] * 5},
                 facts={"task": "motion of the arm", "order": i})
          for i, s in enumerate(("ccd", "fabrik"))),
        *(record("pictures", "motion/cloth/x", s, {"h": 0.1, "every": 1, "iterations": n},
                 {"positions": cloth * (1 + i), "distance": np.full((4, 9), 0.0 if i else 1e-2),
                  "pinned": [0, 2]},
                 facts={"task": "motion of the cloth", "order": i})
          for i, (s, n) in enumerate((("local_global", 1), ("newton", 100)))),
    ]  # fmt: skip


def worked(solver, stiffness=1e3, sizes=(20, 20), seconds=(1e-3, 1e-2), error=(0.5, 1e-4)):
    """One step of a cloth with ever more work."""
    arrays = {"particles": sizes, "seconds": seconds, "error": error, "remark_particles": [20]}
    labels = [f"{10**i} iterations" for i in range(len(sizes))]
    settings = {"stiffness": stiffness, "frame": 1 / 60, "version": "1"}
    facts = {"task": "work of a step", "rungs": labels}
    facts |= {"remarks": ["20 × 20, 10 iterations: tired"]}
    return record("cloth", f"peers/one step/k{stiffness:g}", solver, settings, arrays, facts=facts)


def fell(solver, stiffness=1e3, **changed):
    """A motion of a cloth by three settings: diverged, whole, cut short."""
    arrays = {
        "particles": [20, 20, 20], "frames": [6, 6, 3], "wanted": [6, 6, 6],
        "seconds": [1e-4, 1e-3, 1.0], "setup": [0.1, 0.2, 0.3],
        "implicit": [np.nan, 1e-2, 1e-3], "true": [np.nan, 2e-2, 1e-3],
        "diverged": [True, False, False], "order": [3.5], "unsure": [1e-9],
        "remark_particles": [],
    } | changed  # fmt: skip
    settings = {"stiffness": stiffness, "frame": 1 / 60, "version": "1"}
    facts = {"task": "work of a motion", "rungs": ["1 step", "4 steps", "16 steps"], "remarks": []}
    return record("cloth", f"peers/motion/k{stiffness:g}", solver, settings, arrays, facts=facts)


def missing_engine(package):
    """A cloth engine that is not installed."""
    facts = {"task": "missing"}
    return record("cloth", "peers/all", package, notes={"remark": "not here"}, facts=facts)


def needed(solver, counts, tried=100):
    """Iterations to each power of ten."""
    settings = {"size": 20, "stiffness": 1e3, "frame": 1 / 60}
    arrays = {"needed": counts, "tried": tried, "least": 1e-3}
    facts = {"task": "iterations of a step"}
    return record("cloth", "peers/iterations/k1000", solver, settings, arrays, facts=facts)


def bounded(solver, limit):
    """The longest stable step at a frequency of 100 rad/s."""
    arrays = {"stiffness": [1e3], "limit": [limit], "frequency": [100.0]}
    notes = {"remark": ""}
    return record("cloth", "peers/stability", solver, {"size": 6}, arrays, notes=notes,
                  facts={"task": "stability"})  # fmt: skip


def as_liu(solver, seconds):
    """A frame of as many vertices as in the paper."""
    arrays = {"seconds": [seconds], "error": 0.5, "vertices": 6561}
    facts = {"task": "Liu 2013"}
    return record("cloth", "peers/liu2013", solver, {"size": 81}, arrays, facts=facts)


@pytest.fixture(scope="session")
def make():
    """The makers of records, by name."""
    return SimpleNamespace(
        record=record,
        read_by_a_peer=read_by_a_peer,
        compared=compared,
        drawn=drawn,
        followed=followed,
        drifted=drifted,
        beyond=beyond,
        claim=claim,
        entered=entered,
        reached=reached,
        timed=timed,
        stepped=stepped,
        swung=swung,
        two_dampers=two_dampers,
        stepping=stepping,
        certified=certified,
        raced=raced,
        solving=solving,
        lacking=lacking,
        republished=republished,
        worked=worked,
        fell=fell,
        moved=moved,
        needed=needed,
        bounded=bounded,
        as_liu=as_liu,
    )


@pytest.fixture(scope="session")
def records():
    """A small report's worth of records; every suite went through."""
    finished = [record(FINISHED, suite, "") for suite in SUITES]
    angles = {"ccd": (1.0, 0.1), "fabrik": (2.0, 0.3)}
    arm = [drawn(s, warm, angles[s][warm]) for s in angles for warm in (False, True)]
    return [
        claim(),
        judged("CCD", "root to tip"),
        judged("honest solvers", "", ()),
        *arm,
        *followed("ccd", cold=1.0, warm=0.5, coherent=0.25),
        *drifted("ccd"),
        beyond("ccd", 0.5),
        beyond("fabrik", 0.0),
        *(reached("near", solver) for solver in ("ccd", "fabrik")),
        entered(reached("near", "My solver")),
        entered(worked("My cloth")),
        *(stepped(solver) for solver in ("local_global", "newton")),
        *(few(iterations) for iterations in (1, 10, 100)),
        stepping(),
        two_dampers(),
        certified(),
        *(swung(s, c) for c in ("undamped", "damped") for s in ("RK4", "discrete")),
        *(
            raced("Plumbob LM", kind, task)
            for kind in ("one start", "restarts")
            for task in ("reachable", "unreachable")
        ),
        lacking("pink", "one start", "pink is not installed"),
        entrant("ik"),
        entered(bounded("mine", 0.02)),
        *republished(),
        *(scaled(solver) for solver in ("supernodal", "cholespy")),
        compared("MuJoCo"),
        compared("Pinocchio", "it forgets the hand"),
        read_by_a_peer("PyBullet"),
        *(worked(solver) for solver in ("Plumbob Newton", "MuJoCo Euler")),
        fell("Plumbob Newton"),
        missing_engine("pybullet"),
        needed("newton", [1, 2, 3, 4, 5, 6, 7, np.nan]),
        bounded("MuJoCo Euler", 0.02),
        as_liu("local_global", 0.03),
        *pictured(),
        *moved(),
        timed("Plumbob, compiled", 1e-6),
        timed("Pinocchio", 5e-7),
        *(timed("Plumbob, compiled", 1e-6, work, "near", "CCD") for work in ("ik", "cloth")),
        *finished,
    ]
