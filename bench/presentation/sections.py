"""From records to tables and sentences: every number comes from a record through `metrics`."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from ..experiments.chain import tables as kinematics
from ..experiments.check import tables as check
from ..experiments.closed_curves import tables as tracking
from ..experiments.cloth import tables as cloth
from ..experiments.cloth_peers import tables as cloth_peers
from ..experiments.cloth_scale import tables as cloth_scale
from ..experiments.energy import tables as energy
from ..experiments.first_call import tables as first_call
from ..experiments.newton import tables as newton
from ..experiments.published import tables as published
from ..experiments.robot_models import tables as robot_models
from ..experiments.robots import tables as robots
from ..experiments.robots.tables import KINDS
from ..experiments.timing import tables as timing
from .results import Results, plain, sift
from .tables import Table

__all__ = ["SECTIONS", "Entry", "Results", "Section", "plain", "sift", "tables"]


class Entry(NamedTuple):
    """A question, the table that answers it, and the figures that stand beside it, by name."""

    question: str
    table: Callable[[Results], Table]
    drawings: tuple[str, ...] = ()


class Section(NamedTuple):
    """A chapter of the report, and the suites that it is made from."""

    name: str
    title: str
    about: str
    entries: tuple[Entry, ...]
    suites: tuple[str, ...] = ()


def _robot_entries(kind: str) -> tuple[Entry, ...]:
    made, end = robots.TABLES[kind], KINDS[kind]
    return (
        Entry(f"With {kind}: how many targets are solved, how soon?", made.success),
        Entry(f"With {kind}: which targets are hard?", made.strata),
        Entry(f"With {kind}: what happens out of reach?", made.unreachable),
        Entry(f"With {kind}: who is ahead at an equal budget?", made.budgets, (f"budget_{end}",)),
        Entry(f"With {kind}: who is the fastest, how often?", made.profiles, (f"profile_{end}",)),
    )


SECTIONS = (
    Section(
        "right",
        "Is it right?",
        "Nothing below counts unless the reference itself is right. Each claim computes one "
        "quantity twice, by Plumbob and by a physics engine that shares no code with it.",
        (
            Entry("Do Pinocchio and MuJoCo agree with the reference?", check.verdicts),
            Entry("On which robots and characters do they agree?", robot_models.agreement),
        ),
        ("check", "robot_models"),
    ),
    Section(
        "kinematics",
        "Task 1: inverse kinematics",
        "The lab’s arm of five joints draws curves with its tip, by cyclic coordinate descent "
        "(CCD) and by FABRIK; a chain of ten ball joints reaches for targets near, far, at the "
        "edge of its reach and beyond it, also by Levenberg-Marquardt on the engines’ kinematics "
        "(LM).",
        (
            Entry(
                "Q1. If the target is too far away, what does inverse kinematics give?",
                kinematics.beyond_reach,
            ),
            Entry(
                "Q2. How many iterations do CCD and FABRIK need?",
                kinematics.iterations,
                ("iterations",),
            ),
            Entry(
                "Q3. Joints may jitter from frame to frame: how is it avoided?",
                tracking.jitter,
                ("jitter",),
            ),
            Entry("What does a calm motion cost?", tracking.price),
            Entry("Does a motion drift from round to round?", tracking.drift),
            Entry(
                "How often, and how closely, is the target met?",
                kinematics.accuracy,
                ("ik_residuals",),
            ),
            Entry(
                "What does resampling the custom curve change?",
                kinematics.resampling,
                ("arm_draws",),
            ),
        ),
        ("arm", "tracking", "ik", "pictures"),
    ),
    Section(
        "robots",
        "Robots and a character",
        "Every solver that is installed, on real arms and on a character with two hands to place: "
        "the same targets, starts and judge for all. Solvers that make one attempt and solvers "
        "that start again answer different questions and stand in different tables.",
        (
            Entry("Who takes part?", robots.who),
            Entry("On which robots?", robots.models),
            *(entry for kind in KINDS for entry in _robot_entries(kind)),
            Entry("What did TRAC-IK’s authors measure, and what do we?", published.trac_ik),
            Entry("And those of the Robotics Toolbox?", published.toolbox),
            Entry("And those of FABRIK?", published.fabrik),
        ),
        ("ik",),
    ),
    Section(
        "cloth",
        "Task 2: the cloth by implicit Euler",
        "The lab’s cloth of 11 × 11 particles falls from rest and swings from two corners, as it "
        "is and stiffer. A step minimises the objective g of Liu et al. (2013).",
        (
            Entry(
                "How far is one solve of Q x = b from the step it stands for?",
                cloth.few_iterations,
                ("falling_cloth",),
            ),
            Entry(
                "How fast do local/global and Newton converge?",
                cloth.convergence,
                ("cloth_convergence",),
            ),
            Entry("Does Newton always get there?", cloth.newton_steps),
            Entry("Which answers to a hard step are proven?", newton.certified),
            Entry("How many iterations does an error of 1e-8 take?", cloth_peers.iterations),
            Entry(
                "Which of all solvers is soonest near the converged step?",
                cloth_peers.one_step,
                ("work_precision_step",),
            ),
            Entry(
                "And frame after frame, near implicit Euler and near the truth?",
                cloth_peers.motion,
                ("work_precision_implicit", "work_precision_truth"),
            ),
            Entry("How long may the steps of explicit solvers be?", cloth_peers.stability),
            Entry("What did Liu et al. (2013) measure, and what do we?", cloth_peers.liu_2013),
            Entry("How far apart are the two laws of dampers?", cloth.dampers),
            Entry("What happens to the energy over many steps?", energy.energy, ("energy",)),
        ),
        ("cloth", "newton", "energy", "pictures"),
    ),
    Section(
        "speed",
        "How fast?",
        "The same work by the compiled and the plain source, and by both engines, in one run on "
        "one core.",
        (
            Entry("Forward kinematics", timing.kinematics, ("timing_kinematics",)),
            Entry("Inverse kinematics", timing.inverse_kinematics, ("timing_ik",)),
            Entry("A step of the cloth", timing.cloth, ("timing_cloth",)),
            Entry("Iterations, up to a million particles", cloth_scale.iterations),
            Entry("Factors, up to a million particles", cloth_scale.factors),
            Entry("What does the first call cost, which compiles?", first_call.first_calls),
        ),
        ("timing", "cloth_scale", "first_call"),
    ),
)


def tables(results: Results, suites: Iterable[str] | None = None) -> list[Table]:
    """Return the tables made from any of these suites, or all, in the order of the report."""
    return [
        entry.table(results)
        for section in SECTIONS
        if suites is None or set(suites) & set(section.suites)
        for entry in section.entries
    ]
