"""Random hard cases: memory."""

from __future__ import annotations

import pytest

from tactbench.rigs.twin.verification.hard_cases import families

from .judging import never_fails

FAMILIES = {name: family for name, family in families().items() if name.startswith("memory")}


@pytest.mark.parametrize("name", FAMILIES)
def test_no_case_of_the_family_fails(name):
    never_fails(name, FAMILIES[name], 20)
