"""Search the textbook's faults that reproduce answers."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from plumbob.text.sentence import Sentence

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import TRIAL, Variant, explain
from ..judgement import (
    LEAST_SHARE,
    Diagnosis,
    Explanation,
)
from .algebra import DEGREE
from .faults import SwitchFault, combinations, describe, switches
from .predictions import (
    CONJUGATED,
    IN_DEGREES,
    REVERSED,
    predict_forward,
    predict_inverse,
    predict_track,
)
from .switches import Switches
from .textbook import (
    IN_FRAMES,
    OF_GLOBAL_LINKS,
)


def variants(
    method: str, max_faults: int = 3, base: Sequence[SwitchFault] = ()
) -> Iterator[Variant]:
    """Yield the textbook's method with all combinations of its faults, the fewest first.

    Combinations with the faults in `base`, the known faults of forward kinematics, come first.
    A fault beside which other choices of a program show comes with each choice.
    """
    task, _, solver = method.rpartition(" ")
    predict: Callable[[Switches, Case], Mapping[str, Any]] = predict_forward
    if method != "forward":
        predict = partial(predict_track if task else predict_inverse, solver)
    with_base = combinations(method, base) if base else ()
    by_count = itertools.groupby(itertools.chain(with_base, combinations(method)), key=len)
    for count, same_size in by_count:
        if count > max_faults + len(base):
            return
        special = []
        for faults in same_size:
            keys, switched = tuple(fault.key for fault in faults), switches(faults)
            for choices in programs(solver, faults, base):
                variant = Variant(keys, partial(predict, switched._replace(**choices)))
                if IN_DEGREES in keys:
                    variant = variant._replace(amplification=1.0 / DEGREE)
                if any(choices.values()):
                    special.append(variant._replace(is_special=True))
                else:
                    yield variant
        yield from special


def programs(
    method: str, faults: Sequence[SwitchFault], base: Sequence[SwitchFault]
) -> list[dict[str, int]]:
    """Return the choices of right programs that show beside some faults, as switches.

    The choices show beside a single fault, or a single fault besides the `base`.
    """
    parts, names = {fault.part for fault in faults}, {fault.switch for fault in faults}
    base_keys = {fault.key for fault in base}
    if not faults or sum(fault.key not in base_keys for fault in faults) > 1:
        return [{}]
    is_forward, is_fabrik = method == "forward", method == "fabrik"
    if "spin" in names:
        return [{"grouping": grouping} for grouping in range(2)]
    # a reversed product shows in the program's rotations of vectors too, by q v q*
    is_reversed = any(fault.key == REVERSED for fault in faults)
    of_globals = any(f.switch == "rotations" and f.number >= OF_GLOBAL_LINKS for f in faults)
    rules = is_fabrik and (
        parts & {"quaternion", "forward", "arc"} or names & {"rotations", "angle", "link"}
    )
    globals_ = not is_forward and (names & {"rotations", "applied"} or parts & {"forward", "arc"})
    tips = 4 if "forward" in parts else 2 if names & {"applied", "aim", "angle"} else 1
    table: Sequence[tuple[Any, str, Sequence[int]]] = (
        ("quaternion" in parts, "rotating", range(int(is_reversed), 3)),
        ("quaternion" in parts, "unit", (0, 2) if is_forward else range(3)),
        ("arc" in parts, "unit", range(2)),
        (not is_forward and parts & {"quaternion", "forward"}, "grouping",
         range(2 if is_fabrik else 5)),
        (rules, "rule", range(6 if parts & {"forward", "fabrik"} else 4)),
        (of_globals, "rule", (0, 3, 5)),
        (is_fabrik and "forward" in parts, "returned", range(2)),
        (globals_, "global_rotations", range(3)),
        (is_fabrik and parts & {"fabrik", "forward", "arc"}, "converted", range(2)),
        (method == "ccd" and tips > 1, "tip", range(tips)),
        (is_fabrik and ("lengths" in names or "forward" in parts), "stretch", (0, 9)),
    )  # fmt: skip
    numbers = {name: values for is_shown, name, values in table if is_shown}
    choices = [
        dict(zip(numbers, values, strict=True)) for values in itertools.product(*numbers.values())
    ]
    if any(fault.key == CONJUGATED for fault in faults) and method != "forward":
        # where rotations are read, or written too; a helper may give arcs that are inverse as well
        choices += [{"product": 0, "numbers": 5}]
        choices += [{"product": 0, "numbers": 13, "angle": angle} for angle in range(2)]
    return [choice for choice in choices if _is_program(choice, is_fabrik)]


def _is_program(choice: Mapping[str, int], is_fabrik: bool) -> bool:
    """Return whether choices go together."""
    if choice.get("tip", 0) >= IN_FRAMES:
        return not any(choice.get(name) for name in ("global_rotations", "grouping"))
    return not is_fabrik or choice.get("global_rotations") != 2 or choice.get("rule") == 5


# The most cases that are compared with every variant, small and wrong ones first.
COMPARED = 20


# A track takes hundreds of sweeps: with faults that are known it has to be reproduced at once.
TRIAL_OF_TRACKS = 1


def diagnosis_of(
    method: str,
    exchanges: Sequence[Exchange],
    wrong: Sequence[Exchange],
    tolerance: Callable[[Case], float],
    behaviour: Sentence | None = None,
    *,
    max_faults: int = 3,
    base: Sequence[SwitchFault] = (),
) -> Diagnosis:
    """Return the faults of a method that reproduce the answers, if some answers are wrong."""
    compared: list[Exchange] = []
    for group in (wrong, [exchange for exchange in exchanges if exchange not in wrong]):
        with_answers = [exchange for exchange in group if isinstance(exchange.answer, Answer)]
        if not with_answers and group is wrong:
            return Diagnosis(behaviour=behaviour)
        compared += sorted(with_answers, key=lambda exchange: exchange.case.size)
    compared = compared[:COMPARED]
    trial = TRIAL_OF_TRACKS if base and method.startswith("track") else TRIAL
    explanations, count = explain(
        variants(method, max_faults, base), compared, tolerance, partial(describe, method), trial
    )
    # of the answers that are wrong, as many as of all answers to an unknown solver
    right_share = sum(exchange not in wrong for exchange in compared) / len(compared)
    least_share = right_share + LEAST_SHARE * (1.0 - right_share)
    faulty = tuple(
        explanation
        for explanation in explanations
        if explanation.faults != ("",)
        and explanation.share >= least_share
        and (explanation.share == 1.0 or not _adds(explanation, base))
    )
    return Diagnosis(faulty, behaviour, variant_count=count)


def _adds(explanation: Explanation, base: Sequence[SwitchFault]) -> bool:
    """Return whether an explanation adds faults to the base.

    The base alone, in a program of another structure, is more likely than an additional fault.
    """
    keys = {fault.key for fault in base}
    return bool(keys) and not keys.issuperset(explanation.faults[0].split(" + "))
