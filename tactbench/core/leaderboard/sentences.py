"""Sentences above and below a leaderboard block: a closed list, with the condition for each sentence.

docs/tables.md has the list. At most two sentences are above and five notes below, in the order of this module.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter

from tactbench.core.leaderboard.names import Bars, Row, answer_name, grouped, held_out, metric_name, sign_of
from tactbench.core.spec.row import STOPPED, plural
from tactbench.core.statistics.rank import Rank, beyond_floor
from tactbench.core.statistics.replicates import FEWEST, against_reference, count_range, least_coverage, percent
from tactbench.core.tables.text import cut, interval, score, score_with_unit

MOST_BELOW = 5
MOST_NAMES = 4
"""Largest number of answers named in a sentence; further answers are counted."""
LONGEST = 300
"""Largest number of characters of a note."""
ORDER_DEPENDS_ON = "order_depends_on"
"""Key of a row with the nuisances at whose ends the order of the sensors turns round, if computed."""
NO_BETTER, UNSHOWN, STAMPED, FOUND, SHARED = "–", "*", "‡", "!", "="


@dataclass(frozen=True)
class Board:
    """The result rows of a leaderboard block, grouped for its sentences."""

    placed: Sequence[Row]
    """Answers that are better than the trivial answer of their sensor, the best first."""
    ranks: Mapping[str, Rank]
    """Ranks of the placed answers by name of the cell; empty if there are too few campaigns or held-out units."""
    unplaced: Sequence[Row]
    """Answers that are no better than the trivial answer of their sensor."""
    trivial: Sequence[Row]
    stopped: Sequence[Row]
    """Rows of cells without a score: failed, stopped or skipped."""
    bars: Bars

    @property
    def answers(self) -> list[Row]:
        """All answers of the block, placed answers first."""
        return [*self.placed, *self.unplaced]

    @property
    def finished(self) -> list[Row]:
        """The answers and the trivial answers of the block."""
        return [*self.answers, *self.trivial]

    @property
    def by_floor(self) -> bool:
        """True if places are by errors beyond the noise floor of the reference."""
        return beyond_floor(self.placed)

    def name(self, row: Row) -> str:
        """Return the name of a row in a sentence: its estimator, with the sensor if the block has several sensors."""
        several = len({one["sensor"] for one in self.finished}) > 1
        return f"{row['sensor']}/{answer_name(row)}" if several else answer_name(row)

    def marks(self, row: Row) -> list[str]:
        """Return the marks (``*``, ``‡``, ``!``) of a finished row."""
        unshown = not row["is_baseline"] and not self.bars.no_better(row) and self.bars.unshown(row)
        found = {UNSHOWN: unshown, STAMPED: row["stamps"], FOUND: row.get("findings")}
        return [mark for mark, has in found.items() if has]

    def bars_of(self, rows: Sequence[Row]) -> str:
        """Return as text the trivial answers to compare `rows` with, and their scores."""
        bars = ((self.bars.trivial(row), score_with_unit(self.bars.score(row), row["unit"])) for row in rows)
        return _some(f"{'the trivial answer' if bar is None else self.name(bar)} {score}" for bar, score in bars)


def _some(names: Iterable[str]) -> str:
    """Return a text of at most `MOST_NAMES` names, each once, and the number of further names."""
    each = list(dict.fromkeys(names))
    return ", ".join(each[:MOST_NAMES]) + f" and {len(each) - MOST_NAMES} more" * (len(each) > MOST_NAMES)


def above(board: Board) -> tuple[str, ...]:
    """Return at most two sentences above a table: on its outcome and on a caveat."""
    return tuple(filter(None, (_outcome(board), _timed(board) or _dependence(board))))


def _outcome(board: Board) -> str:
    """Return a sentence on the best answer, or on the reason why no answer is shown to be best."""
    better = "better than the trivial answer of its own sensor"
    if not board.placed:
        return f"No answer is {better} ({board.bars_of(board.unplaced)})." if board.unplaced else ""
    first, *others = board.placed
    name = board.name(first)
    quality = "the smallest error beyond the floor" if board.by_floor else "the best score"
    if not board.ranks:
        return f"{_too_few(board.placed)}; {name} has {quality}."
    where = "In simulation " if first["simulated"] and not first.get("emulated") else ""
    if board.bars.unshown(first):
        return f"{where}{name} has {quality}, and is not shown to be {better} ({board.bars_of([first])})."
    if not others:
        return f"{where}{name} alone is {better}." if board.bars.score(first) is not None else ""
    # Answers of the same place differ from it in single pairs at most, and of many pairs some differ by chance.
    place = board.ranks[first["cell"]].place
    alike = [row for row in others if (rank := board.ranks[row["cell"]]).place == place or not rank.behind]
    if alike:
        return f"{where}{name} has {quality}; {_some(map(board.name, alike))} cannot be distinguished from it."
    return f"{where}{name} is best; {_closest(board, first, others)}."


def _too_few(rows: Sequence[Row]) -> str:
    """Return a clause that the number of campaigns or held-out units is too small for intervals."""
    if held_out(rows[0]):
        unit, more = str(rows[0]["replicate_unit"]), " of each class" if rows[0]["classes"] else ""
    else:
        unit, more = "campaign", " (`--repeats 8`)" if rows[0]["repeats"] < FEWEST else ""
    have = count_range([row["n_replicates"] for row in rows], unit)
    return f"{have}: too few for intervals and places, which need {FEWEST}{more}"


def _closest(board: Board, first: Row, others: Sequence[Row]) -> str:
    """Return a clause on the answer closest to the best answer, with the difference of their scores."""
    from tactbench.core.statistics.paired import difference  # numerics

    unit, sign = first["unit"], -sign_of(first)
    found, second = min(((difference(first, row), row) for row in others), key=lambda pair: sign * pair[0].value)
    low, high = sorted(sign * (end or 0.0) for end in (found.low, found.high))
    closest = f"closest is {board.name(second)}"
    if low <= 0:  # apart by what places go by, and not by this difference
        return closest
    by = score_with_unit(sign * found.value, unit)
    return f"{closest}, worse by {by} ({percent(None, None)} {interval(low, high, unit)})"


def _timed(board: Board) -> str:
    """Return a sentence on trivial answers that use the time alone, if an answer is not shown to be better."""
    held = [row for row in board.answers if board.bars.no_better(row) or board.bars.unshown(row)]
    bars = [trivial for row in held if (trivial := board.bars.trivial(row)) is not None]
    timed = _some(answer_name(bar) for bar in bars if bar.get("looks_at") == "time")
    return f"{timed} reads no sensor, only the time: such a score needs no touch." if timed else ""


def _dependence(board: Board) -> str:
    """Return a sentence on the nuisances that the order of simulated sensors depends on, if computed."""
    named = dict.fromkeys(name for row in board.answers for name in row.get(ORDER_DEPENDS_ON) or ())
    return f"The order of the sensors depends on {' and '.join(named)} (`tactbench sensitivity`)." if named else ""


def below(board: Board) -> tuple[str, ...]:
    """Return at most five notes below a table."""
    notes = [*_marks(board), *_ended(board, failed=True), *_protocol(board), *_floors(board), *_compared(board),
             *_how(board), *_hosts(board), *_ended(board, failed=False)]  # fmt: skip
    return tuple(cut(note, LONGEST) for note in notes)[:MOST_BELOW]


def _ended(board: Board, *, failed: bool) -> Iterator[str]:
    """Yield a note on the cells that failed, or on those that were skipped, with the reason."""
    rows = [row for row in board.stopped if (row["status"] in STOPPED) is failed]
    alike = [row for row in rows if (row["status"], row["reason"]) == (rows[0]["status"], rows[0]["reason"])]
    if alike:
        names = _some(f"{row['sensor']}/{answer_name(row)}" for row in alike)
        others = f"; {len(rows) - len(alike)} more ended otherwise" if len(rows) > len(alike) else ""
        yield f"{names} {alike[0]['status']}{others}: {alike[0]['reason']}"


def _marks(board: Board) -> Iterator[str]:
    """Yield one note for each mark in the table, at most five notes."""
    finished = board.finished
    for mark, key in ((STAMPED, "stamps"), (FOUND, "findings")):
        texts = grouped([(str(text), row) for row in finished for text in row.get(key) or ()], itemgetter(0))
        notes = [
            f"{_some(board.name(row) for _, row in of)}: " * (len(of) < len(finished)) + text.rstrip(".")
            for text, of in texts.items()
        ]
        if notes:
            yield f"{mark}  {'; '.join(notes)}"
    if any(rank.unsure for rank in board.ranks.values()):
        yield f"{SHARED}  each of these rows cannot be distinguished from at least one other"
    marked = {f"{NO_BETTER}  no": board.unplaced if board.placed else (),
              f"{UNSHOWN}  not shown to be": [row for row in board.placed if UNSHOWN in board.marks(row)]}  # fmt: skip
    for mark, rows in marked.items():
        if rows:
            yield f"{mark} better than the trivial answer of its own sensor ({board.bars_of(rows)})"


def _protocol(board: Board) -> Iterator[str]:
    """Yield a note on a protocol that uses statistics of the test set."""
    for protocol in {row["protocol"] for row in board.finished if row["dagger"]}:
        yield f"Protocol {protocol} uses means and deviations of the test set, unknown in use."


def _floors(board: Board) -> Iterator[str]:
    """Yield notes that define the errors of force, and the floor of these errors due to the reference's noise."""
    simulated = next((row for row in board.finished if row.get("reference_score") is not None), None)
    if simulated is not None:
        true, noisy = (metric_name({**row, "unit": "1"}) for row in (simulated, against_reference(simulated)))
        yield f"{true[:1].upper()}{true[1:]}: against the force exerted. {noisy}: against the noisy reference."
    parts = []
    known = [row for row in board.answers if row.get("score_beyond_floor") is not None]
    for sensor, rows in grouped(known, lambda row: str(row["sensor"])).items():
        unit, floors = rows[0]["unit"], [row["reference_floor"] for row in rows]
        ends = dict.fromkeys(score(end, unit) for end in (min(floors), max(floors)))
        reach = 1.96 * max(row.get("reference_floor_se") or 0.0 for row in rows)
        parts.append(f"{sensor} {' … '.join(ends)}{f' ± {score(reach, unit)}' if reach else ''}")
    by = "; places go by it" if board.placed and board.by_floor else ""
    if parts:
        yield f"Beyond floor: the root of RMSE² − floor²{by}. Floor: the reference's own noise ({', '.join(parts)})."


