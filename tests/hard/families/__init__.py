"""Every family of hard cases, by group; a family's docstring is the right answer."""

from __future__ import annotations

from tests.hard.cases import Family
from tests.hard.families import channels, contact, evaluation, memory, skins


def twin_families() -> dict[str, Family]:
    """Return every family of the twin by its name, ``group: what is hard``."""
    groups = {
        "contact": (*contact.FAMILIES, *skins.FAMILIES),
        "memory": memory.FAMILIES,
        "channels": channels.FAMILIES,
    }
    return {f"{group}: {one.__name__.replace('_', ' ')}": one for group, some in groups.items() for one in some}


def families() -> dict[str, Family]:
    """Return all families: the twin's, and those of evaluation."""
    return {**twin_families(), **evaluation.families()}
