"""The notes below a leaderboard: what marks mean, what was left out, how intervals came about, what ended badly."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

from tactbench.core.evaluation.protocols import is_probe
from tactbench.core.leaderboard.blocks import Block
from tactbench.core.leaderboard.events import label_notes
from tactbench.core.leaderboard.names import answer_name, answer_or_probe, question_name
from tactbench.core.leaderboard.verdict import against_trivial, best_trivials, comparison_key
from tactbench.core.spec.row import HIGH_ERROR, MEDIAN_ERROR
from tactbench.core.spec.status import STATUSES, STOPPED
from tactbench.core.tables.numbers import score, suffix
from tactbench.core.tables.text import command_line, cut, visible

Row = Mapping[str, Any]

RANKS = (
    "A place with = is shared: the data do not tell these answers apart. Rank 95 % holds the places that the data do "
    "not exclude (docs/statistics.md)."
)
DAGGER = (
    "† test-set statistics were used: the protocol drops test rows by the test set's own mean and deviation, and "
    "`karl2016` scales each set, the test set too, by its own. A deployed sensor cannot; protocol `deployable` shows "
    "what it can."
)
_SET = re.compile(r"^(training|validation|test) (rows .*)$")
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
        *_stopped_notes(rows, STOPPED),
        *_mark_notes(rows),
        *_floor_notes(rows),
        *_vector_notes(rows),
        *_no_better_notes(rows),
        *_tare_notes(rows),
        *_rank_notes(blocks),
        *_true_error_notes(rows),
        *_other_knowledge_notes(rows),
        *_stopped_notes(rows, frozenset(STATUSES) - STOPPED),
        *label_notes(rows),
        *interval_notes(rows),
        *_chosen_notes(rows),
        *_left_out_notes(rows),
        *_simulation_notes(rows),
    ]


def _rank_notes(blocks: Sequence[Block]) -> list[str]:
    """Return what places and their intervals mean, and where there are none."""
    notes = []
    if any(line.placing and line.placing.low is not None for block in blocks for line in block.lines):
        notes.append(RANKS)
    reasons: dict[str, list[str]] = {}
    for block in blocks:
        if block.unranked and sum(line.kind == "result" for line in block.lines) > 1:
            reasons.setdefault(block.unranked, []).append(block.title)
    everywhere = len(blocks) == sum(len(titles) for titles in reasons.values()) and len(reasons) == 1
    for reason, titles in reasons.items():
        where = "" if everywhere else f"In {'; in '.join(titles)}: "
        notes.append(f"{where}places are by score alone, without intervals, since {reason}.")
    return [note[0].upper() + note[1:] for note in notes]


def _tare_notes(rows: Sequence[Row]) -> list[str]:
    """Return one sentence on which recordings were tared, where some row's protocol is one that may."""
    held = sorted({f"{row['tare_s']:g} s" for row in rows if row.get("tare_s")})
    sentences = []
    if held:
        sentences.append(
            f"`deployable`: each recording is tared on its own unloaded hold before its press ({', '.join(held)})"
        )
    if any(row["protocol"] == "deployable-untared" and row["status"] == "done" for row in rows):
        sentences.append("`deployable-untared`: readings as they are")
    return [f"{'; '.join(sentences)}."] if sentences else []


def _vector_notes(rows: Sequence[Row]) -> list[str]:
    """Return the percentiles that stand beside mean errors of vectors."""
    named = _namer(rows)
    found = [
        f"{named(row)}/{answer_name(row)} {score(row['scores'][MEDIAN_ERROR], row['unit'])}, "
        f"{score(row['scores'][HIGH_ERROR], row['unit'])}{suffix(row['unit'])}"
        for row in rows
        if MEDIAN_ERROR in (row["scores"] or {}) and not row["is_baseline"]
    ]
    return [visible(f"Median and 95th percentile of the error over test rows: {'; '.join(found)}.")] if found else []


def _floor_notes(rows: Sequence[Row]) -> list[str]:
    """Return the floors of the references, once each, and what stands beyond them."""
    floors: dict[tuple[str, str], dict[float, None]] = {}
    named = _namer(rows)
    for row in rows:
        if row.get("reference_floor") is not None:
            floors.setdefault((named(row), str(row["unit"])), {})[row["reference_floor"]] = None
    sentences = []
    if floors:
        each = "; ".join(f"{where} {_floor(list(found), unit)}" for (where, unit), found in floors.items())
        sentences.append(
            f"Floor, the deviation of the reference in the unloaded hold of the tested recordings: {each}. Beyond "
            "floor is sqrt(max(0, RMSE² − floor²)) of each replicate; a smaller RMSE is below it by chance. Ranks go "
            "by it where all answers of a block have it."
        )
    return sentences


def _true_error_notes(rows: Sequence[Row]) -> list[str]:
    known = any(row.get("true_score") is not None for row in rows)
    return ["True error (SIM): against the force that the twin exerted, free of the reference's noise."] * known