def _compared(board: Board) -> Iterator[str]:
    """Yield a note on the comparison of several sensors on recordings, and on its limitations."""
    rows = [row for row in board.placed if held_out(row)]
    if not board.ranks or len({row["sensor"] for row in rows}) < 2:
        return
    unit = plural(str(rows[0]["replicate_unit"]))
    shared = len({tuple(row["replicates"]["names"]) for row in rows}) == 1
    parts = [f"paired over {unit}, which all rows share" if shared else f"unpaired: {unit} differ between rows"]
    trivial = [bar for row in rows if (bar := board.bars.score(row)) is not None]
    if not rows[0]["classes"] and trivial and max(trivial) > 1.05 * min(trivial):
        ends = interval(min(trivial), max(trivial), rows[0]["unit"])
        parts.append(f"the targets differ between sensors (trivial answers {ends})")
    if {row.get("n_specimens") for row in rows} == {1}:
        parts.append("one specimen of each sensor: how specimens differ is not known")
    yield f"Places: {'; '.join(parts)}."


def _how(board: Board) -> Iterator[str]:
    """Yield a note that defines score and interval."""
    campaigns = [row for row in board.answers if row.get("replicate_unit") == "replicate"]
    if campaigns:
        counts = count_range([row["n_replicates"] for row in campaigns], "campaign")
        covered = [least_coverage(row["n_replicates"]) for row in campaigns if row["ci_low"] is not None]
        least = f"; interval: of that median, coverage at least {100 * min(covered):.3g} %" if covered else ""
        yield f"Score: median over {counts}, each simulated anew with its own seed{least}."


def _hosts(board: Board) -> Iterator[str]:
    """Yield a note with the reason why the times of a block cannot be compared."""
    hosts = {row["host"] for row in board.answers if row["fit_s"] is not None}
    if len(hosts) > 1:
        yield f"Times cannot be compared: they were taken on {len(hosts)} hosts."
