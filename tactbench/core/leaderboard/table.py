"""Construction of the leaderboard object that is rendered in every format.

Comparable rows are in one block, and ranks are within a block. Rows under different tasks, protocols or
splits, or from simulation and hardware, are not comparable. A table depends on its rows, not on their order.
Control characters in its texts are escaped (`text.visible`); formats escape their own syntax.
"""

from __future__ import annotations

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
    direction,
    error_of,
    grouped,
    hardware_name,
    metric_name,
    split_name,
)
from tactbench.core.leaderboard.probe import with_leaks
from tactbench.core.leaderboard.sentences import NO_BETTER, Board, above, below
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.plugins.registry import installed
from tactbench.core.statistics.rank import Rank, beyond_floor, excess_of
from tactbench.core.statistics.replicates import FEWEST, count_range, over_replicates
from tactbench.core.tables.text import visible
from tactbench.core.tables.text_table import TextTable, field_text

if TYPE_CHECKING:
    from tactbench.core.matrix.store import Store

_Key = tuple[str, str, str, str]


@dataclass(frozen=True)
class Block:
    """A part of a leaderboard with comparable rows, ranked among themselves."""

    title: str
    """Name and question of the task."""
    setting: str
    """Metric, protocol and split of the rows."""
    origin: str
    """Origin of the rows: simulated, emulated or measured."""
    lines: tuple[Line, ...]
    verdict: tuple[str, ...] = ()
    """At most two sentences above the table, on the outcome of the comparison."""
    notes: tuple[str, ...] = ()
    """At most five notes below the table, on marks and numbers."""


@dataclass(frozen=True)
class Table:
    """A leaderboard of blocks of comparable rows, with sentences and notes, for output in any format."""

    blocks: tuple[Block, ...]
    sections: tuple[TextTable, ...] = ()
    """Tables below the blocks: event detection."""
    provenance: tuple[Row, ...] = ()
    """Software versions, machine and commit of each run with rows in the table."""

    @property
    def lines(self) -> list[Line]:
        """The lines of all blocks."""
        return [line for block in self.blocks for line in block.lines]

    @property
    def rows(self) -> list[Row]:
        """The result rows of all blocks, in the order of the lines."""
        return [line.row for line in self.lines]

    @property
    def footer(self) -> tuple[str, ...]:
        """The provenance as text, for tables in files."""
        return tuple(visible(f"Made with {field_text(one)}.") for one in self.provenance)


