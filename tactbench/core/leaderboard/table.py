"""From rows to the one table object that every format is made from.

A table depends on its rows alone, never on their order. All its text is fit to be shown (`text.visible`); a format
escapes what its own syntax would act on, and changes no digit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from tactbench.core.leaderboard.blocks import Block, blocks_of
from tactbench.core.leaderboard.columns import Line, columns, host_letters, timing_notes
from tactbench.core.leaderboard.names import Row
from tactbench.core.leaderboard.notes import notes_of
from tactbench.core.leaderboard.probe import build_probe
from tactbench.core.leaderboard.sections import sections_of
from tactbench.core.tables.text import cut, visible
from tactbench.core.tables.text_table import TextTable

_REPLICATES = "One a replicate, which is everything recorded anew; scores are medians, intervals those of the median."
MOST_SEEDS = 12
LONGEST = 1000
"""Characters of a sentence in the footer; the whole provenance lies in the result folder."""


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
    notes = (*notes_of(ordered, blocks), *(timing_notes(rows, letters, known) if times else ()))
    sections = tuple(one for one in (*sections_of(ordered, times=times), build_probe(ordered)) if one is not None)
    return Table(blocks, names, notes, sections, _footer(rows, known, times), known, times)


def _footer(rows: Sequence[Row], provenance: Sequence[Row], times: bool) -> tuple[str, ...]:
    """Return how many runs a table is of, and who computed them, with what, where."""
    seeds = _seeds(seed for row in rows for seed in row.get("seeds") or [row["seed"]])
    if not times:
        return (f"Times, memory and hosts are left out: a seed decides all that stands here. {seeds}",)
    runs = len({row.get("made_by") for row in rows} - {None, ""})
    of_runs = f" of {runs} kind{'s' if runs != 1 else ''} of runs (versions, machine, settings)" if runs else ""
    if any((row.get("n_replicates") or 0) > 1 and row.get("replicate_unit") == "replicate" for row in rows):
        seeds += f" {_REPLICATES}"
    from tactbench.core.provenance.gather import foot

    try:
        made_by = foot(provenance) if provenance else ()
    except (AttributeError, ArithmeticError, LookupError, TypeError, ValueError):
        made_by = ("The provenance of these rows cannot be read.",)  # a stranger's folder may say anything
    return (f"{len(rows)} cells{of_runs}. {seeds}", *(cut(visible(sentence), LONGEST) for sentence in made_by))


def _seeds(values: Iterable[Any]) -> str:
    seeds = sorted({seed for seed in values if isinstance(seed, int)})
    if not seeds:
        return "Seeds are not known."
    listed = ", ".join(map(str, seeds[:MOST_SEEDS]))
    more = f" and {len(seeds) - MOST_SEEDS} more" if len(seeds) > MOST_SEEDS else ""
    return f"{'Seeds' if len(seeds) > 1 else 'Seed'}: {listed}{more}."
