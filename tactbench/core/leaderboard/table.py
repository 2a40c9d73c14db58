"""Builds from rows the one table object that every format renders.

Rows that may be compared stand in one block; no rank spans two. Rows under different tasks, protocols or splits, and
rows from the twin and from hardware, are not comparable. A table depends on its rows alone, never on their order. All
its text is fit to be shown (`text.visible`); a format escapes what its own syntax would act on, and changes no digit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.columns import Line, line_of
from tactbench.core.leaderboard.events import events_table
from tactbench.core.leaderboard.names import (
    Bars,
    Row,
    error_of,
    grouped,
    hardware_name,
    metric_name,
    sign_of,
    split_name,
)
from tactbench.core.leaderboard.probe import build_probe, with_leaks
from tactbench.core.leaderboard.sentences import NO_BETTER, Board, Note, above, below
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.plugins.registry import installed
from tactbench.core.statistics.rank import Rank, beyond_floor, excess_of
from tactbench.core.statistics.replicates import FEWEST, count_range, over_replicates
from tactbench.core.tables.text import cut, visible
from tactbench.core.tables.text_table import TextTable

if TYPE_CHECKING:
    from tactbench.core.matrix.store import Store

_Key = tuple[str, str, str, str]
LONGEST = 1000
"""Characters of a sentence on the provenance; the whole of it lies in the result folder."""


@dataclass(frozen=True)
class Block:
    """Rows that may be compared."""

    title: str
    """Task and its question."""
    setting: str
    """Metric, protocol and split."""
    origin: str
    """Simulated, emulated or measured."""
    lines: tuple[Line, ...]
    verdict: tuple[str, ...] = ()
    """At most two sentences on the result."""
    notes: tuple[Note, ...] = ()
    """At most five notes on marks and numbers."""


@dataclass(frozen=True)
class Table:
    """A leaderboard, ready to be shown."""

    blocks: tuple[Block, ...]
    sections: tuple[TextTable, ...] = ()
    """Tables below the blocks: events, and what was probed."""
    provenance: tuple[Row, ...] = ()
    """Versions, machine and commit of the runs."""

    @property
    def lines(self) -> list[Line]:
        """Return the lines of all blocks."""
        return [line for block in self.blocks for line in block.lines]

    @property
    def rows(self) -> list[Row]:
        """Return the rows, in the order of the lines."""
        return [line.row for line in self.lines]

    @property
    def notes(self) -> tuple[str, ...]:
        """Return the notes of all blocks, each once."""
        return tuple(dict.fromkeys(str(note) for block in self.blocks for note in block.notes))

    @property
    def footer(self) -> tuple[str, ...]:
        """Return the provenance in sentences, for files."""
        from tactbench.core.provenance.gather import foot

        made_by = foot(self.provenance) if self.provenance else ()
        return tuple(cut(visible(sentence), LONGEST) for sentence in made_by)


def over_all(store: Store, rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return one row a cell over its replicates, with stamps of leaks and the nuisances its order depends on."""
    from tactbench.core.leaderboard.sensitivity import with_dependence  # numerics

    return with_dependence(with_leaks(over_replicates(rows)), store)


def table_of(store: Store, rows: Sequence[Row]) -> Table:
    """Return the leaderboard of rows of a result folder, one a cell, with their tasks' questions; see `build_table`."""
    tasks = with_declared_of(installed(), rows).tasks
    names = {str(row["task"]) for row in rows}.intersection(tasks.names())
    made_by = sorted({str(row["made_by"]) for row in rows if row.get("made_by")})
    provenance = [known for known in map(store.provenance, made_by) if known]
    return build_table(rows, provenance, questions={name: tasks[name].spec.question for name in names})


def build_table(
    rows: Sequence[Row],
    provenance: Sequence[Row] = (),
    *,
    questions: Mapping[str, str] | None = None,
) -> Table:
    """Arrange `rows` into ranked blocks, with their sentences and notes.

    Parameters
    ----------
    rows
        Rows of one folder or of several, in any order.
    provenance
        What is known of the runs they are from: see `tactbench.core.provenance.gather`.
    questions
        What tasks ask, by name.
    """
    blocks = blocks_of(sorted(rows, key=itemgetter("cell")), questions or {})
    ordered = [line.row for block in blocks for line in block.lines]
    sections = (events_table(ordered), build_probe(ordered))
    found = tuple(section for section in sections if section is not None)
    return Table(blocks, found, tuple(provenance))


def blocks_of(rows: Sequence[Row], questions: Mapping[str, str]) -> tuple[Block, ...]:
    """Arrange rows, in the order of their cells' names, into ranked blocks."""
    groups = sorted(_grouped(rows).items(), key=lambda group: _order(group[0]))
    return tuple(_block(key, members, questions.get(key[0], "")) for key, members in groups)


