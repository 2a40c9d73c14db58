"""Random hard cases of the twin: contact, memory and channels."""

from __future__ import annotations

import pytest

from .families import twin_families
from .judging import never_fails

FAMILIES = twin_families()
EXAMPLES = {"contact": 5, "memory": 20, "channels": 5}
"""Cases of each family of a group: a memory's cost a millisecond, a contact's or a recording's a few hundred."""


@pytest.mark.parametrize("name", FAMILIES)
def test_no_case_of_the_family_fails(name):
    never_fails(name, FAMILIES[name], EXAMPLES[name.split(":")[0]])