def _floor(found: Sequence[float], unit: str) -> str:
    """Return a floor; of several campaigns the root of their mean square."""
    text = f"{score(math.sqrt(sum(one * one for one in found) / len(found)), unit)}{suffix(unit)}"
    return (
        text if len(found) == 1 else f"{text} (of {len(found)}: {score(min(found), unit)} … {score(max(found), unit)})"
    )


def interval_notes(rows: Sequence[Row]) -> list[str]:
    """Return one sentence a task and kind of interval; what is in brackets only where it is the same for all."""
    every = _splits(rows)
    kinds: dict[tuple[str, str], dict[str, None]] = {}
    splits: dict[tuple[str, str], dict[str, None]] = {}
    for row in rows:
        task, method = row["task"], row["ci_method"]
        if method and not row["is_baseline"]:
            sentence = visible(f"interval by {method}.")
            key = task, re.sub(r" \([^)]*\)", "", sentence)
            kinds.setdefault(key, {})[sentence] = None
            splits.setdefault(key, {})[str(row.get("split"))] = None
    return [
        f"{visible(task)}{_among(splits[task, short], every[task])}: {next(iter(texts)) if len(texts) == 1 else short}"
        for (task, short), texts in kinds.items()
    ]


def _splits(rows: Iterable[Row]) -> dict[str, dict[str, None]]:
    """Return the splits that each task was asked under."""
    found: dict[str, dict[str, None]] = {}
    for row in rows:
        found.setdefault(row["task"], {})[str(row.get("split"))] = None
    return found


def _among(splits: Collection[str], every: Collection[str]) -> str:
    """Return which splits are meant, if not all there are."""
    return "" if len(splits) == len(every) else visible(f" (split {', '.join(splits)})")


def _namer(rows: Sequence[Row]) -> Callable[[Row], str]:
    """Return what names sensor and task, with the split where the task was asked under several."""
    every = _splits(rows)
    return lambda row: question_name(row) + _among([str(row.get("split"))], every[row["task"]])


def _chosen_notes(rows: Sequence[Row]) -> list[str]:
    """Return one sentence for all answers that chose the same on validation data."""
    names: dict[str, dict[str, None]] = {}
    named = _namer(rows)
    for row in rows:
        if row["chosen"]:
            names.setdefault(visible(picked(row)), {})[f"{named(row)}/{answer_name(row)}"] = None
    return [f"{', '.join(who)}: chosen on validation data: {what}." for what, who in names.items()]


def picked(row: Row) -> str:
    """Return what an answer chose on validation data."""
    return ", ".join(_picked(str(key), value, row) for key, value in sorted(row["chosen"].items()))


def _picked(key: str, value: object, row: Row) -> str:
    """Return a chosen parameter: k of `window_grid` with its meaning, others by name."""
    name, _, fold = key.partition(" of fold ")
    where = f" of fold {fold}" if fold else ""
    if name == "threshold":
        return f"{name} = {_value_text(value)}{where} (of the score that {row['estimator']} gives a frame)"
    if name == "k":
        return f"k = {_value_text(value)} samples before the newest in the mean filter{where}"
    return f"{name.rstrip('_')} = {_value_text(value)}{where} (parameter of {row['estimator']})"


def _value_text(value: object) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _no_better_notes(rows: Sequence[Row]) -> list[str]:
    """Return one sentence a question and trivial answer on the answers that are not shown to be better than it."""
    names: dict[tuple[str, ...], dict[str, None]] = {}
    probed = {question_name(row) for row in rows if is_probe(row["protocol"])}
    best = best_trivials(rows)
    for row in rows:
        if row["status"] != "done" or row["is_baseline"] or is_probe(row["protocol"]):
            continue  # a probe should be no better than trivial
        trivial = best.get(comparison_key(row))
        bar = row["baseline"] if trivial is None else trivial["score"]
        shown = "" if bar is None else against_trivial(row, bar)
        if not shown:
            continue
        where = question_name(row)
        look = "" if where in probed else f": `{_probing(row)}`"
        key = (where, shown, _trivial_name(trivial), score(bar, row["unit"]) + suffix(row["unit"]), look)
        names.setdefault(key, {})[f"{answer_name(row)} ({row['protocol']}, split {row['split']})"] = None
    return [
        visible(
            f"{where}/{', '.join(who)} {_is_are(who)} {_SHOWN[shown]} than {trivial}, {value}; see how the recordings "
            f"differ before blaming the sensor{look}."
        )
        for (where, shown, trivial, value, look), who in names.items()
    ]


_SHOWN = {"no better": "no better", "not shown": "not shown to be better"}


def _is_are(who: Collection[str]) -> str:
    return "is" if len(who) == 1 else "are"


def _trivial_name(trivial: Row | None) -> str:
    if trivial is None:
        return "the trivial baseline"
    reads = ", which reads no sensor, only the time" if trivial.get("looks_at") == "time" else ""
    return f"the trivial {answer_name(trivial)}{reads}"