def _block(key: _Key, members: Sequence[Row], question: str) -> Block:
    task, protocol, split, hardware = key
    bars = Bars(members)
    finished = [row for row in members if row["status"] == "done"]
    answers = [row for row in finished if not row["is_baseline"]]
    entered = [row for row in answers if not bars.no_better(row)]
    # What is equal stays in the order of the names.
    ordered = sorted(zip(errors(entered), entered, strict=True), key=lambda one: (one[0], error_of(one[1])))
    found, unranked = places([row for _, row in ordered])
    # Of equal place stays the better one first.
    placed = sorted(((row, found[row["cell"]]) for _, row in ordered), key=lambda one: one[1].place)
    unplaced = sorted((row for row in answers if bars.no_better(row)), key=error_of)
    trivial = sorted((row for row in finished if row["is_baseline"]), key=lambda row: (row["sensor"], error_of(row)))
    stopped = sorted((row for row in members if row["status"] != "done"), key=lambda row: row["status"])
    board = Board(placed, unplaced, trivial, stopped, unranked, bars)
    few = unranked == "few"
    lines = [
        *(line_of(row, None if few else placing, board.marks(row)) for row, placing in placed),
        *(line_of(row, None, board.marks(row), NO_BETTER) for row in unplaced),
        *(
            line_of(row, None, board.marks(row), "oracle" if row.get("looks_at") == "reference" else "")
            for row in trivial
        ),
        *(line_of(row, None, ()) for row in stopped),
    ]
    direction = "lower" if sign_of(members[0]) > 0 else "higher"
    setting = [f"{metric_name(members[0])}, {direction} is better", f"protocol {protocol}"]
    setting += [split_name(split)] if split else []
    classes = [len(row["classes"]) for row in finished if row["classes"]]
    setting += [count_range(classes, "class")] if classes else []
    return Block(
        title=visible(
            f"{task[:1].upper()}{task[1:]}" + (f": {question[:1].lower()}{question[1:]}" if question else "")
        ),
        setting=visible(" · ".join(setting)),
        origin=visible(_origin(finished, hardware)),
        lines=tuple(lines),
        verdict=tuple(map(visible, above(board))),
        notes=tuple(Note(visible(one.text), visible(one.hint), one.printed) for one in below(board)),
    )


def _origin(finished: Sequence[Row], hardware: str) -> str:
    if not finished:
        return "nothing finished"
    if finished[0].get("emulated"):
        return f"EMULATED devices (rig {finished[0]['rig']}): no sensor was touched"
    return "SIMULATED: no sensor was touched" if finished[0]["simulated"] else f"MEASURED ({hardware})"


def _order(key: _Key) -> tuple[Any, ...]:
    """Return what blocks are sorted by: within a task, what probes or is not kept apart comes after what is."""
    task, protocol, split, _ = key
    return task, split in ("shuffled", "in-session"), is_probe(protocol), key


def _grouped(rows: Sequence[Row]) -> dict[_Key, list[Row]]:
    """Group rows by what must not be mixed.

    A cell that was not begun knows neither its split, unless one was chosen, nor whether it would have been
    simulated: it stands with the finished cells of its rig, if these agree.
    """
    done = [row for row in rows if row["status"] == "done"]
    groups = grouped(done, lambda row: (row["task"], row["protocol"], row["split"], hardware_name(row)))
    near = {key: (*key[:2], members[0]["rig"]) for key, members in groups.items()}
    for row in rows:
        if row["status"] != "done":
            question = (row["task"], row["protocol"], row["rig"])
            found = [key for key, rig in near.items() if rig == question and row["split"] in (None, key[2])]
            alone = (*question[:2], row["split"] or "", hardware_name(row))
            groups.setdefault(found[0] if len(found) == 1 else alone, []).append(row)
    return groups


def places(results: Sequence[Row]) -> tuple[dict[str, Rank], str]:
    """Return where each of `results` stands, by the name of its cell, and why there are no rank intervals, if so.

    They are the finished answers of one block, no baselines, the best score first. A row without replicates enters
    with its own interval.
    """
    if any(row.get("replicates") for row in results) and all(map(_may_be_placed, results)):
        from tactbench.core.statistics.ranking import ranks  # numerics

        return ranks(results), ""
    ordered = errors(results)
    by_score = [Rank(1 + ordered.index(error), None, None, ordered.count(error) > 1) for error in ordered]
    why = "few" if not all(map(_may_be_placed, results)) else "these rows keep no replicates" if results else ""
    return dict(zip((row["cell"] for row in results), by_score, strict=True)), why


def _may_be_placed(row: Row) -> bool:
    """Return whether a row has enough campaigns or held-out units for a place, or states no number of them."""
    count = row.get("n_replicates")
    return count is None or (count >= FEWEST if row.get("replicate_unit") == "replicate" else row["ci_low"] is not None)


def errors(results: Sequence[Row]) -> list[float]:
    """Return what answers of one metric are ordered by, the lower the better.

    The score; of errors of force the mean square beyond the floor of the reference, if all of them have one. It may be
    below zero, where the error beyond the floor is 0, so that two answers of one sensor keep their order.
    """
    if beyond_floor(results):
        return [one if math.isfinite(one) else math.inf for one in map(excess_of, results)]
    return list(map(error_of, results))
