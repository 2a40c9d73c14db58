"""A few random cases of every family with every run of the tests, and the judge itself."""

import os
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.evaluation.protocols import PROTOCOLS
from tactbench.plugin import RigError, load_registry

from .cases import judge
from .families import families

FAMILIES = families()
EXAMPLES = {"contact": 5, "memory": 20, "channels": 5, "evaluation": 1}
"""Cases of each family of a group: a memory's cost a millisecond, a contact's or a recording's a few hundred."""
TIMES = int(os.environ.get("HARD_CASES", "1"))
"""Factor on the numbers of cases, for a longer search by hand."""


@pytest.mark.parametrize("name", FAMILIES)
def test_no_case_of_the_family_fails(name):
    @given(seed=st.integers(0, 2**31), number=st.integers(0, 2**31))
    @settings(max_examples=TIMES * EXAMPLES[name.split(":")[0]])
    def check(seed, number):
        outcome = judge(name, FAMILIES[name], seed, number)
        assert outcome.verdict != "failed", f"{outcome.detail}\n{outcome.drawn}"

    check()


def test_every_protocol_meets_every_estimator_that_can_answer_here():
    met = {tuple(name.removeprefix("evaluation: ").split(" ")[::2]) for name in FAMILIES if "evaluation" in name}
    assert {protocol for protocol, _ in met} == set(PROTOCOLS)
    asked_of_samples = {one.name for one in load_registry().estimators if one.kinds != ("events",)}
    # Forests of other sizes are the same code.
    assert {name for name in asked_of_samples - {name for _, name in met} if not name.startswith("forest")} == set()


def _says(case):
    case.says(x=1.0)


def _wrong(case):
    case.holds(np.nan >= 0, "not a number")


def _warns(_):
    warnings.warn("divide by zero", RuntimeWarning, stacklevel=1)


def _refuses(case, right="refusal", hint="Use a larger one."):
    case.right = right
    raise RigError("A cap of 0 mm is none.", hint=hint)


def _answers_wrongly(case):
    case.right = "refusal"


def _breaks(_):
    raise ZeroDivisionError


@pytest.mark.parametrize(
    ("family", "verdict"),
    [
        (_says, "passed"), (_refuses, "refused"), (_wrong, "failed"), (_warns, "failed"), (_answers_wrongly, "failed"),
        (lambda case: _refuses(case, "answer"), "failed"), (lambda case: _refuses(case, hint=""), "failed"),
        (_breaks, "failed"),
    ],
)  # fmt: skip
def test_the_judge(family, verdict):
    outcome = judge("test", family, 1, 0)
    assert outcome.verdict == verdict
    assert bool(outcome.detail) == (verdict != "passed")
