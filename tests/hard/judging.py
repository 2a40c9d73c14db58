"""What the tests of every group do: draw cases of a family by hypothesis, and ask the judge."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.hard.cases import Family, judge


def never_fails(name: str, family: Family, examples: int) -> None:
    """Judge random cases of a family; each must pass or be refused with an explanation."""

    @given(seed=st.integers(0, 2**31), number=st.integers(0, 2**31))
    @settings(max_examples=examples)
    def check(seed: int, number: int) -> None:
        outcome = judge(name, family, seed, number)
        assert outcome.verdict != "failed", f"{outcome.detail}\n{outcome.drawn}"

    check()
