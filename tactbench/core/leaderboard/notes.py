"""The notes below a leaderboard: what marks mean, what was left out, how intervals came about, what ended badly."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from operator import itemgetter

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.names import (
    METRIC_NAMES,
    Row,
    answer_name,
    answer_or_probe,
    distinct,
    grouped,
    question_name,
)
from tactbench.core.leaderboard.verdict import against_trivial, best_trivials, comparison_key
from tactbench.core.spec.row import HIGH_ERROR, MEDIAN_ERROR
from tactbench.core.spec.status import STATUSES, STOPPED
from tactbench.core.tables.numbers import score, score_with_unit
from tactbench.core.tables.text import command_line, cut, visible

RANKS = (
    "A place with = is shared: the data do not tell these answers apart. Rank 95 % holds the places that the data do "
    "not exclude (docs/statistics.md)."
)
DAGGER = (
    "† test-set statistics were used: the protocol drops test rows by the test set's own mean and deviation, and "
    "`karl2016` scales each set, the test set too, by its own. A deployed sensor cannot; protocol `deployable` shows "
    "what it can."
)
TRUE_ERRORS = "True error (SIM): against the force that the twin exerted, free of the reference's noise."
_SET = re.compile(r"^(training|validation|test) (?=rows )")
_SIGMA = re.compile(r"^rows with (.+) beyond three sigma$")
MOST_CHANNELS = 4
MOST_NAMES = 8
"""Cells that ended alike and are named; the others are counted, and stand in the table."""
LONGEST_REASON = 600
"""Characters of a reason in a note; JSON, CSV and Parquet have all of it."""


def notes_of(rows: Sequence[Row], blocks: Sequence[Block]) -> list[str]:
    """Return the notes on the lines of `blocks`, the most important first; those on times stand elsewhere.

    First what did not finish, what leaks and what a deployed sensor could not do, then what the scores must be read
    with, then how they came about.

    Parameters
    ----------
    rows
        In the order of the lines.
    """
    return [
        *_stopped(rows, STOPPED),
        *(f"‡ {visible(str(stamp))}" for stamp in dict.fromkeys(one for row in rows for one in row["stamps"] or ())),
        *([DAGGER] if any(row["dagger"] for row in rows) else []),
        *_floors(rows),
        *_percentiles(rows),
        *_no_better(rows),
        *_tared(rows),
        *_ranks(blocks),
        *([TRUE_ERRORS] if any(row.get("true_score") is not None for row in rows) else []),
        *_timed_only(rows),
        *_stopped(rows, frozenset(STATUSES) - STOPPED),
        *_labels(rows),
        *interval_notes(rows),
        *_chosen(rows),
        *_left_out(rows),
        *_simulated(rows),
    ]


def _ranks(blocks: Sequence[Block]) -> Iterator[str]:
    """Yield what places and their intervals mean, and where there are none."""
    if any(line.placing and line.placing.low is not None for block in blocks for line in block.lines):
        yield RANKS
    several = [block for block in blocks if block.unranked and sum(one.kind == "result" for one in block.lines) > 1]
    reasons = distinct((block.unranked, block.title) for block in several)
    for reason, titles in reasons.items():
        where = "Places" if len(several) == len(blocks) and len(reasons) == 1 else f"In {'; in '.join(titles)}: places"
        yield f"{where} are by score alone, without intervals, since {reason}."


def _tared(rows: Sequence[Row]) -> list[str]:
    """Return one sentence on which recordings were tared, where some row's protocol is one that may."""
    sentences = []
    if held := ", ".join(sorted({f"{row['tare_s']:g} s" for row in rows if row.get("tare_s")})):
        sentences.append(f"`deployable`: each recording is tared on its own unloaded hold before its press ({held})")
    if any(row["protocol"] == "deployable-untared" and row["status"] == "done" for row in rows):
        sentences.append("`deployable-untared`: readings as they are")
    return _listed("", sentences)


def _listed(about: str, texts: Collection[str]) -> list[str]:
    """Return one sentence that lists texts; none without any."""
    return [visible(f"{about}{'; '.join(texts)}.")] if texts else []


def _percentiles(rows: Sequence[Row]) -> list[str]:
    """Return the percentiles that stand beside mean errors of vectors."""
    named = _namer(rows)
    found = [
        f"{named(row)}/{answer_name(row)} {score(row['scores'][MEDIAN_ERROR], row['unit'])}, "
        + score_with_unit(row["scores"][HIGH_ERROR], row["unit"])
        for row in rows
        if MEDIAN_ERROR in (row["scores"] or {}) and not row["is_baseline"]
    ]
    return _listed("Median and 95th percentile of the error over test rows: ", found)


