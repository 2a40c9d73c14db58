"""The benchmark itself: a case that does not come back is a hang, and the judge knows right from wrong."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from tactbench.plugin import RigError

from .cases import judge
from .families import twin_families
from .many import judged


def test_a_case_that_does_not_come_back_is_a_hang_and_the_next_is_judged():
    jobs = [("contact: any load", 1, 0), ("memory: no time constant", 1, 0)]
    # No contact is solved within a microsecond, its worker's first imports of sensors included.
    first = list(judged(iter(jobs[:1]), 1, 1e-6))
    assert [(verdict, detail.split(":")[0]) for _, verdict, detail, _, _ in first] == [("failed", "hangs")]
    second = list(judged(iter(jobs[1:]), 1, 60.0))
    assert [verdict for _, verdict, _, _, _ in second] == ["refused"]


def _answers(case):
    case.says(x=1.0)


def _wrong(case):
    case.holds(False, "two is three")


def _nan(case):
    case.holds(np.nan >= 0, "not a number")


def _warns(_):
    warnings.warn("divide by zero", RuntimeWarning, stacklevel=1)


def _refuses(case):
    case.right = "refusal"
    raise RigError("A cap of 0 mm is none.", hint="Use a larger one.")


def _refuses_wrongly(_):
    raise RigError("A cap of 5 mm is none.", hint="Use a larger one.")


def _refuses_without_a_hint(case):
    case.right = "refusal"
    raise RigError("No.")


def _answers_wrongly(case):
    case.right = "refusal"


def _breaks(_):
    raise ZeroDivisionError


@pytest.mark.parametrize(
    ("family", "verdict"),
    [
        (_answers, "passed"), (_refuses, "refused"), (_wrong, "failed"), (_nan, "failed"), (_warns, "failed"),
        (_refuses_wrongly, "failed"), (_refuses_without_a_hint, "failed"), (_answers_wrongly, "failed"),
        (_breaks, "failed"),
    ],
)  # fmt: skip
def test_the_judge(family, verdict):
    outcome = judge("test", family, 1, 0)
    assert outcome.verdict == verdict
    assert bool(outcome.detail) == (verdict != "passed")


def test_the_same_numbers_give_the_same_case():
    name = "contact: any radius"
    family = twin_families()[name]
    assert judge(name, family, 3, 5) == judge(name, family, 3, 5)
    assert judge(name, family, 3, 5).drawn != judge(name, family, 3, 6).drawn
