"""From rows to the one table object that every format is made from.

A table depends on its rows alone, never on their order. All its text is fit to be shown (`text.visible`); a format
escapes what its own syntax would act on, and changes no digit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from tactbench.core.leaderboard.blocks import Block, blocks_of
from tactbench.core.leaderboard.columns import columns
from tactbench.core.leaderboard.events import events_section, operating_points_section
from tactbench.core.leaderboard.footer import footer_of
from tactbench.core.leaderboard.hosts import host_letters, timing_notes
from tactbench.core.leaderboard.lines import Line
from tactbench.core.leaderboard.notes import notes_of
from tactbench.core.leaderboard.over_tasks import over_tasks
from tactbench.core.leaderboard.probe import build_probe
from tactbench.core.leaderboard.published import published_section
from tactbench.core.tables.text_table import TextTable

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Table:
    """A leaderboard, ready to be shown."""

    blocks: tuple[Block, ...]
    columns: tuple[str, ...]
    notes: tuple[str, ...]
    sections: tuple[TextTable, ...] = ()
    """Tables below the blocks: events, averages over tasks, published figures, what was probed."""
    footer: tuple[str, ...] = ()
    """Who computed this, with what, where."""
    provenance: tuple[Row, ...] = ()
    """The same as data."""
    times: bool = True
    """Whether the table has what no seed decides: times, memory, hosts."""

    @property
    def lines(self) -> list[Line]:
        """The lines of all blocks."""
        return [line for block in self.blocks for line in block.lines]

    @property
    def rows(self) -> list[Row]:
        """The rows, in the order of the lines."""
        return [line.row for line in self.lines]


def build_table(rows: Sequence[Row], provenance: Sequence[Row] = (), *, times: bool = True) -> Table:
    """Arrange `rows` into blocks, ranked, with their notes.

    Parameters
    ----------
    rows
        Rows of one folder or of several, in any order.
    provenance
        What is known of the runs they are from: see `tactbench.core.provenance.gather`.
    times
        False: the table of what a seed decides, the same on every machine; no times, no hosts, no provenance.
    """
    known = tuple(provenance) if times else ()
    rows = sorted(rows, key=itemgetter("cell"))
    letters = host_letters(rows) if times else {}
    names = columns(rows, times=times)
    blocks = blocks_of(rows, names, letters, times)
    ordered = [line.row for block in blocks for line in block.lines]
    notes = notes_of(ordered, blocks)
    if times:
        notes += timing_notes(rows, letters, known)
    events = (events_section(ordered), operating_points_section(ordered)) if times else ()
    sections = (*events, over_tasks(rows), published_section(rows), build_probe(ordered))
    return Table(
        blocks,
        names,
        tuple(notes),
        tuple(section for section in sections if section is not None),
        footer_of(rows, known, times),
        known,
        times,
    )
