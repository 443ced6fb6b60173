"""From records to tables and sentences: every number comes from a record through `metrics`."""

from collections.abc import Callable
from typing import NamedTuple

from ..tables import Table
from . import check, cloth, kinematics, timing
from .results import Results

__all__ = ["SECTIONS", "Entry", "Results", "Section", "tables"]


class Entry(NamedTuple):
    """A question, the table that answers it, and the figures that stand beside it, by name."""

    question: str
    table: Callable[[Results], Table]
    drawings: tuple[str, ...] = ()


class Section(NamedTuple):
    """A chapter of the report."""

    name: str
    title: str
    about: str
    entries: tuple[Entry, ...]


SECTIONS = (
    Section(
        "right",
        "Is it right?",
        "Nothing below counts unless the reference itself is right. Each claim computes one "
        "quantity twice, by Plumbob and by a physics engine that shares no code with it.",
        (Entry("Do Pinocchio and MuJoCo agree with the reference?", check.verdicts),),
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
                kinematics.jitter,
                ("jitter",),
            ),
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
        ),
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
        ),
    ),
)


def tables(results: Results) -> list[Table]:
    """Return all tables, in the order of the report."""
    return [entry.table(results) for section in SECTIONS for entry in section.entries]
