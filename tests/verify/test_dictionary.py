"""A look-up proposes the changes of right programs that answer a few requests as a solver does."""

from functools import cache

import numpy as np
import pytest

from plumbob.verify.dictionary import look_up as module
from plumbob.verify.dictionary.build import digest
from plumbob.verify.dictionary.entry import ChangePair, file_of, merged, read
from plumbob.verify.dictionary.look_up import UNSTEADY, look_up
from plumbob.verify.dictionary.requests import (
    ENERGY,
    FK,
    FORCES,
    IK,
    OUTPUTS,
    STEP,
    TASKS,
    is_solve,
    keys,
    requests,
    suitable,
)
from plumbob.verify.exchange import Answer
from plumbob.verify.fault_programs import (
    IN_DICTIONARY,
    changes_of,
    coded_faults,
    connection_to,
    source_of,
)
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Fixed, Greeting, System
from plumbob.verify.judgement import Verdict
from plumbob.verify.one_line import candidates, search
from plumbob.verify.one_line.mutants import Program
from plumbob.verify.one_line.right_programs import answer_of
from plumbob.verify.one_line.search import with_changed_line
from plumbob.verify.verify import DISCIPLINES, judge_cases

dictionary_of = cache(lambda task, method: read(file_of(task, method)))
# Most entries are tried in the slow run alone; a hundredth is enough to see a stale file.
EVERY = 100


