"""A number printed beside its bound or beside what was expected never reads like it."""

import re

import numpy as np
import pytest
from table_cells import column

from plumbob.bench.compare.answers import compare_answers
from plumbob.bench.compare.rows import Pair, row_key
from plumbob.bench.experiments import check
from plumbob.bench.tables.results import Results
from plumbob.reference import Skeleton, arguments
from plumbob.reference.articulation import Articulation
from plumbob.reference.formats import mjcf, urdf
from plumbob.verify.case import Case
from plumbob.verify.kinematics import pose_laws, resample
from plumbob.verify.kinematics.polylines import Polyline
from plumbob.verify.laws import HOLDS
from plumbob.verify.screen import comparison

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
CLOSE = 1.0 + 1e-9


def message(call, *values, **options):
    with pytest.raises(ValueError, match=": expected ") as caught:
        call(*values, **options)
    return str(caught.value)


def robot(lower, upper):
    limits = f'<limit lower="{lower!r}" upper="{upper!r}"/>'
    ends = '<parent link="a"/><child link="b"/>'
    joint = f'<joint name="j" type="revolute">{ends}{limits}</joint>'
    return f'<robot name="r"><link name="a"/><link name="b"/>{joint}</robot>'


def body(lower, upper):
    joint = f'<joint limited="true" range="{lower!r} {upper!r}"/>'
    return f"<mujoco><worldbody><body>{joint}</body></worldbody></mujoco>"


def claimed_residual():
    case = Case("", "", {"tolerance": 1e-6}, "", HOLDS)
    (finding,) = pose_laws.claims(1e-5, 1e-9, {"residual": 1e-5 * (1 + 2e-3)}, case)
    return finding.sentence


def spaced(gap, spacing):
    points = np.array([[0.0, 0, 0], [gap, 0, 0], [1.0, 0, 0]])
    case = Case("", "", {"curve": points, "spacing": spacing, "closed": False}, "", HOLDS,
                facts={"line": Polyline(points, (0,), False)})  # fmt: skip
    gaps = np.array([gap])
    return resample._gaps_by_spacing([gaps, gaps, gaps], case, 0.0).sentence


def sizes(make):
    old = make.record("ik", "p", "a", size=1_000_000)
    new = make.record("ik", "p", "a", size=1_000_001)
    return compare_answers(row_key(old), Pair(old, new)).why


def missed_claim(make):
    record = make.claim(held=False)
    record.measured.update(difference=np.array(1e-10 * CLOSE), tolerance=np.array(1e-10))
    return column(check.verdicts(Results([record])), "verdict")[0]


SENTENCES = {
    "coordinates": lambda _: message(arguments.coordinates, "x", [1e75 * CLOSE], 1),
    "limits": lambda _: message(
        Articulation, Skeleton([-1], [[0, 0, 0]]), "hinge", lower=CLOSE, upper=1.0
    ),
    "URDF": lambda _: message(urdf.parse, robot(3.0 * CLOSE, 3.0), crossed_limits="refused"),
    "MJCF": lambda _: message(mjcf.parse, body(3.0 * CLOSE, 3.0)),
    "unit quaternions": lambda _: (
        pose_laws.unit_quaternions(np.array([1.0 - 2.0**-24]), 0.0).sentence
    ),
    "residual": lambda _: claimed_residual(),
    "spacing": lambda _: spaced(0.5 * (1 + 1e-5), 0.5),
    "records' sizes": sizes,
    "a missed claim": missed_claim,
}


@pytest.mark.parametrize("name", SENTENCES)
def test_a_number_and_its_bound_read_differently(name, make):
    text = str(SENTENCES[name](make))
    numbers = NUMBER.findall(text)
    pairs = [
        (a, b)
        for i, a in enumerate(numbers)
        for b in numbers[:i]
        if float(b) and abs(float(a) / float(b) - 1.0) < 0.01
    ]
    assert pairs, text
    assert all(a != b for a, b in pairs), text


def test_limits_of_a_twist_beyond_pi_are_not_written_as_pi():
    text = message(Articulation, Skeleton([-1], [[0, 0, 0]]), "ball", lower=np.pi * CLOSE)
    assert f"{np.pi:g}" not in NUMBER.findall(text)


@pytest.mark.parametrize("digits", [1, 3, 6, 12])
def test_any_two_numbers_have_texts_that_differ(digits):
    rng = np.random.default_rng(5)
    for number in rng.normal(size=200) * 10.0 ** rng.integers(-20, 20, 200):
        for bound in (np.nextafter(number, np.inf), number * CLOSE, 2.0 * number):
            texts = arguments.distinct_texts(number, bound, digits)
            assert texts[0] != texts[1]
            row = comparison.NumberRow("x", [1.0, number], [1.0, bound])
            theirs, ours = comparison.texts(row)
            assert theirs != ours


def test_digits_are_no_more_than_needed():
    assert arguments.distinct_texts(1.2345, 2.0, 3) == ("1.23", "2")
    assert arguments.distinct_texts(0.1, 0.1) == (f"{0.1:.17g}",) * 2
