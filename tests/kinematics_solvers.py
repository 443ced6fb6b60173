"""Solvers of kinematics for the tests: the textbook, programs with faults, and the reference."""

import inspect
from dataclasses import replace

import conformance_students as students

from plumbob.reference import Skeleton, forward_kinematics, solve_ik, track
from plumbob.verify.case import Case
from plumbob.verify.cause_search import CauseSearch, JudgedAnswers
from plumbob.verify.fault_programs import coded_faults, source_of
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import Greeting
from plumbob.verify.judgement import Verdict
from plumbob.verify.kinematics.predictions import TEXTBOOK, forward, predict_track, solve
from plumbob.verify.laws import HOLDS
from plumbob.verify.verify import DISCIPLINES, judge_cases, verify

FORWARD, INVERSE = "forward_kinematics", "inverse_kinematics"
TRACK, RESAMPLE = "track", "resample"
METHODS = ("ccd", "fabrik")
LIMITS = ("effector", "tolerance", "max_iterations")


# Honest programs that make other choices than the textbook: the method, a solver and its options.
HONEST = {
    "half-way vector": ("ccd", students.ccd, {}),
    "axis and angle": ("ccd", students.ccd, {"kind": students.axis_angle}),
    "not normalised": ("ccd", students.ccd, {"normalises": False}),
    "small angles dropped": ("ccd", students.ccd, {"dead": 1e-6}),
    "root to tip": ("ccd", students.ccd, {"up": False}),
    "tests after each joint": ("ccd", students.ccd, {"tests_each": True}),
    "effector rotated": ("ccd", students.ccd, {"rotates_tip": True}),
    "capped": ("ccd", students.ccd, {"kind": students.axis_angle, "most": 0.3}),
    "damped": ("ccd", students.ccd, {"kind": students.axis_angle, "share": 0.7}),
    "FABRIK": ("fabrik", students.fabrik, {}),
    "straight beyond reach": ("fabrik", students.fabrik, {"stretches": True}),
    "tests after a sweep": ("fabrik", students.fabrik, {"tests_last": True}),
    "rotations from rest": ("fabrik", students.fabrik, {"from_rest": True}),
}


def judged(task, function, method="", seed=0, **greeting):
    """Return the report on a function."""
    said = Greeting(1, (task,), methods=(method,), **greeting)
    return verify(FunctionConnection({task: function}, said), seed=seed).tasks[0]


def judged_some(task, function, method="", every=5):
    """Return the report on a function that is asked one case of so many."""
    said = Greeting(1, (task,), methods=(method,))
    cases = DISCIPLINES[task].cases(said, method, 0, False)[::every]
    return judge_cases(FunctionConnection({task: function}, said), task, method, cases)


def explained(task, exchanges, greeting, base=None):
    """Return the report on answers with the faults that explain them."""
    verdict = DISCIPLINES[task].judge(exchanges, greeting, "")
    report = replace(verdict, exchanges=exchanges, greeting=greeting)
    diagnosis = DISCIPLINES[task].diagnose(JudgedAnswers(report, greeting, CauseSearch(), base))
    return replace(report, diagnosis=diagnosis)


def case_of(task, inputs, **facts):
    return Case("", task, inputs, "", HOLDS, facts=facts)


def textbook(task, method="ccd", choices=TEXTBOOK):
    """Return the textbook's solver with the choices of an honest program."""

    def function(**inputs):
        if task == FORWARD:
            return dict(zip(("positions", "rotations"), forward(inputs), strict=True))
        if task == TRACK:
            answer = predict_track(method, case_of(task, inputs))
            answer = {"positions": answer["all_positions"], **answer}
            names = {"positions", "local_rotations"} & answer.keys()
            return {name: answer[name] for name in names}
        local, positions, _ = solve(method, inputs, choices)
        return {"local_rotations": local, "positions": positions}

    return function


def faulty(task, *codes, method="ccd"):
    """Return the function of a right program with known faults in its lines."""
    faults = [coded_faults()[code] for code in codes]
    own = {FORWARD: "forward kinematics", TRACK: "track"}.get(task, method)
    source = source_of(faults[0].program if faults and faults[0].task == task else own)
    for fault in faults:
        source = fault.planted_in(source)
    names = {}
    exec(compile(source, "program", "exec"), names)
    function = names[method if task == INVERSE else task]
    parameters = inspect.signature(function).parameters
    return lambda **inputs: function(**{name: inputs[name] for name in parameters})


def reference(task, solver=""):
    """Return the reference's solver of a task."""

    def function(parents, offsets, local_rotations, target=None, curve=None, **inputs):
        skeleton = Skeleton(parents, offsets)
        if task == FORWARD:
            return tuple(forward_kinematics(skeleton, local_rotations))
        options = {name: inputs[name] for name in LIMITS}
        if task == TRACK:
            found = track(skeleton, curve, solver, start=local_rotations, **options)
            return {"local_rotations": found.local_rotations, "positions": found.positions}
        found = solve_ik(skeleton, local_rotations, target, solver, **options)
        names = ("local_rotations", "positions", "residual", "iterations")
        answer = {name: getattr(found, name) for name in names}
        return answer | {"converged": found.outcome.name == "CONVERGED"}

    return function


def broken(report, least=Verdict.WRONG):
    """Return the laws that are broken, in whatever case."""
    findings = (finding for told in report.judgements for finding in told.findings)
    return {finding.law for finding in findings if finding.verdict >= least}


def told(report):
    """Return what is said of findings that are not right."""
    findings = (finding for one in report.judgements for finding in one.findings)
    return [str(finding.sentence) for finding in findings if finding.verdict]


def named(report):
    """Return the classes of faults that are named."""
    return [set(one.faults) for one in report.diagnosis.explanations]
