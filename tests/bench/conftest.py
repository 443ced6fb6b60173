"""Records made up for the tests, and a stamp that does not depend on the machine."""

import importlib
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from plumbob.bench.experiments import SUITES
from plumbob.bench.figures import canvas
from plumbob.bench.measure.isolation import WorkerProcess
from plumbob.bench.measure.record import FINISHED, Record
from plumbob.bench.problems.robots import group_of

SAMPLES = tomllib.loads(Path(__file__).with_name("records.toml").read_text(encoding="utf-8"))
STAMP = {
    "machine": {"processor": "a <b>slide</b> rule", "cores": 1, "memory_gib": 0.5, "system": "x"},
    "versions": {"python": "3.11.0", "plumbob": "0.0", "numpy": "2", "matplotlib": ""},
    "source": "0123456789ab",
}
WHEN = "2000-01-02T03:04:05+00:00"


def record(suite, problem, solver, settings=None, arrays=None, facts=None, notes=None, **more):
    """A record with a stamp; the lists of `arrays` become arrays."""
    numbers = {name: np.asarray(values) for name, values in (arrays or {}).items()}
    measured = {**(facts or {}), **(notes or {}), **numbers}
    fields = {"stamp": STAMP, "when": WHEN, **more}
    return Record(suite, problem, solver, settings or {}, measured, **fields)


def sample(name, **changes):
    """A record of `records.toml`; a mapping among the changes adds to the one there."""
    fields = dict(SAMPLES[name])
    for part, change in changes.items():
        fields[part] = {**fields.get(part, {}), **change} if isinstance(change, dict) else change
    return record(**fields)


def drawn(solver, warm, angle):
    """The arm drawing a curve, in three frames."""
    arrays = {"largest_angle": [angle, angle / 2], "mean_angle": [angle / 4, angle / 4]}
    arrays |= {"iterations": [4, 5, 6]} if solver == "ccd" else {}
    return sample("drawn", solver=solver, settings={"warm": warm}, arrays=arrays)


def followed(solver, **angles):
    """A closed curve of three points followed in three modes, its angles halving."""
    nearest = {"residual": [1e-5, 2e-5, 3e-5], "iterations": [12, 11, 10]}
    return [
        sample(
            *("followed",),
            solver=solver,
            settings={"mode": mode},
            arrays={
                **(nearest if mode == "nearest" else {}),
                "largest_angle": [angle, angle / 2, angle / 2],
                "mean_angle": [angle / 4, angle / 4, angle / 8],
            },
        )
        for mode, angle in angles.items()
    ]


def drifted(solver, curve="circle"):
    """Three repetitions, warm and nearest."""
    modes = {"warm": [0.1, 0.2, 0.3], "nearest": [0.0, 1e-9, 0.0]}
    which = {"problem": f"drift/{curve}", "solver": solver}
    return [
        sample("drifted", **which, settings={"mode": mode}, arrays={"drift": drift})
        for mode, drift in modes.items()
    ]


def beyond(solver, bend):
    """Two targets out of the arm's reach of 2 m."""
    return sample("beyond", solver=solver, arrays={"bend": [0.0, bend]})


def claim(name="spring forces", held=True, **notes):
    """A verdict of the cross-check."""
    notes = {"failure": "" if held else "they differ"} | notes
    return sample("claim", problem=name, arrays={"holds": held}, notes=notes)


def timed(solver, seconds, subject="kinematics", group="10 balls", work="one pose a call"):
    """Three rounds of a benchmark."""
    facts = {"subject": subject, "group": group, "work": work, "title": f"{group}, {work}"}
    which = {"problem": f"{subject}/{group}/{work}", "solver": solver}
    rounds = {"seconds": [[seconds, 2 * seconds, 3 * seconds]]}
    return sample("timed", **which, arrays=rounds, facts=facts)


def reached(stratum, solver):
    """Two targets for the chain, with the residual of three iterations."""
    facts = {"stratum": stratum, "title": f"chain, {stratum}"}
    return sample("reached", problem=f"chain/{stratum}", solver=solver, facts=facts)


def entered(made):
    """The same record of a solver that a user entered."""
    words = {"entrant": True, "door": "my_ik.py", "digest": "0123456789ab"}
    settings = {**made.settings, "version": "1.0"}
    commit = {"solver_commit": "0123456789abcdef with changes"}
    made = made.with_measured(**words)
    return replace(made, settings=settings, conditions=commit)


def two_dampers(apart=(0.04, 0.02)):
    """The distance of two laws of dampers in two steps."""
    arrays = {"h": 0.02 / 2.0 ** np.arange(len(apart)), "difference": apart}
    return sample("two_dampers", settings={"halvings": len(apart) - 1}, arrays=arrays)