def _floors(rows: Sequence[Row]) -> list[str]:
    """Return the floors of the references, once each, and what stands beyond them."""
    named = _namer(rows)
    floors = distinct(
        ((named(row), str(row["unit"])), row["reference_floor"])
        for row in rows
        if row.get("reference_floor") is not None
    )
    if not floors:
        return []
    each = "; ".join(f"{where} {_floor(found, unit)}" for (where, unit), found in floors.items())
    return [
        f"Floor, the deviation of the reference in the unloaded hold of the tested recordings: {each}. Beyond "
        "floor is sqrt(max(0, RMSE² − floor²)) of each replicate; a smaller RMSE is below it by chance. Ranks go "
        "by it where all answers of a block have it."
    ]


def _floor(found: Sequence[float], unit: str) -> str:
    """Return a floor; of several campaigns the root of their mean square."""
    text = score_with_unit(math.sqrt(sum(one * one for one in found) / len(found)), unit)
    ends = f"{score(min(found), unit)} … {score(max(found), unit)}"
    return text if len(found) == 1 else f"{text} (of {len(found)}: {ends})"


def interval_notes(rows: Sequence[Row]) -> list[str]:
    """Return one sentence a task and kind of interval; what is in brackets only where it is the same for all."""
    among = _among(rows)
    shown = [row for row in rows if row["ci_method"] and not row["is_baseline"]]
    kinds = grouped(shown, lambda row: (row["task"], re.sub(r" \([^)]*\)", "", visible(row["ci_method"]))))
    notes = []
    for (task, short), members in kinds.items():
        texts = {visible(row["ci_method"]) for row in members}
        how = texts.pop() if len(texts) == 1 else short
        notes.append(f"{visible(task)}{among(task, [row.get('split') for row in members])}: interval by {how}.")
    return notes


def _among(rows: Sequence[Row]) -> Callable[[str, Sequence[object]], str]:
    """Return what says which splits are meant, where they are not all under which a task was asked."""
    every = distinct((row["task"], str(row.get("split"))) for row in rows)

    def among(task: str, splits: Sequence[object]) -> str:
        names = dict.fromkeys(map(str, splits))
        return "" if len(names) == len(every[task]) else visible(f" (split {', '.join(names)})")

    return among


def _namer(rows: Sequence[Row]) -> Callable[[Row], str]:
    """Return what names sensor and task, with the split where the task was asked under several."""
    among = _among(rows)
    return lambda row: question_name(row) + among(row["task"], [row.get("split")])


def _chosen(rows: Sequence[Row]) -> list[str]:
    """Return one sentence for all answers that chose the same on validation data."""
    named = _namer(rows)
    found = distinct((visible(picked(row)), f"{named(row)}/{answer_name(row)}") for row in rows if row["chosen"])
    return [f"{', '.join(names)}: chosen on validation data: {what}." for what, names in found.items()]


def picked(row: Row) -> str:
    """Return what an answer chose on validation data: k of `window_grid` with its meaning, others by name."""
    parts = []
    for key, value in sorted(row["chosen"].items()):
        name, _, fold = str(key).partition(" of fold ")
        text = f"{value:g}" if isinstance(value, int | float) else str(value)
        where = f" of fold {fold}" if fold else ""
        if name == "k":
            parts.append(f"k = {text} samples before the newest in the mean filter{where}")
        elif name == "threshold":
            parts.append(f"{name} = {text}{where} (of the score that {row['estimator']} gives a frame)")
        else:
            parts.append(f"{name.rstrip('_')} = {text}{where} (parameter of {row['estimator']})")
    return ", ".join(parts)


def _no_better(rows: Sequence[Row]) -> list[str]:
    """Return one sentence a question and trivial answer on the answers that are not shown to be better than it."""
    probed = {question_name(row) for row in rows if is_probe(row["protocol"])}
    best = best_trivials(rows)
    pairs = []
    for row in rows:
        if row["status"] != "done" or row["is_baseline"] or is_probe(row["protocol"]):
            continue  # a probe should be no better than trivial
        trivial = best.get(comparison_key(row))
        bar = row["baseline"] if trivial is None else trivial["score"]
        shown = "" if bar is None else against_trivial(row, bar)
        if shown:
            where = question_name(row)
            look = "" if where in probed else f": `{_probing(row)}`"
            than = f"{_trivial_name(trivial)}, {score_with_unit(bar, row['unit'])}"
            says = f"{shown} than {than}; see how the recordings differ before blaming the sensor{look}."
            pairs.append(((where, says), f"{answer_name(row)} ({row['protocol']}, split {row['split']})"))
    return [
        visible(f"{where}/{', '.join(names)} {'is' if len(names) == 1 else 'are'} {says}")
        for (where, says), names in distinct(pairs).items()
    ]


def _trivial_name(trivial: Row | None) -> str:
    if trivial is None:
        return "the trivial baseline"
    reads = ", which reads no sensor, only the time" if trivial.get("looks_at") == "time" else ""
    return f"the trivial {answer_name(trivial)}{reads}"


