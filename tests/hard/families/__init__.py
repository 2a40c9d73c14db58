"""Every family of hard cases, by group; a family's docstring is the right answer."""

import functools

from tests.hard.families import channels, contact, evaluation, memory, skins


@functools.cache
def families():
    """Return every family by its name, ``group: what is hard``: the twin's, and those of evaluation."""
    groups = {
        "contact": (*contact.FAMILIES, *skins.FAMILIES),
        "memory": memory.FAMILIES,
        "channels": channels.FAMILIES,
    }
    twin = {f"{group}: {one.__name__.replace('_', ' ')}": one for group, some in groups.items() for one in some}
    return twin | evaluation.families()