def swung(solver, cloth="undamped", left=(1.0, 0.5)):
    """The energy that an integrator leaves of a long swing."""
    arrays = {"time": np.arange(len(left)) / 6, "left": left}
    facts = {"title": cloth, "damping": 0.0 if cloth == "undamped" else 0.2}
    return sample("swung", problem=f"swing/{cloth}", solver=solver, arrays=arrays, facts=facts)


def certified(solver="newton", settings=(), arrays=(), notes=None):
    """One step of a cloth in mid-swing, its answer covered unless Newton colours them itself."""
    changes = {"settings": dict(settings or ()), "arrays": dict(arrays or ())}
    return sample("certified", solver=solver, **changes, notes=notes or {"coverage": "COVERED"})


def raced(solver, kind, task="reachable", robot="arm", size=4, **changed):
    """Four targets in two strata: one solved, one missed, one claim denied, one solved."""
    facts = {"task": task, "title": f"the {robot}", "group": group_of(robot)}
    problem = f"{'robots' if task == 'reachable' else task}/{robot}"
    which = {"problem": problem, "solver": solver, "size": size, "settings": {"kind": kind}}
    if "seconds" in changed:
        changed["seconds"] = np.atleast_2d(changed["seconds"])
    return sample("raced", **which, arrays=changed, facts=facts)


def solving(
    solver, hits, kind="one start", robot="arm", *, count=200, begun=None, size=None,
    seconds=1e-3, mine=False, facts=(), **changed,
):  # fmt: skip
    """The first `begun` of so many targets, the first `hits` of them solved, each in so long."""
    times = np.resize(seconds, np.size(seconds) if np.ndim(seconds) else begun or count)
    solved = np.arange(len(times)) < hits
    arrays = {"solved": solved, "claims": solved.astype(int), "seconds": times}
    arrays |= {"stratum": np.arange(len(times)) % 2, "position": np.where(solved, 1e-9, 0.5)}
    arrays |= dict.fromkeys(("rotation", "beyond"), np.zeros(len(times)))
    arrays |= {name: np.resize(values, len(times)) for name, values in changed.items()}
    made = raced(solver, kind, robot=robot, size=size or count, **arrays)
    more = {"entrant": True, "door": "mine.py"} if mine else {}
    return made.with_measured(**more, **dict(facts))


def entrant(suite):
    """A solver that a user entered, without a task for robots or without a frequency."""
    if suite == "ik":
        return sample("entrant")
    arrays, facts = {"stiffness": [], "limit": [], "frequency": []}, SAMPLES["entrant"]["facts"]
    facts = {name: facts[name] for name in ("entrant", "door", "digest")}
    version = {"version": "1"}
    return sample("bounded", solver="mine", settings=version, arrays=arrays, facts=facts)


def lacking(solver, kind, why, robot="all"):
    """A solver that is missing or unable."""
    which = {"problem": f"robots/{robot}", "solver": solver}
    return sample("lacking", **which, settings={"kind": kind}, notes={"remark": why})


def compared(engine, cause=""):
    """One file beside one engine."""
    return sample("compared", solver=engine, notes={"cause": cause})


def republished():
    """One record for each published table."""
    strata = ("reachable", "unreachable")
    return [
        sample("republished_trac_ik"),
        sample("republished_toolbox"),
        *(
            sample("republished_fabrik", problem=f"published/fabrik/{s}", facts={"stratum": s})
            for s in strata
        ),
    ]


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
        *(record("pictures", "motion/arm/x", s, {"every": 1},
                 {"positions": arm + 0.05 * i, "curve": curve, "error": [10.0 ** (-3 - i)] * 5},
                 facts={"task": "motion of the arm", "order": i})
          for i, s in enumerate(("ccd", "fabrik"))),
        *(record("pictures", "motion/cloth/x", s, {"h": 0.1, "every": 1, "iterations": n},
                 {"positions": cloth * (1 + i), "distance": np.full((4, 9), 0.0 if i else 1e-2),
                  "pinned": [0, 2]},
                 facts={"task": "motion of the cloth", "order": i})
          for i, (s, n) in enumerate((("local_global", 1), ("newton", 100)))),
    ]  # fmt: skip


