"""From rows to the one table object that every format is made from.

A table depends on its rows alone, never on their order. All its text is fit to be shown (`text.visible`); a format
escapes what its own syntax would act on, and changes no digit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter

from tactbench.core.leaderboard.blocks import Block, blocks_of
from tactbench.core.leaderboard.columns import Line, columns
from tactbench.core.leaderboard.events import events_table
from tactbench.core.leaderboard.names import Row
from tactbench.core.leaderboard.probe import build_probe
from tactbench.core.tables.text import cut, visible
from tactbench.core.tables.text_table import TextTable

LONGEST = 1000
"""Characters of a sentence on the provenance; the whole of it lies in the result folder."""


@dataclass(frozen=True)
class Table:
    """A leaderboard, ready to be shown."""

    blocks: tuple[Block, ...]
    columns: tuple[str, ...]
    sections: tuple[TextTable, ...] = ()
    """Tables below the blocks: events, and what was probed."""
    provenance: tuple[Row, ...] = ()
    """Who computed this, with what, where."""
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

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes of all blocks, each once."""
        return tuple(dict.fromkeys(str(note) for block in self.blocks for note in block.notes))

    @property
    def footer(self) -> tuple[str, ...]:
        """The provenance in sentences, for the files."""
        from tactbench.core.provenance.gather import foot

        made_by = foot(self.provenance) if self.provenance else ()
        return tuple(cut(visible(sentence), LONGEST) for sentence in made_by)


def build_table(
    rows: Sequence[Row],
    provenance: Sequence[Row] = (),
    *,
    times: bool = True,
    questions: Mapping[str, str] | None = None,
) -> Table:
    """Arrange `rows` into blocks, ranked, with what is said of them.

    Parameters
    ----------
    rows
        Rows of one folder or of several, in any order.
    provenance
        What is known of the runs they are from: see `tactbench.core.provenance.gather`.
    times
        False: the table of what a seed decides, the same on every machine; no times, no hosts, no provenance.
    questions
        What tasks ask, by name.
    """
    names = columns(times=times)
    blocks = blocks_of(sorted(rows, key=itemgetter("cell")), names, questions or {}, times=times)
    ordered = [line.row for block in blocks for line in block.lines]
    sections = (events_table(ordered) if times else None, build_probe(ordered))
    found = tuple(section for section in sections if section is not None)
    return Table(blocks, names, found, tuple(provenance) if times else (), times)
