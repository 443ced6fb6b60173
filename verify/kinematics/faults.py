"""The known faults of kinematics solvers, from `faults.toml`, and their combinations."""

import itertools
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from plumbob.text.sentence import Sentence, codes_in, sentence, with_code

from ..explain import either
from ..judgement import LEAST_SHARE, TaskReport
from .algebra import (
    FIRST_COMPONENT,
    FIRST_CROSS_TERM,
    FIRST_ELEMENT,
    FIRST_TERM,
    SIGNED,
    UNEQUAL,
)
from .switches import ANGLES, EULER_ORDERS, Switches
from .textbook import (
    DROPPED,
    FIXED,
    FIXED_TEST,
    FRAMES,
    LINK_FRAMES,
    LINK_OF_CHILD,
    MIXED_FRAMES,
    MIXED_LINKS,
    SMALL,
)

TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
# What a small angle of CCD ends or becomes, by the number of `small`.
AT_SMALL = (
    sentence("the sweep ends"), sentence("the solve ends"),
    sentence("the angle is raised to that"),
)  # fmt: skip
ORDERS = (sentence("breadth first"), sentence("by their depth"))
SAVED = (sentence("rotations"), sentence("rotations and positions"))
# The frames of `FRAMES`, and what becomes of a local rotation by an arc, in words.
INTO = (
    sentence("as it is in the world"), sentence("into the joint's frame, conj(R) v"),
    sentence("into the parent's frame, conj(R_parent) v"),
    sentence("by R, which is not inverted, R v"),
    sentence("by R_parent, which is not inverted, R_parent v"),
    sentence("as conj(R) target - joint, although the joint is not in that frame"),
    sentence("as conj(R_parent) target - joint, although the joint is not in that frame"),
)  # fmt: skip
SIDES = ("conj(R_parent) d R_parent Q", "Q d", "d Q")
# What rotates with a joint that is rotated by hand, by the number of `spin`.
SPINS = (
    sentence("only that joint and its children rotate, and not what hangs on these"),
    sentence("that joint alone rotates, and nothing that hangs on it"),
    sentence("all rotates about the root, x := x_root + d (x - x_root)"),
    sentence("all rotates about the origin, x := d x"),
    sentence("the pivot is not rotated, x := d x + x_joint"),
)
# The switches of a program that rotates global positions and rotations by hand.
BY_HAND = {"global_rotations": 2, "rule": 5}
AS_THE_TEXTBOOK = sentence("It does what the textbook does.")


class SwitchFault(NamedTuple):
    """A fault that setting a switch of the textbook's solvers reproduces."""

    # the table that it is in: "quaternion", "arc", "forward", "ccd", "fabrik", "stop" or "follow"
    part: str
    key: str  # its short name
    switch: str  # the field of Switches
    number: int  # of the faulty setting
    sentence: Sentence  # the code, the mistake, and its correction
    honest: bool  # whether it may be on purpose: the answers still obey every law
    is_rare: bool = False  # whether it is not tried together with others
    covers: tuple[str, ...] = ()  # keys of faults in its sentence, if no answer tells them apart


def sentences_of(part: str) -> dict[str, Sentence]:
    """Return the sentences of a table's faults with their codes, by their short names."""
    return {
        key: with_code(entry["code"], Sentence(entry["sentence"], {}))
        for key, entry in TABLE[part].items()
    }


def _load() -> dict[str, tuple[SwitchFault, ...]]:
    """Return the faults that each method may have, the most frequent first."""
    parts = {
        part: tuple(
            itertools.chain.from_iterable(_faults(part, *item) for item in TABLE[part].items())
        )
        for part in TABLE
        if not part.startswith("robot")
    }
    forward, stop, follow = parts["forward"], parts["stop"], parts["follow"]
    common = tuple(fault for fault in forward if not fault.is_rare)
    shared = (*parts["quaternion"], *parts["arc"])
    faults = {
        "forward": (*forward, *parts["quaternion"]),
        "ccd": (*parts["ccd"], *common, *stop, *shared),
        "fabrik": (*parts["fabrik"], *common, *stop[:-1], *shared),  # the last stop is CCD's own
    }
    return faults | {
        f"track {method}": (*follow, *(fault for fault in faults[method] if not fault.is_rare))
        for method in ("ccd", "fabrik")
    }