def worked(
    solver,
    stiffness=1e3,
    sizes=(20, 20),
    seconds=(1e-3, 1e-2),
    error=(0.5, 1e-4),
    settings=(),
    facts=(),
):
    """One step of a cloth with ever more work."""
    which = {"problem": f"peers/one step/k{stiffness:g}", "solver": solver}
    arrays = {"particles": sizes, "seconds": seconds, "error": error}
    facts = {"rungs": [f"{10**i} iterations" for i in range(len(sizes))], **dict(facts)}
    settings = {"stiffness": stiffness, **dict(settings)}
    return sample("worked", **which, settings=settings, arrays=arrays, facts=facts)


def fell(solver, stiffness=1e3, **changed):
    """A motion of a cloth by three settings: diverged, and ever nearer to the truth."""
    which = {"problem": f"peers/motion/k{stiffness:g}", "solver": solver}
    return sample("fell", **which, settings={"stiffness": stiffness}, arrays=changed)


def bounded(solver, limit):
    """The longest stable step at a frequency of 100 rad/s."""
    return sample("bounded", solver=solver, arrays={"limit": [limit]})


MAKERS = (
    *(record, sample, compared, drawn, followed, drifted, beyond, claim, entered, reached, timed),
    *(swung, two_dampers, certified, raced, solving, lacking, republished, worked, fell, moved),
    bounded,
)


@pytest.fixture(scope="module")
def importable(tmp_path_factory):
    """Return what writes a module that this process and its workers can import."""
    folder, names = tmp_path_factory.mktemp("modules"), []

    def write(name, text):
        (folder / f"{name}.py").write_text(text)
        names.append(name)
        return importlib.import_module(name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(folder))
        patch.syspath_prepend(folder)
        yield write
    for name in names:
        sys.modules.pop(name, None)


@pytest.fixture
def in_this_process():
    """Return a class of worker processes that are none."""
    return type("InThisProcess", (WorkerProcess,), {"stream": lambda self, job: job.perform()})


@pytest.fixture(scope="session", autouse=True)
def short_pdf():
    """Leave figures out of PDF files, which take longer than all else of a report."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(canvas, "pdf_of", lambda figure, title, mark="": b"%PDF" + mark.encode())
        yield


@pytest.fixture(scope="session")
def make():
    """The makers of records, by name."""
    return SimpleNamespace(**{maker.__name__: maker for maker in MAKERS})


@pytest.fixture(scope="session")
def records():
    """A small report's worth of records; every suite went through."""
    finished = [record(FINISHED, suite, "") for suite in SUITES]
    angles = {"ccd": (1.0, 0.1), "fabrik": (2.0, 0.3)}
    arm = [drawn(s, warm, angles[s][warm]) for s in angles for warm in (False, True)]
    return [
        claim(),
        *arm,
        *followed("ccd", cold=1.0, warm=0.5, nearest=0.25),
        *drifted("ccd"),
        beyond("ccd", 0.5),
        beyond("fabrik", 0.0),
        *(reached("near", solver) for solver in ("ccd", "fabrik")),
        entered(reached("near", "My solver")),
        entered(worked("My cloth")),
        *(sample("stepped", solver=solver) for solver in ("local_global", "newton")),
        *(sample("few", settings={"iterations": n}) for n in (1, 10, 100)),
        two_dampers(),
        certified(),
        sample("proven"),
        *(swung(s, c) for c in ("undamped", "damped") for s in ("RK4", "discrete")),
        *(
            raced("Plumbob LM, first phase", kind, task)
            for kind in ("one start", "portfolio", "restarts")
            for task in ("reachable", "unreachable")
        ),
        *(
            raced("Plumbob LM, first phase", kind, robot=robot)
            for kind in ("one start", "portfolio", "restarts")
            for robot in ("ur10", "z1")
        ),
        lacking("pink", "one start", "pink is not installed"),
        entrant("ik"),
        entered(bounded("mine", 0.02)),
        *republished(),
        sample("scaled", solver="newton_cg"),
        sample("scaled_chain", solver="ccd"),
        compared("MuJoCo"),
        compared("Pinocchio", "it forgets the hand"),
        sample("read_by_a_peer", solver="PyBullet"),
        *(worked(solver) for solver in ("Plumbob Newton", "MuJoCo Euler")),
        fell("Plumbob Newton"),
        sample("missing_engine", solver="pybullet"),
        bounded("MuJoCo Euler", 0.02),
        sample("listed"),
        sample("met"),
        sample("as_liu", solver="local_global", arrays={"seconds": [0.03]}),
        *pictured(),
        *moved(),
        timed("Plumbob, compiled", 1e-6),
        timed("Pinocchio", 5e-7),
        *(
            timed("Plumbob, compiled", 1e-6, work, "near", "CCD")
            for work in ("jacobians", "ik", "cloth")
        ),
        *finished,
    ]
