"""Every published number of the tasks beside ours, and in one sentence how the two compare."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from tactbench.core.leaderboard.columns import row_interval as row_interval
from tactbench.core.leaderboard.names import LOWER_IS_BETTER
from tactbench.core.plugins.registry import Registry
from tactbench.core.report.calibrated import Calibrated, PredictiveRange
from tactbench.core.spec.task import Published, TaskSpec
from tactbench.core.statistics.median import counted, percent
from tactbench.core.tables.numbers import interval, score, suffix
from tactbench.core.tables.text import command_line

Row = Mapping[str, Any]
Verdict = Literal["inside", "outside", "no interval", "no answer"]


@dataclass(frozen=True)
class Reproduction:
    """One published number, one of our rows beside it."""

    title: str
    task: str
    protocol: str
    estimator: str
    sensor: str
    published: float
    reference: str
    remark: str
    unit: str
    row: Row | None
    """What stands beside it; None: nothing has been run."""
    predicted: PredictiveRange | None
    verdict: Verdict
    """`inside`: the published number lies in the interval of our score; `no interval`: too few replicates have one."""
    sentence: str


def reproduce(registry: Registry, rows: Sequence[Row], calibrated: Calibrated | None = None) -> list[Reproduction]:
    """Return a line for each published number of each task, and each row that it may stand beside.

    A number without any row gets one line that names the command to run, unless it takes recordings made elsewhere
    (see `unasked`). Tasks come in the order of the rows.
    """
    lines: list[Reproduction] = []
    task_names = list(dict.fromkeys(row["task"] for row in rows))
    known = {descriptor.name: descriptor.spec for descriptor in registry.tasks}
    for name in sorted(known, key=lambda name: task_names.index(name) if name in task_names else len(task_names)):
        task = known[name]
        for published in task.published:
            beside = [row for row in rows if stands_beside(row, task, published)]
            lines += [_line(task, published, row, calibrated) for row in beside]
            if not beside and not _needs_recordings(task, published, registry):
                lines.append(_unanswered(task, published, registry))
    return lines


def unasked(registry: Registry, rows: Sequence[Row]) -> list[str]:
    """Return a sentence for each published number that only recordings made elsewhere can stand beside."""
    return [
        f"Not asked here: {_title(task, published, None)} ({score(published.score, task.unit)}{suffix(task.unit)}; "
        f"{published.reference}): `{_command(task, published, registry)}`."
        for task in (descriptor.spec for descriptor in registry.tasks)
        for published in task.published
        if _needs_recordings(task, published, registry) and not any(stands_beside(row, task, published) for row in rows)
    ]


def _needs_recordings(task: TaskSpec, published: Published, registry: Registry) -> bool:
    sensor = published.sensor
    unknown = sensor is not None and (sensor not in registry.sensors or registry.sensors[sensor].transducer is None)
    return unknown or not task.scenes


def stands_beside(row: Row, task: TaskSpec, published: Published) -> bool:
    """Tell whether `row` may be compared with a published number: as the row itself says it may."""
    if row["task"] != task.name or row["params"] or (published.estimator is None and row["is_baseline"]):
        return False
    return task.published_for(row["sensor"], row["protocol"], row["estimator"], row["split"]) == published


def verdict(row: Row, published: float, predicted: PredictiveRange | None) -> tuple[Verdict, str]:
    """Return how a row compares with a published number, and one sentence that says so.

    Parameters
    ----------
    row
        A row of any status.
    published
        In the unit of the row's metric.
    predicted
        Where the calibrated twin can put this number; None if nobody has looked.
    """
    if row["status"] != "done":
        return "no answer", f"{row['status']}: {row['reason']}"
    if row["ci_low"] is None or row["ci_high"] is None:
        few = f"{_replicates(row)}: too few for an interval, so whether it is reproduced cannot be said"
        return "no interval", f"{few}; {_difference(row, published)}"
    if row["ci_low"] <= published <= row["ci_high"]:
        sentence = f"inside: the published lies in our {_level(row)} interval{_over(row)}"
        if predicted is not None and not predicted.low <= published <= predicted.high:
            sentence += f"; but {_of_calibration(predicted, published, row['unit'])}"
        return "inside", sentence
    end = "below" if published < row["ci_low"] else "above"
    parts = [
        f"outside: {_difference(row, published)}, and the published lies {end} our {_level(row)} interval{_over(row)}"
    ]
    if row.get("replicate_unit") != "replicate":
        parts.append(f"the interval is by {_without_brackets(row['ci_method'])}")
    if predicted is not None:
        parts.append(_of_calibration(predicted, published, row["unit"]))
    elif row["simulated"]:
        parts.append("what the twin cannot know may account for it or not: `tactbench calibrate` tells")
    return "outside", "; ".join(parts)


def _replicates(row: Row) -> str:
    n, unit = int(row.get("n_replicates") or 1), str(row.get("replicate_unit") or "replicate")
    return f"one {unit}" if n == 1 else counted(n, unit)


def _level(row: Row) -> str:
    return percent(row.get("n_replicates"), row.get("replicate_unit"))


def _over(row: Row) -> str:
    return f" over {_replicates(row)}" if row.get("n_replicates") else ""


def _difference(row: Row, published: float) -> str:
    ours, unit = row["score"], row["unit"]
    by = abs(ours - published)
    if by == 0:
        return "ours is the published"
    share = f" ({100 * by / abs(published):.1f} %)" if published else ""
    better = (ours < published) == (row["metric"] in LOWER_IS_BETTER)
    where = "below" if ours < published else "above"
    return f"ours is {score(by, unit)}{suffix(unit)}{share} {where} the published, which is {_word(better)}"


def _word(better: bool) -> str:
    return "better" if better else "worse"


def _of_calibration(predicted: PredictiveRange, published: float, unit: str) -> str:
    inside = predicted.low <= published <= predicted.high
    sentence = f"the published lies {'inside' if inside else 'outside'} the calibrated range ({predicted.use})"
    if not inside:
        edge = predicted.low if published < predicted.low else predicted.high
        sentence += f" by {score(abs(published - edge), unit)}{suffix(unit)}"
    if predicted.goes_with:
        named = " and ".join(f"{name} ({value:+.2f})" for name, value in predicted.goes_with.items())
        sentence += f"; of what is not known the number goes most with {named}"
    return sentence


def _without_brackets(text: str) -> str:
    return re.sub(r" \([^)]*\)", "", text)


def _line(task: TaskSpec, published: Published, row: Row, calibrated: Calibrated | None) -> Reproduction:
    predicted = None
    if calibrated is not None:
        predicted = calibrated.range_for(task.name, row["sensor"], published.score)
    word, sentence = verdict(row, published.score, predicted)
    return _beside(task, published, row, predicted, word, sentence)


def _unanswered(task: TaskSpec, published: Published, registry: Registry) -> Reproduction:
    return _beside(task, published, None, None, "no answer", f"not run: `{_command(task, published, registry)}`")


def _beside(
    task: TaskSpec,
    published: Published,
    row: Row | None,
    predicted: PredictiveRange | None,
    word: Verdict,
    sentence: str,
) -> Reproduction:
    return Reproduction(
        title=_title(task, published, row["sensor"] if row else None),
        task=task.name,
        protocol=published.protocol,
        estimator=row["estimator"] if row else published.estimator or "",
        sensor=row["sensor"] if row else published.sensor or "",
        published=published.score,
        reference=published.reference,
        remark=published.remark,
        unit=task.unit,
        row=row,
        predicted=predicted,
        verdict=word,
        sentence=sentence,
    )


def _title(task: TaskSpec, published: Published, sensor: str | None) -> str:
    title = published.title or f"{task.name}, {task.metric}"
    return f"{title} ({sensor})" if published.sensor is None and sensor else title


def _command(task: TaskSpec, published: Published, registry: Registry) -> str:
    """Return what to type for a row that the number may stand beside."""
    sensor = published.sensor
    words = ["tactbench", "run", *(["--sensor", sensor] if sensor else []), "--task", task.name]
    words += ["--protocol", published.protocol]
    if published.split:
        words += ["--split", published.split]
    trivial = published.estimator in task.baselines  # run with any other
    if published.estimator and not trivial:
        words += ["--estimator", published.estimator]
    if _needs_recordings(task, published, registry):
        words += ["--rig", "replay", "--recordings", "DIR"]
    return command_line(*words)


def records(lines: Iterable[Reproduction]) -> list[dict[str, Any]]:
    """Return the lines for programs: flat, the same keys in each."""
    return [
        {
            "title": line.title,
            "task": line.task,
            "sensor": line.sensor,
            "protocol": line.protocol,
            "estimator": line.estimator,
            "unit": line.unit,
            "published": line.published,
            "reference": line.reference,
            "remark": line.remark,
            "cell": line.row["cell"] if line.row else None,
            "simulated": bool(line.row["simulated"]) if line.row else None,
            "score": line.row["score"] if line.row else None,
            "ci_low": line.row["ci_low"] if line.row else None,
            "ci_high": line.row["ci_high"] if line.row else None,
            "predicted_low": line.predicted.low if line.predicted else None,
            "predicted_high": line.predicted.high if line.predicted else None,
            "predicted_level": line.predicted.level if line.predicted else None,
            "predicted_use": line.predicted.use if line.predicted else None,
            "verdict": line.verdict,
            "sentence": line.sentence,
        }
        for line in lines
    ]


def interval_text(line: Reproduction) -> str:
    """Return the interval of our score as text."""
    return row_interval(line.row) if line.row is not None and line.row["status"] == "done" else "–"


def range_text(line: Reproduction) -> str:
    """Return the calibrated range as text: bounds, share of the draws, fitted or held out."""
    one = line.predicted
    if one is None:
        return "–"
    return f"{interval(one.low, one.high, line.unit)} ({one.level:.0%}, {one.use})"