def over_all(store: Store, rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return one row for each cell over its replicates, with stamps of leaks and decisive nuisances."""
    from tactbench.core.leaderboard.sensitivity import with_dependence  # numerics

    return with_dependence(with_leaks(over_replicates(rows)), store)


def table_of(store: Store, rows: Sequence[Row]) -> Table:
    """Return the leaderboard of a result folder's rows, one for each cell, with provenance; see `build_table`."""
    tasks = with_declared_of(installed(), rows).tasks
    names = {str(row["task"]) for row in rows}.intersection(tasks.names())
    made_by = sorted({str(row["made_by"]) for row in rows if row.get("made_by")})
    provenance = [known for known in map(store.provenance, made_by) if known]
    return build_table(rows, provenance, questions={name: tasks[name].spec.question for name in names})


def build_table(
    rows: Sequence[Row], provenance: Sequence[Row] = (), *, questions: Mapping[str, str] | None = None
) -> Table:
    """Return `rows` arranged into ranked blocks with sentences and notes.

    Parameters
    ----------
    rows
        Rows of one folder or of several, in any order.
    provenance
        Versions, machine and commit of the runs; see `tactbench.core.provenance`.
    questions
        Questions of the tasks, by name of the task.
    """
    groups = sorted(_grouped(sorted(rows, key=itemgetter("cell"))).items(), key=lambda group: _order(group[0]))
    blocks = tuple(_block(key, members, (questions or {}).get(key[0], "")) for key, members in groups)
    ordered = [line.row for block in blocks for line in block.lines]
    return Table(blocks, tuple(filter(None, [events_table(ordered)])), tuple(provenance))


def _block(key: _Key, members: Sequence[Row], question: str) -> Block:
    task, protocol, split, hardware = key
    bars = Bars(members)
    finished = [row for row in members if row["status"] == "done"]
    answers = [row for row in finished if not row["is_baseline"]]
    entered = [row for row in answers if not bars.no_better(row)]
    # Squares beyond the floor may be negative, so that answers of one sensor keep their order there.
    first = excess_of if beyond_floor(entered) else error_of
    entered.sort(key=lambda row: (first(row), error_of(row)))  # equal ones in the order of their names
    ranks: dict[str, Rank] = {}
    if entered and all(map(_may_be_placed, entered)):
        from tactbench.core.statistics.ranking import ranks as ranks_of  # numerics

        ranks = ranks_of(entered)
        entered.sort(key=lambda row: ranks[row["cell"]].place)
    unplaced = sorted((row for row in answers if bars.no_better(row)), key=error_of)
    trivial = sorted((row for row in finished if row["is_baseline"]), key=lambda row: (row["sensor"], error_of(row)))
    stopped = sorted((row for row in members if row["status"] != "done"), key=lambda row: row["status"])
    board = Board(entered, ranks, unplaced, trivial, stopped, bars)
    texts = {str(row["cell"]): NO_BETTER for row in unplaced}
    texts |= {str(row["cell"]): "oracle" for row in trivial if row.get("looks_at") == "reference"}
    setting = [f"{metric_name(members[0])}, {direction(members[0])}", f"protocol {protocol}"]
    setting += [split_name(split)] if split else []
    classes = [len(row["classes"]) for row in finished if row["classes"]]
    setting += [count_range(classes, "class")] if classes else []
    asked = f": {question[:1].lower()}{question[1:]}" if question else ""
    return Block(
        title=visible(f"{task[:1].upper()}{task[1:]}{asked}"),
        setting=visible(" · ".join(setting)),
        origin=visible(_origin(finished, hardware)),
        lines=(
            *(line_of(row, ranks.get(row["cell"]), board.marks(row), texts.get(row["cell"], ""))
              for row in board.finished),
            *map(line_of, stopped),
        ),
        verdict=tuple(map(visible, above(board))),
        notes=tuple(map(visible, below(board))),
    )  # fmt: skip


def _origin(finished: Sequence[Row], hardware: str) -> str:
    if not finished:
        return "nothing finished"
    if hardware.startswith("rig "):
        return f"MEASURED ({hardware})"
    return f"{hardware.replace('SIM', 'SIMULATED')}: no sensor was touched"


def _order(key: _Key) -> tuple[Any, ...]:
    """Return the sort key of a block: by task, with probes and leaking splits last."""
    task, protocol, split, _ = key
    return task, split in ("shuffled", "in-session"), is_probe(protocol), key


def _grouped(rows: Sequence[Row]) -> dict[_Key, list[Row]]:
    """Return rows grouped into comparable ones, by (task, protocol, split, hardware).

    The row of a cell that was not begun may lack its split and its origin: it is added to the
    group of the finished cells with its task, protocol and rig, if there is only one such group.
    """
    done = [row for row in rows if row["status"] == "done"]
    groups = grouped(done, lambda row: (row["task"], row["protocol"], row["split"], hardware_name(row)))
    near = {key: (*key[:2], members[0]["rig"]) for key, members in groups.items()}
    for row in rows:
        if row["status"] != "done":
            question = (row["task"], row["protocol"], row["rig"])
            found = [key for key, rig in near.items() if rig == question and row["split"] in (None, key[2])]
            own = (*question[:2], row["split"] or "", hardware_name(row))
            groups.setdefault(found[0] if len(found) == 1 else own, []).append(row)
    return groups


def _may_be_placed(row: Row) -> bool:
    """Return True if a row has enough campaigns or held-out units for a place."""
    enough = (row.get("n_replicates") or 0) >= FEWEST
    return enough if row.get("replicate_unit") == "replicate" else row["ci_low"] is not None