def _probing(row: Row) -> str:
    """Return the command that shows what the recordings of a row give away."""
    replayed = () if row["rig"] == "twin" else ("--rig", row["rig"], "--recordings", "DIR")
    return command_line("tactbench", "run", "--sensor", row["sensor"], "--task", row["task"], *replayed, "--probe")


def _timed_only(rows: Sequence[Row]) -> list[str]:
    """Return which trivial answers knew more than readings tell."""
    named = _namer(rows)
    found = distinct(
        (answer_name(row), f"{named(row)} {score(row['score'], row['unit'])}")
        for row in rows
        if row.get("looks_at") == "time" and row["is_baseline"] and row["status"] == "done"
    )
    return [
        f"{name} looks at the time of a sample and at no reading: it knows that every recording is pressed alike. The "
        f"baseline column leaves it out where answers read the sensor: {', '.join(where)}."
        for name, where in found.items()
    ]


def _labels(rows: Sequence[Row]) -> list[str]:
    """Return the scores of answers to frames under halved and doubled thresholds of their labels."""
    found = []
    for row in rows:
        name = METRIC_NAMES.get(row["metric"], row["metric"])
        scores = [row["scores"].get(f"{name} with label thresholds {how}") for how in ("halved", "doubled")]
        if row["status"] == "done" and not row["is_baseline"] and None not in scores:
            ends = " … ".join(f"{one:.3f}" for one in scores)
            found.append(f"{row['sensor']}/{row['task']}/{answer_name(row)} {ends}")
    return _listed("With the thresholds of the labels halved … doubled: ", found)


def _left_out(rows: Sequence[Row]) -> list[str]:
    """Return what was left out of the data, and what their recordings remark; each once."""
    among = _among(rows)
    counted = distinct(
        ((question_name(row), row["task"], count), str(row.get("split")))
        for row in rows
        for count in count_texts(row["counts"] or {})
    )
    notes = [visible(f"{name}{among(task, splits)}: {count}.") for (name, task, count), splits in counted.items()]
    notes += [visible(f"{row['sensor']}: {remark}") for row in rows for remark in row["remarks"] or ()]
    return list(dict.fromkeys(notes))


def count_texts(counts: Mapping[str, int]) -> list[str]:
    """Return one text a reason, of a cell's counts."""
    sums: Counter[str] = Counter()
    beyond: Counter[str] = Counter()
    for what, count in counts.items():
        reason = _SET.sub("", what)
        sigma = _SIGMA.match(reason)
        if sigma:
            beyond[sigma[1]] += count
        else:
            sums[reason] += count
    texts = [f"{what}: {count}" for what, count in sums.items() if count]
    if beyond:
        listed = ", ".join(f"{channel} {count}" for channel, count in beyond.most_common(MOST_CHANNELS))
        more = len(beyond) - MOST_CHANNELS
        texts.append(f"rows beyond three sigma in {listed}" + (f" and {more} more channels" if more > 0 else ""))
    return texts


def _stopped(rows: Sequence[Row], statuses: Collection[str]) -> Iterator[str]:
    """Yield one sentence for all cells that ended alike in one of `statuses`: which, why, how to look into it."""
    stopped = [row for row in rows if row["status"] in statuses and row["status"] != "done"]
    alike = grouped(stopped, itemgetter("status", "signal", "reason"))
    for (status, signal, reason), members in alike.items():
        names = list(dict.fromkeys(f"{question_name(row)}/{answer_or_probe(row)}" for row in members))
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        by = f" by signal {signal}" if signal is not None else ""
        why = cut(visible(reason), LONGEST_REASON)
        sentence = f"{', '.join(names[:MOST_NAMES])}{more} {visible(status)}{by}: {why}"
        if status in STOPPED:
            end = "" if sentence.endswith((".", "!", "?", "…")) else "."
            sentence += f"{end} Look into it: {command_line('tactbench', 'why', members[0]['cell'])}"
        yield sentence


def _simulated(rows: Sequence[Row]) -> list[str]:
    """Return what SIM and EMULATED mean, and what the simulations assumed."""
    simulated = [row for row in rows if row["simulated"]]
    marks = ["SIM: simulated by the twin"] if any(not row.get("emulated") for row in simulated) else []
    if any(row.get("emulated") for row in rows):
        marks.append("EMULATED: read through the drivers from emulated devices that the twin moved")
    texts = (", ".join(f"{key} {value}" for key, value in sorted(row["assumptions"].items())) for row in simulated)
    assumptions = dict.fromkeys(visible(text) or "see docs/twin.md" for text in texts)
    return [f"{'; '.join(marks)}; never ranked against hardware. Assumed: {one}." for one in assumptions]