def _faults(part: str, key: str, entry: Mapping[str, Any]) -> Iterator[SwitchFault]:
    """Yield the faults of an entry: one, or one for each number of its range."""
    for switch, numbers in entry.get("switch", {}).items():
        is_range = isinstance(numbers, list)
        for number in range(numbers[0], numbers[1] + 1) if is_range else (numbers,):
            values = VALUES[switch](number) if is_range else {}
            words = with_code(entry["code"], Sentence(entry["sentence"], values))
            is_honest = entry.get("honest", False)
            is_rare = is_range or entry.get("alone", False)
            covers = tuple(entry.get("covers", ()))
            yield SwitchFault(
                part, key.format_map(values), switch, number, words, is_honest, is_rare, covers
            )


PASSES = (
    sentence("both passes"), sentence("the backward pass"), sentence("the forward pass"),
)  # fmt: skip
# What is taken for the length of a link, by the kind of `link_length` from `OTHER_LENGTHS` on.
OTHER_LENGTHS = 9
LENGTHS = (
    sentence("the length before it in the list, and the last for the first link,"),
    sentence("the length after it in the list, and the first for the last link,"),
    sentence("the length in a reversed list"),
    sentence("|x| of the offset"), sentence("|y| of the offset"), sentence("|z| of the offset"),
    sentence("|x| + |y| + |z| of the offset"), sentence("the square of the length"),
    sentence("the length of x and y alone"), sentence("the whole metres of the length"),
    sentence("the length rounded to 1 m"), sentence("the length rounded to 0.1 m"),
    sentence("the length rounded to 0.01 m"),
    sentence("the length of the link before, and nothing for the first link,"),
)  # fmt: skip
# What CCD makes of a local rotation, by the number of `applied` from `OTHER_PRODUCTS` on.
OTHER_PRODUCTS = 22
PRODUCTS = ("Q P d conj(P)", "Q R d conj(R)", "Q Q d conj(Q)", "conj(Q) d Q Q")
# What FABRIK makes of the local rotation of a link's lower joint.
OF_CHILD = ("d Q_child", "conj(R) d R Q_child", "conj(R_parent) d R_parent Q_child", "Q_child d")
FUNCTIONS = (sentence("the sine"), sentence("the cosine"))
DIRECTIONS = (
    sentence("the first direction"), sentence("the second direction"), sentence("both directions"),
)  # fmt: skip


def _term(number: int) -> tuple[str, str]:
    """Return a term of the product of two quaternions, or none, and the component that has it."""
    if number >= FIRST_COMPONENT:
        return "", "xyz"[number - FIRST_COMPONENT]
    i, j = divmod(number - FIRST_TERM, 4)
    return f"a.{'wxyz'[i]} b.{'wxyz'[j]}", "wxyz"[i ^ j]


def _cross_term(number: int) -> tuple[str, str]:
    """Return a term of the product of two vectors, or none, and the component that has it."""
    if number < FIRST_CROSS_TERM:
        return "", "xyz"[number - 2]
    c, is_second = divmod(number - FIRST_CROSS_TERM, 2)
    i, j = ((c + 2) % 3, (c + 1) % 3) if is_second else ((c + 1) % 3, (c + 2) % 3)
    return f"a.{'xyz'[i]} b.{'xyz'[j]}", "xyz"[c]


def _frames(frames: tuple[int, int, int]) -> dict[str, Any]:
    """Return the frames of two directions in words, and what their arc d makes of Q."""
    first, second, side = frames
    return {"first": INTO[first], "second": INTO[second], "product": SIDES[side]}


def _element(number: int) -> str:
    """Return the element of a matrix that has the wrong sign."""
    row, is_second = divmod(number - FIRST_ELEMENT, 2)
    return f"m[{row}][{(row + 2 - is_second) % 3}]"