def recomputed(entry, task, method):
    """Return the keys of an entry, as its program answers now."""
    program, base = entry.changed_program(), Program(source_of(IN_DICTIONARY[method or task][0]))
    rows = []
    for case in requests(task, method):
        if is_solve(case) and np.nanmax(np.abs(rows), initial=0.0) > 1e-6:
            rows.append(np.full(len(OUTPUTS[task]), np.nan))
            continue
        with np.errstate(all="ignore"), program.within(300):
            try:
                values = answer_of(program, method, case)
            except Exception:
                values = {}
        rows.append(keys(values, answer_of(base, method, case), case))
    return np.array(rows)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("every", [EVERY, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("task", "method"), TASKS)
def test_entries_answer_as_the_file_says(task, method, every):
    dictionary = dictionary_of(task, method)
    for entry, row in list(zip(dictionary.entries, dictionary.keys, strict=True))[::every]:
        np.testing.assert_allclose(recomputed(entry, task, method), row, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(("task", "method"), TASKS)
def test_a_dictionary_is_of_the_programs_as_they_are(task, method):
    assert dictionary_of(task, method).digest == digest(task, method), "run `make dictionary`"


def test_dictionaries_are_small():
    assert sum(file_of(*key).stat().st_size for key in TASKS) <= 3_000_000


class Solver(FunctionConnection):
    """A solver that counts its starts and questions, with answers that may be rounded."""

    def __init__(self, source, kind=float, noise=0.0):
        names = {}
        exec(compile(source, "solver", "exec"), names)
        super().__init__({FK: names[FK]}, Greeting(PROTOCOL, (FK,)))
        self.kind, self.noise, self.log = kind, noise, []

    def answer(self, case):
        self.log.append(case.name)
        values = super().answer(case).values
        change = self.noise * len(self.log)
        return Answer({k: (v + change).astype(self.kind).astype(float) for k, v in values.items()},
                      0.0)  # fmt: skip

    def close(self):
        self.log.append("close")


def proposals(solver, precision="double"):
    return look_up(solver, FK, "", Greeting(PROTOCOL, (FK,), precision=precision))


FAULT = "PB-FK-002"


@pytest.mark.parametrize(("kind", "precision"), [(float, "double"), (np.float32, "single")])
def test_a_known_fault_is_proposed_first_in_each_precision(kind, precision):
    solver = Solver(coded_faults()[FAULT].wrong_program, kind)
    first = proposals(solver, precision).entries[0]
    assert first.codes == (FAULT,)
    assert len(proposals(solver, precision).entries) <= module.MAX_CANDIDATES


def test_requests_are_sent_twice_to_a_new_process():
    solver = Solver(source_of("forward kinematics"))
    result = proposals(solver)
    names = [case.name for case in requests(FK, "") if suitable(case, solver.greeting)]
    assert solver.log == ["close", *names, *names]
    assert (result.entries, result.is_wrong) == ([], False)


def test_nothing_is_looked_up_for_answers_that_differ():
    result = proposals(Solver(source_of("forward kinematics"), noise=1e-3))
    assert (result.entries, result.hint) == ((), UNSTEADY)


@pytest.mark.usefixtures("verdict_alone")
@pytest.mark.parametrize("content", [None, b"", b"version", file_of(FK, "").read_bytes()[:999]])
def test_without_a_readable_dictionary_the_search_goes_on(content, tmp_path, monkeypatch):
    path = tmp_path / "forward_kinematics.xz"
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setattr(module, "file_of", lambda *_: path)
    solver = Solver(coded_faults()[FAULT].wrong_program)
    hint = proposals(solver).hint
    assert str(hint).startswith("The dictionary forward_kinematics.xz cannot be read")
    cases = DISCIPLINES[FK].cases(solver.greeting, "", 0, False)[:5]
    report = judge_cases(solver, FK, "", cases)
    searched = []
    monkeypatch.setattr(search, "changed_lines", lambda *arguments: searched.append(arguments))
    assert hint in with_changed_line(report, solver.greeting, solver).diagnosis.hints
    assert [arguments[-1] for arguments in searched] == [None]  # without proposals


@pytest.mark.parametrize("restriction", [{"rotations": False}, {"limits": True}])
def test_a_restricted_solver_has_no_dictionary(restriction):
    greeting = Greeting(PROTOCOL, (FK,), **restriction)
    assert look_up(Solver(source_of("forward kinematics")), FK, "", greeting) is None


def test_a_planar_solver_gets_requests_in_its_plane():
    greeting = Greeting(PROTOCOL, (FK,), planar=True)
    solver = Solver(coded_faults()[FAULT].wrong_program)
    assert FAULT in {code for entry in look_up(solver, FK, "", greeting).entries[:3]
                     for code in entry.codes}  # fmt: skip
    assert solver.log == ["close", "telling 3", "telling 3"]


def ccd_proposals(source, **declared):
    names = {}
    exec(compile(source, "solver", "exec"), names)
    greeting = Greeting(PROTOCOL, (IK,), methods=("ccd",), **declared)
    return look_up(FunctionConnection({IK: names["ccd"]}, greeting), IK, "ccd", greeting)


def test_an_end_that_single_sweeps_do_not_show_is_proposed():
    result = ccd_proposals(coded_faults()["PB-STOP-001"].wrong_program)
    assert result.entries[0].codes == ("PB-STOP-001",)


def test_frames_are_proposed():
    changes = [change for change in changes_of("ccd") if "R[joint], x[" in change.wrong]
    assert {change.kind for change in changes} == {"frame"}
    proposed = [{e.wrong for e in ccd_proposals(change.source).entries} for change in changes[:8]]
    assert all(proposed)
    assert any(c.wrong in wrong for c, wrong in zip(changes, proposed, strict=False))


@pytest.mark.parametrize(("code", "codes"), [("PB-CCD-001", [("PB-CCD-001",)]), (None, [])])
def test_a_known_fault_is_found_where_sweeps_are_constant(code, codes):
    source = coded_faults()[code].wrong_program if code else source_of("ccd")
    line = "    q = local_rotations.copy()\n"
    result = ccd_proposals(source.replace(line, "    max_iterations, tolerance = 12, 0.0\n" + line))
    assert [entry.codes for entry in result.entries] == codes
    assert (result.sweeps, result.is_wrong) == (12, True)


@pytest.mark.parametrize("program", [name for names in IN_DICTIONARY.values() for name in names])
def test_tables_have_their_texts_once_in_their_programs(program):
    source = source_of(program)
    for change in changes_of(program):
        assert change.source != source
        compile(change.source, program, "exec")


def test_a_second_mistake_in_another_request_hides_no_first():
    """A chain is told apart though trees answer otherwise."""
    source = coded_faults()[FAULT].wrong_program.replace(
        "    return {", "    if len(parents) == 6:\n        x = 1.7 * x\n    return {"
    )
    assert FAULT in {code for entry in proposals(Solver(source)).entries for code in entry.codes}


@pytest.mark.usefixtures("verdict_alone")
@pytest.mark.sample("1.0")
@pytest.mark.parametrize("factor", [1.0, 1.1])
def test_cases_decide_what_is_named(factor):
    """A proposal that does not give the answers to the cases is not named."""
    line = "    q = local_rotations  # w, x, y, z\n"
    source = source_of("forward kinematics").replace(line, line + "    q = q * [1, -1, -1, -1]\n")
    many = f"    if len(parents) not in (4, 6):\n        x = {factor} * x\n    return {{"
    solver = Solver(source.replace('    return {"p', many + '"p'))
    cases = DISCIPLINES[FK].cases(solver.greeting, "", 0, False)
    report = judge_cases(solver, FK, "", cases)
    explained = with_changed_line(report, solver.greeting, solver).diagnosis.explanations
    assert bool(explained) is (factor == 1.0)


def test_two_changes_at_once_keep_the_lines_of_both():
    right = "a = 1\nb = 2\nc = 3"
    assert merged(right, "a = 0\nb = 2\nc = 3", "a = 1\nb = 2\nc = 4") == "a = 0\nb = 2\nc = 4"
    with pytest.raises(ValueError, match="one line"):
        merged(right, "a = 0\nb = 2\nc = 3", "a = 5\nb = 2\nc = 3")


SPRING, PULL = "k * (length - rest)", "pull = (k * (length - rest) + c * rate) * u"
GRAVITY = "masses[:, None] * gravity"


def planted(program, *changes):
    """Return the connection to a right program with other texts."""
    source = source_of(program)
    for right, wrong in changes:
        assert source.count(right) == 1
        source = source.replace(right, wrong)
    return connection_to(source)


@pytest.mark.sample("half")
@pytest.mark.parametrize(
    ("changes", "codes"),
    [
        pytest.param([(SPRING, f"0.5 * {SPRING}"), (GRAVITY, "masses[:, None] * [0, -9.81, 0]")],
                     {"PB-FORCE-011", "PB-FORCE-003"}, id="half, constant"),
        pytest.param([(SPRING, "k * (length + rest)"), (GRAVITY, f"0.0 * {GRAVITY}")],
                     {"PB-LINE-005", "PB-FORCE-004"}, id="reversed, missing"),
        pytest.param([(PULL, "pull = (0.5 * k * (length - rest) - c * rate) * u")],
                     {"PB-FORCE-011", "PB-FORCE-030"}, id="in one line"),
    ],
)  # fmt: skip
def test_two_mistakes_of_forces_are_named_together(changes, codes):
    connection = planted("forces", *changes)
    cases = DISCIPLINES[FORCES].cases(connection.greeting, "", 0, False)
    report = judge_cases(connection, FORCES, "", cases)
    report = with_changed_line(report, connection.greeting, connection)
    assert report.verdict is Verdict.WRONG
    assert {*report.diagnosis.explanations[0].codes} == codes


def test_keys_of_mistakes_in_two_terms_add_up():
    rng = np.random.default_rng(0)
    changes = rng.standard_normal((30, 6))
    assert list(module._summands(changes, changes[7] + changes[21], 1e-6)) == [(7, 21)]
    assert list(module._summands(changes, changes[7] + 1.1 * changes[21], 1e-6)) == []


@pytest.mark.parametrize("task", [FORCES, ENERGY, STEP])
def test_restricted_systems_get_plain_requests(task):
    def names(**restriction):
        greeting = Greeting(PROTOCOL, (task,), **restriction)
        return {case.name for case in requests(task, "") if suitable(case, greeting)}

    everything, plain = names(), {case.name for case in requests(task, "")[-1:]}
    for system in (System(masses="one"), System(gravity="number"), System(rest_lengths="measured")):
        assert plain <= names(system=system) < everything
    assert plain <= names(planar=True) < everything
    assert names(fixed=Fixed(gravity=(0.0, -1.0, 0.0))) == names(system=System(continues=True))


def step_proposals(program, *changes, system=None):
    connection = planted(program, *changes)
    greeting = connection.greeting
    if system is not None:
        greeting = Greeting(PROTOCOL, (STEP,), system=system)
    return look_up(connection, STEP, "", greeting)


@pytest.mark.sample("substeps", "Verlet step")
@pytest.mark.parametrize("program", IN_DICTIONARY[STEP])
def test_right_steps_are_like_no_entry(program):
    result = step_proposals(program)
    assert (list(result.entries), result.is_wrong) == ([], False)


HEAVY = ("a[i] += gravity", "a[i] += gravity / masses[i]")


@pytest.mark.sample("one mass", "local-global")
@pytest.mark.parametrize(
    ("program", "changes", "system", "texts"),
    [
        pytest.param("Verlet step", [HEAVY], None, {"PB-FORCE-001"}, id="a = g / m"),
        pytest.param("Verlet step", [HEAVY], System(masses="one", stiffnesses="one"),
                     {"PB-FORCE-001"}, id="one mass"),
        pytest.param("local-global step", [("        b -= A[:, pinned] @ x[pinned]\n", ""),
                                           ('"y", 10, "', '"y", 30, "')],
                     None, {"PB-STEP-040"}, id="local-global"),
        pytest.param("newton step", [('/ h}', '/ h * 0.9}')], None, set(), id="velocities alone"),
    ],
)  # fmt: skip
def test_wrong_steps_are_looked_up_in_the_choices_of_their_solver(program, changes, system, texts):
    codes = {code for e in step_proposals(program, *changes, system=system).entries
             for part in candidates.parts_of(e) for code in part.codes}  # fmt: skip
    assert texts <= codes


def test_two_mistakes_of_a_step_are_proposed_together():
    right = "(length - rest_lengths[s]) * u"
    changes = (right, right.replace("-", "+")), ("velocities[j] - ", "velocities[j] + ")
    first, *_ = step_proposals("Verlet step", *changes).entries
    assert isinstance(first, ChangePair)