def _probing(row: Row) -> str:
    """Return the command that shows what the recordings of a row give away."""
    replayed = () if row["rig"] == "twin" else ("--rig", row["rig"], "--recordings", "DIR")
    return command_line("tactbench", "run", "--sensor", row["sensor"], "--task", row["task"], *replayed, "--probe")


def _other_knowledge_notes(rows: Sequence[Row]) -> list[str]:
    """Return which trivial answers knew more than readings tell."""
    names: dict[str, dict[str, None]] = {}
    named = _namer(rows)
    for row in rows:
        if row.get("looks_at") == "time" and row["is_baseline"] and row["status"] == "done":
            names.setdefault(answer_name(row), {})[f"{named(row)} {score(row['score'], row['unit'])}"] = None
    return [
        f"{who} looks at the time of a sample and at no reading: it knows that every recording is pressed alike. The "
        f"baseline column leaves it out where answers read the sensor: {', '.join(where)}."
        for who, where in names.items()
    ]


def _left_out_notes(rows: Sequence[Row]) -> list[str]:
    """Return what was left out of the data, and what their recordings remark; each once."""
    every = _splits(rows)
    counted: dict[tuple[str, str, str], dict[str, None]] = {}
    for row in rows:
        for count in count_texts(row["counts"] or {}):
            counted.setdefault((question_name(row), row["task"], count), {})[str(row.get("split"))] = None
    notes = [
        visible(f"{question}{_among(splits, every[task])}: {count}.")
        for (question, task, count), splits in counted.items()
    ]
    notes += [visible(f"{row['sensor']}: {remark}") for row in rows for remark in row["remarks"] or ()]
    return list(dict.fromkeys(notes))


def count_texts(counts: Mapping[str, int]) -> list[str]:
    """Return one text a reason, of a cell's counts."""
    sums: Counter[str] = Counter()
    beyond: Counter[str] = Counter()
    for what, count in counts.items():
        in_a_set = _SET.match(what)
        reason = in_a_set[2] if in_a_set else what
        sigma = _SIGMA.match(reason)
        if sigma:
            beyond[sigma[1]] += count
        else:
            sums[reason] += count
    texts = [f"{what}: {count}" for what, count in sums.items() if count]
    if beyond:
        listed = ", ".join(f"{channel} {count}" for channel, count in beyond.most_common(MOST_CHANNELS))
        more = len(beyond) - MOST_CHANNELS
        rest = f" and {more} more channels" if more > 0 else ""
        texts.append(f"rows beyond three sigma in {listed}{rest}")
    return texts


def _stopped_notes(rows: Sequence[Row], statuses: Collection[str]) -> list[str]:
    """Return one sentence for all cells that ended alike in one of `statuses`: which, why, how to look into it."""
    alike: dict[tuple[str, int | None, str], list[Row]] = {}
    for row in rows:
        if row["status"] in statuses and row["status"] != "done":
            alike.setdefault((row["status"], row["signal"], row["reason"]), []).append(row)
    return [_stopped_note(status, signal, reason, members) for (status, signal, reason), members in alike.items()]


def _stopped_note(status: str, signal: int | None, reason: str, members: list[Row]) -> str:
    names = list(dict.fromkeys(f"{question_name(row)}/{answer_or_probe(row)}" for row in members))
    more = len(names) - MOST_NAMES
    listed = ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
    by = f" by signal {signal}" if signal is not None else ""
    why = cut(visible(reason), LONGEST_REASON)
    sentence = f"{listed} {visible(status)}{by}: {why}"
    if status not in STOPPED:
        return sentence
    end = "" if sentence.endswith((".", "!", "?", "…")) else "."
    return f"{sentence}{end} Look into it: {command_line('tactbench', 'why', members[0]['cell'])}"


def _mark_notes(rows: Sequence[Row]) -> list[str]:
    """Return what the marks behind scores mean: ‡ and †, each once."""
    stamps = dict.fromkeys(chain.from_iterable(row["stamps"] or () for row in rows))
    return [
        *(f"‡ {visible(str(stamp))}" for stamp in stamps),
        *([DAGGER] if any(row["dagger"] for row in rows) else []),
    ]


def _simulation_notes(rows: Sequence[Row]) -> list[str]:
    """Return what SIM and EMULATED mean, and what the simulations assumed."""
    simulated = [row for row in rows if row["simulated"]]
    emulated = [row for row in rows if row.get("emulated")]
    marks = ["SIM: simulated by the twin"] if any(not row.get("emulated") for row in simulated) else []
    marks += ["EMULATED: read through the drivers from emulated devices that the twin moved"] if emulated else []
    assumptions = dict.fromkeys(_assumptions(row["assumptions"]) for row in simulated)
    return [f"{'; '.join(marks)}; never ranked against hardware. Assumed: {one}." for one in assumptions]


def _assumptions(assumptions: Mapping[str, Any]) -> str:
    text = ", ".join(f"{key} {value}" for key, value in sorted(assumptions.items()))
    return visible(text) or "see docs/twin.md"