# What the numbers of a switch stand for in keys and sentences.
VALUES: Mapping[str, Callable[[int], Mapping[str, Any]]] = {
    "euler": lambda number: dict(zip(("order", "other"), EULER_ORDERS[number - 1], strict=True)),
    "angles": lambda number: {"order": ANGLES[number - 1][0]},
    "small": lambda number: {
        "angle": SMALL[(number - 1) % len(SMALL)],
        "what": AT_SMALL[(number - 1) // len(SMALL)],
    },
    "parent": lambda number: {"order": ORDERS[number % 2]},
    "test": lambda number: {"distance": FIXED[number - FIXED_TEST]},
    "rotate": lambda number: {"element": _element(number)},
    "frame_saved": lambda number: {"what": SAVED[number - 2]},
    "dropped": lambda number: {"angle": DROPPED[number]},
    "multiply": lambda number: dict(zip(("term", "number"), _term(number), strict=True)),
    "cross": lambda number: dict(zip(("term", "number"), _cross_term(number), strict=True)),
    "inverse": lambda number: {"number": "xyz"[number - 4]},
    "pull": lambda number: {"passes": PASSES[number % 3]},
    "lengths": lambda number: {
        "passes": PASSES[number % 3],
        "length": LENGTHS[max(0, number // 3 - OTHER_LENGTHS)],
    },
    "angle": lambda number: {
        "axis": "xyzzxy"[min(number - SIGNED, 5)],
        "function": FUNCTIONS[max(0, number - UNEQUAL) // 3 % 2],
        "direction": DIRECTIONS[(number - UNEQUAL) % 3],
    },
    "aim": lambda number: _frames(FRAMES[number - MIXED_FRAMES]),
    "spin": lambda number: {"number": number, "what": SPINS[number - 1]},
    "rotations": lambda number: (
        _frames(LINK_FRAMES[number - MIXED_LINKS])
        if number >= MIXED_LINKS
        else {"product": OF_CHILD[number - LINK_OF_CHILD[0]]}
    ),
    "applied": lambda number: {"product": PRODUCTS[number - OTHER_PRODUCTS]},
}
FAULTS = _load()


@cache
def by_key(method: str) -> dict[str, SwitchFault]:
    """Return the faults of a method by their keys."""
    own = (*FAULTS[method.removeprefix("track ")], *FAULTS[method])
    return {fault.key: fault for fault in (*FAULTS["forward"], *own)}


def switches(faults: Sequence[SwitchFault]) -> Switches:
    """Return the switches that faults set, in a program that they can be in."""
    numbers = {fault.switch: fault.number for fault in faults}
    return Switches(**(BY_HAND if "spin" in numbers else {}) | numbers)


def combinations(
    method: str, base: Sequence[SwitchFault] = ()
) -> Iterator[tuple[SwitchFault, ...]]:
    """Yield no fault, single faults, pairs and likely triples, no two of the same switch.

    With a `base`, yield it alone, and with each of the method's own faults, unless it follows a
    curve: that takes long, and more will show when the base is corrected.
    """
    faults = FAULTS[method]
    if base:
        own = [(fault,) for fault in faults if fault.part not in ("forward", "quaternion")]
        yield from ((*base, *extra) for extra in ((), *(() if "track" in method else own)))
        return
    yield ()
    yield from ((fault,) for fault in faults)
    faults = tuple(fault for fault in faults if not fault.is_rare)
    pairs = filter(_are_independent, itertools.combinations(faults, 2))
    if method.startswith("track "):  # other faults show in single solves
        yield from (pair for pair in pairs if pair[0].part == "follow")
        return
    yield from pairs
    yield from filter(_is_likely, itertools.combinations(faults, 3))


def _are_independent(faults: Sequence[SwitchFault]) -> bool:
    return len({fault.switch for fault in faults}) == len(faults)


def _is_likely(triple: Sequence[SwitchFault]) -> bool:
    """Return whether a triple is in rotations, another step and kinematics, as in real programs."""
    rotations, step, kinematics = triple
    return (
        rotations.switch in ("applied", "rotations")
        and step.part == rotations.part
        and kinematics.part == "forward"
        and _are_independent(triple)
    )


def describe(method: str, keys: Sequence[str]) -> Sentence:
    """Return the sentences of a class of faults that no answer tells apart."""
    faults = by_key(method)
    sentences = {key: fault.sentence for key, fault in faults.items()} | {"": AS_THE_TEXTBOOK}
    names = [key.split(" + ") for key in keys]
    names = [group for group in names if not _covered(names, faults).intersection(group)]
    by_codes = dict[object, list[str]]()  # of faults that differ in a number alone the first
    for group in names:
        by_codes.setdefault(tuple(codes_in(sentences[name]) for name in group), group)
    names = list(by_codes.values())
    mistakes = either([[sentences[name] for name in group] for group in names])
    parts = {faults[name].part for group in names for name in group if name}
    if method == "forward" or parts != {"forward"}:
        return mistakes
    return sentence(
        "Its own steps are right, but not its forward kinematics: {what}", what=mistakes
    )


def explaining(report: TaskReport) -> tuple[SwitchFault, ...]:
    """Return the faults that explain most answers of a report, () if none do."""
    by_name = by_key("ccd") | by_key("fabrik")
    for explanation in report.diagnosis.explanations[:1]:
        groups = [keys.split(" + ") for keys in explanation.faults]
        if explanation.share >= LEAST_SHARE and by_name.keys() >= set(itertools.chain(*groups)):
            keys = min(
                groups, key=lambda group: bool(_covered(groups, by_name).intersection(group))
            )
            return tuple(by_name[key] for key in keys)
    return ()


def _covered(groups: Sequence[Sequence[str]], faults: Mapping[str, SwitchFault]) -> set[str]:
    """Return the keys of faults that are in the sentences of others."""
    return {key for group in groups for name in group if name for key in faults[name].covers}
