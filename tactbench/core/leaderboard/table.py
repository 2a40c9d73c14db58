"""Construction of the leaderboard object that is rendered in every format.

Comparable rows are in one block, and ranks are within a block. Rows under different tasks, protocols or
splits, or from simulation and hardware, are not comparable. A table depends on its rows, not on their order.
Control characters in its texts are escaped (`text.visible`); formats escape their own syntax. Last: the table
of event detectors, and the stamp on rows whose score is mostly that of the first frame of each recording.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from tactbench.core.evaluation.protocols import DEPLOYABLE, FIRST_FRAME, is_probe
from tactbench.core.leaderboard.names import (
    WORSE_END,
    Bars,
    Line,
    Row,
    answer_name,
    direction,
    error_of,
    grouped,
    hardware_name,
    line_of,
    metric_name,
    sign_of,
    split_name,
)
from tactbench.core.leaderboard.sentences import NO_BETTER, Board, above, below
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.declared import with_declared_of
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.row import LEAKS
from tactbench.core.statistics.rank import Rank, beyond_floor, excess_of
from tactbench.core.statistics.replicates import FEWEST, count_range, over_replicates
from tactbench.core.tables.text import ABSENT, TextTable, field_text, score_with_unit, text_table, visible

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


LEAK_SHARE = 0.5
"""Share of the skill (score beyond the trivial answer's) at which the first frame's skill is called a leak."""
TAIL = 0.025
"""Largest probability that a guess is right as often as a first frame that counts as better than a guess."""
FEWEST_RECORDINGS = 5
"""Smallest number of test recordings for a statement on a regression from first frames."""


def with_leaks(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return rows, one for each cell, stamped as leaking if the first frame explains half of the skill or more."""
    firsts = {_question(row): row for row in rows if row["protocol"] == FIRST_FRAME.name and row["status"] == "done"}
    return [_stamped(row, firsts.get(_question(row))) for row in rows]


def _question(row: Row) -> tuple[str, ...]:
    return row["sensor"], row["task"], row["rig"], row["split"], answer_name(row)


def _stamped(row: dict[str, Any], first: Row | None) -> dict[str, Any]:
    """Return a row with a stamp if it leaks, given the result of first frames for the same question."""
    # A split that keeps nothing apart has a stamp of its own.
    asked = row["protocol"] == DEPLOYABLE.name and row["split"] not in ("shuffled", "in-session")
    if first is None or row["is_baseline"] or row["status"] != "done" or not asked or row["baseline"] is None:
        return row
    skill, most = (sign_of(row) * (row["baseline"] - one["score"]) for one in (first, row))
    if skill < LEAK_SHARE * most or not _beyond_guessing(first, row["baseline"]):
        return row
    alone, whole = (score_with_unit(one["score"], one["unit"]) for one in (first, row))
    return {**row, "stamps": [*row["stamps"], f"{LEAKS}first frame alone {alone} of {whole}."]}


def _beyond_guessing(first: Mapping[str, Any], trivial: float) -> bool:
    """Return True if the first frame answers better than a guess, False also if there are too few recordings.

    Classes: by the exact binomial tail of the number of right answers, one for each recording; a guess is the
    most frequent class. Numbers: if the interval is better than the trivial score.
    """
    sign, table = sign_of(first), first["confusion"]
    if table is None:
        worst = first[WORSE_END[sign]]
        return first["n_test"] >= FEWEST_RECORDINGS and worst is not None and sign * (trivial - worst) > 0
    from scipy.special import bdtrc

    n, right = sum(map(sum, table)), sum(line[place] for place, line in enumerate(table))
    guess = max(map(sum, table), default=0) / max(n, 1)
    return guess < 1.0 and right > 0 and bool(bdtrc(right - 1, n, guess) <= TAIL)


_FIGURES = {
    "precision": "precision", "recall": "recall", "misses": "misses", "events": "events",
    "latency p50 [ms]": "onset latency p50 ms", "p95 [ms]": "onset latency p95 ms",
    "false alarms/min": "false alarms per minute",
    "compute [s/s]": "compute s per s of signal",
}  # fmt: skip
"""Key of the figure of merit of each column."""
_NOTE = (
    "Latency: from the labelled onset to the alarm, with the detector's computing time, over hits; negative is early. "
    "Compute: computing time per second of signal."
)


def events_table(rows: Sequence[Row]) -> TextTable | None:
    """Return the table of event detection from the finished rows; None if no row is of an event task."""
    finished = [row for row in rows if row["status"] == "done" and row.get("events")]
    if not finished:
        return None
    lines = []
    for row in finished:
        figures = row["events"]
        values = {name: figures.get(key) for name, key in _FIGURES.items()}
        texts = {name: ABSENT if value is None else f"{value:.3g}" for name, value in values.items()}
        if figures.get("alarms") == 0:
            texts["latency p50 [ms]"] = "never alarms"
        lines.append((visible(row["task"]), visible(row["sensor"]), answer_name(row), *texts.values()))
    bound, area = (
        " or ".join(dict.fromkeys(f"{row['events'][key]:g}" for row in finished if key in row["events"]))
        for key in ("bound of false alarms per minute", "area up to false alarms per minute")
    )
    limit = f" for at most {bound} false alarms a minute" if bound else ""
    notes = (f"Recall area: recall, averaged over false alarms a minute from 0 to {area}. " * bool(area) + _NOTE,)
    kinds = ["baseline" if row["is_baseline"] else "result" for row in finished]
    title = f"Events, at the threshold that validation recordings chose{limit}"
    columns = ("task", "sensor", "estimator", *_FIGURES)
    return text_table(title, columns, lines, numeric=_FIGURES, kinds=kinds, notes=notes)
