"""A discipline of a few cases for each of three tasks, for tests of what is told about answers."""

import sys

import numpy as np

import plumbob.verify.verify  # noqa: F401
from plumbob.reference import Skeleton, forward_kinematics, rotation, scenes, solve_ik
from plumbob.text.sentence import sentence
from plumbob.verify.case import Case
from plumbob.verify.exchange import Answer, Exchange
from plumbob.verify.explain import Variant, explain
from plumbob.verify.gaps import difference
from plumbob.verify.judgement import (
    CaseJudgement,
    Diagnosis,
    Finding,
    TaskReport,
    Verdict,
)

TOLERANCE = 1e-12


class SmallDiscipline:
    """Judges one output of a task by its distance from the reference's."""

    def __init__(self, task, output, make, right, wrong):
        self.task, self.output = task, output
        self._make, self.right, self._wrong = make, right, wrong

    def cases(self, greeting, method, seed, thorough):
        made = (self._make(seed, i, method) for i in range(8 if thorough else 4))
        return [
            Case(f"{self.task}, pose {i}", self.task, inputs, "poses", sentence("A random one."),
                 follows=f"{self.task}, pose 0" if i == 3 else "")
            for i, inputs in enumerate(made)
        ]  # fmt: skip

    def judge(self, asked, greeting, method):
        return TaskReport(self.task, method, [self._judged(one) for one in asked], Diagnosis())

    def diagnose(self, judged):
        pairs = zip(judged.exchanges, judged.report.judgements, strict=True)
        return self._why([one for one, j in pairs if j.verdict is Verdict.WRONG])

    def _judged(self, one: Exchange):
        expected = self.right(one.case)
        if not isinstance(one.answer, Answer):
            return CaseJudgement(one.case, one.answer, (), expected, None, 1e-5)
        apart = difference(expected, one.answer.values)
        verdict = Verdict.RIGHT if apart <= TOLERANCE else Verdict.WRONG
        words = sentence("{output} differ by {apart:.2g} of their size", output=self.output,
                         apart=apart)  # fmt: skip
        finding = Finding("equal to the reference", verdict, apart, TOLERANCE, "", words, 1)
        digits = float(np.clip(-np.log10(max(apart, 1e-16)), 0.0, 16.0))
        return CaseJudgement(one.case, one.answer, (finding,), expected, digits, 1e-5)

    def _why(self, wrong):
        if not wrong:
            return Diagnosis()
        variants = [Variant(("own_rotation",), self._wrong)]
        told = explain(
            variants, wrong, 1e-9,
            lambda keys: sentence("Its own rotation is applied to a joint's own offset."),
        )  # fmt: skip
        broken = None if told else sentence("The law of positions broke first, at joint 1.")
        return Diagnosis(told, None, broken, (sentence("It remembers earlier requests."),))


def a_pose(seed, i, method):
    rng = np.random.default_rng([seed, i])
    skeleton = Skeleton([-1, *range(i + 1)], rng.normal(size=(i + 2, 3)))
    local = rotation.random(rng, i + 2)
    return {"parents": skeleton.parents, "offsets": skeleton.offsets, "local_rotations": local}


def own_rotation(parents, offsets, local_rotations):
    """Forward kinematics in which a joint's own rotation rotates its own offset."""
    pose = forward_kinematics(Skeleton(parents, offsets), local_rotations)
    positions = pose.positions.copy()
    for j, parent in enumerate(parents):
        if parent >= 0:
            positions[j] = positions[parent] + rotation.rotate(pose.rotations[j], offsets[j])
    return positions


def _forward(case):
    names = ("parents", "offsets", "local_rotations")
    parents, offsets, local = (case.inputs[name] for name in names)
    return {"positions": forward_kinematics(Skeleton(parents, offsets), local).positions}


def a_target(seed, i, method):
    pose = a_pose(seed, i + 1, method)
    effector = len(pose["parents"]) - 1
    limits = {"effector": effector, "tolerance": 1e-9, "max_iterations": 1000, "method": method}
    return {**pose, "target": np.full(3, 0.3), **limits}


def a_cloth(seed, i, method):
    cloth, state = scenes.lab_cloth()
    return {
        "masses": cloth.masses, "springs": cloth.springs, "rest_lengths": cloth.rest_lengths,
        "stiffnesses": cloth.stiffnesses, "dampings": cloth.dampings, "pinned": cloth.pinned,
        "gravity": cloth.gravity, "positions": state.positions, "velocities": state.velocities,
        "h": 0.1 * (i + 1),
    }  # fmt: skip


def _fallen(case):
    x, h = case.inputs["positions"], case.inputs["h"]
    fallen = x + h**2 * case.inputs["gravity"]
    fallen[case.inputs["pinned"]] = x[case.inputs["pinned"]]
    return {"positions": fallen}


def _solved(case):
    inputs = case.inputs
    skeleton = Skeleton(inputs["parents"], inputs["offsets"])
    return {"local_rotations": solve_ik(skeleton, inputs["local_rotations"], inputs["target"],
                                        solver="fabrik").local_rotations}  # fmt: skip


def _own(case):
    names = ("parents", "offsets", "local_rotations")
    return {"positions": own_rotation(*(case.inputs[name] for name in names))}


SMALL = {
    "forward_kinematics": SmallDiscipline(
        "forward_kinematics", "positions", a_pose, _forward, _own
    ),
    "inverse_kinematics": SmallDiscipline(
        "inverse_kinematics", "local_rotations", a_target, _solved, lambda case: {}
    ),
    "mass_spring_step": SmallDiscipline(
        "mass_spring_step", "positions", a_cloth, _fallen, lambda case: {}
    ),
}


def use_small_disciplines(patch):
    """Judge by these disciplines alone, without a search; wrong answers show one sentence."""
    module = sys.modules["plumbob.verify.verify"]

    def observe(connection, report, seed):
        return (sentence("Forces pull upwards."),) if report.verdict >= Verdict.WRONG else ()

    for task, discipline in SMALL.items():
        patch.setitem(module.DISCIPLINES, task, discipline)
    patch.setattr(module, "with_changed_line", lambda report, *_, **__: report)
    patch.setattr(module.observations, "observe", observe)
