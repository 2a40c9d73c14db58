"""From rows to the one table object that every format is made from.

A table depends on its rows alone, never on their order. All its text is fit to be shown (`text.visible`); a format
escapes what its own syntax would act on, and changes no digit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactbench.core.leaderboard.blocks import Block, blocks_of
from tactbench.core.leaderboard.collector import collector_at_rest
from tactbench.core.leaderboard.columns import COLUMNS, NUMERIC, columns
from tactbench.core.leaderboard.foot import foot_of
from tactbench.core.leaderboard.hosts import host_letters, timing_notes
from tactbench.core.leaderboard.lines import Line, Shown
from tactbench.core.leaderboard.names import LOWER_IS_BETTER, METRIC_NAMES, answer_name, sensor_name
from tactbench.core.leaderboard.notes import notes_of
from tactbench.core.leaderboard.numbers import ABSENT
from tactbench.core.leaderboard.over_tasks import over_tasks
from tactbench.core.leaderboard.probe import build_probe
from tactbench.core.leaderboard.published import published_section
from tactbench.core.leaderboard.sections import Section
from tactbench.core.leaderboard.sheet import Sheet

__all__ = [
    "ABSENT",
    "COLUMNS",
    "LOWER_IS_BETTER",
    "METRIC_NAMES",
    "NUMERIC",
    "Block",
    "Line",
    "Section",
    "Table",
    "answer_name",
    "build_table",
    "sensor_name",
]

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Table:
    """A leaderboard, ready to be shown."""

    shown: Shown
    """All rows, by the names of their cells, as text."""
    blocks: tuple[Block, ...]
    notes: tuple[str, ...]
    columns: tuple[str, ...] = COLUMNS
    sections: tuple[Section, ...] = ()
    """Tables below the blocks: averages over tasks, published figures, what was probed."""
    foot: tuple[str, ...] = ()
    """Who computed this, with what, where."""
    provenance: tuple[Row, ...] = ()
    """The same as data."""
    times: bool = True
    """Whether the table has what no seed decides: times, memory, hosts."""

    @property
    def rows(self) -> list[Row]:
        """The rows, in the order of the lines."""
        return [self.shown.sheet.rows[place] for block in self.blocks for place in block.places]


def build_table(rows: Sequence[Row] | Sheet, provenance: Sequence[Row] = (), *, times: bool = True) -> Table:
    """Arrange `rows` into blocks, ranked, with their notes.

    Parameters
    ----------
    rows
        Rows of one folder or of several, in any order; or these laid out already.
    provenance
        What is known of the runs they are from: see `tactbench.core.provenance.gather`.
    times
        False: the table of what a seed decides, the same on every machine; no times, no hosts, no provenance.
    """
    with collector_at_rest():
        return _arranged(rows, tuple(provenance) if times else (), times)


def _arranged(rows: Sequence[Row] | Sheet, known: tuple[Row, ...], times: bool) -> Table:
    sheet = rows if isinstance(rows, Sheet) else Sheet.by_name(rows)
    letters = host_letters(sheet) if times else {}
    shown, blocks = blocks_of(sheet, letters, times)
    ordered = sheet.taken([place for block in blocks for place in block.places])
    notes = notes_of(ordered, blocks)
    if times:
        notes += timing_notes(sheet, letters, known)
    sections = (over_tasks(sheet), published_section(sheet), build_probe(ordered.rows))
    return Table(
        shown,
        blocks,
        tuple(notes),
        columns(sheet, times=times),
        tuple(section for section in sections if section is not None),
        foot_of(sheet, known, times),
        known,
        times,
    )
