"""What a calibration has found out, as far as a report needs to know it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from tactbench.core.calibration.ranges import LEVEL
from tactbench.core.calibration.result import CalibrationResult, load_result
from tactbench.core.calibration.summary import Summary, acceptance, records, summary
from tactbench.core.calibration.tables import text_tables
from tactbench.core.tables.text_table import TextTable

MOST_NAMED = 2
"""So many nuisances are named beside a number, those it goes with most first."""


@dataclass(frozen=True)
class PredictiveRange:
    """Where the simulated twin can put one published number, over everything it cannot know."""

    task: str
    sensor: str
    published: float
    """The published number that it was held against; tells two of one task apart."""
    low: float
    high: float
    level: float
    """Share of the draws inside: 0.8."""
    use: str
    """``fitted``: the number chose the draws. ``held out``: it did not, and the range is a prediction."""
    goes_with: Mapping[str, float] = field(default_factory=dict)
    """Partial rank correlation over the prior by nuisance, where its 95 % interval leaves out 0; the largest first."""


class Share(NamedTuple):
    """In how many draws something is true, and the 95 % interval of that."""

    share: float
    low: float
    high: float
    draws: int


@dataclass(frozen=True)
class Finding:
    """How often a sentence of a publication comes out true."""

    statement: str
    prior: Share | None
    """Over everything that is not known; None: no draw has an answer."""
    accepted: Share | None
    """Over the draws that come near the fitted numbers."""
    reference: str = ""
    reason: str = ""
    """Why its predicate says what the sentence says."""


@dataclass(frozen=True)
class Calibrated:
    """A calibration, for a report."""

    ranges: tuple[PredictiveRange, ...] = ()
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    """Whose calibration it is, how many draws, which were accepted."""
    tables: tuple[TextTable, ...] = ()
    """What else the calibration says, as it says it."""
    sensitivity: Callable[[], Any] | None = None
    """Draws what decides the numbers: a matplotlib figure."""

    def range_for(self, task: str, sensor: str, published: float) -> PredictiveRange | None:
        """Return the range of a published number as one sensor's row stands beside it, or None."""
        found = (one for one in self.ranges if (one.task, one.sensor, one.published) == (task, sensor, published))
        return next(found, None)


def load_calibrated(results: Path) -> Calibrated | None:
    """Return the calibration of a result folder, else the one that came with tactbench, else None.

    Raises
    ------
    FormatError
        If its files are there but damaged.
    """
    result = load_result(results)
    if result is None:
        return None
    found_summary = summary(result)
    notes = (f"Read off {result.shown}.", acceptance(result.spec, found_summary))
    found = calibrated_from(result.spec.model_dump(mode="json"), records(found_summary), notes, LEVEL)
    # Findings stand in a table of their own, with who states them.
    tables = tuple(table for table in text_tables(result, found_summary) if table.columns[0] != "finding")
    return replace(found, tables=tables, sensitivity=lambda: _sensitivity(result, found_summary))


def _sensitivity(result: CalibrationResult, found_summary: Summary) -> Any:
    from tactbench.core.calibration.figure import sensitivity_figure

    return sensitivity_figure(result.spec, found_summary.sensitivities)


def calibrated_from(
    procedure: Mapping[str, Any], tables: Mapping[str, Sequence[Mapping[str, Any]]], notes: Sequence[str], level: float
) -> Calibrated:
    """Return a calibration from its plain records.

    Parameters
    ----------
    procedure
        With ``outputs`` (name, task, sensor).
    tables
        Records called ``published``, ``sensitivity`` and ``findings``; ranges are ``prior_low``, ``accepted_high`` …,
        None where there are too few draws.
    notes
        Sentences to print below.
    level
        Share of the draws inside a range.
    """
    outputs = {one["name"]: one for one in procedure["outputs"]}
    ranges = []
    for one in tables["published"]:
        output = outputs[one["output"]]
        if one["accepted_low"] is not None:
            ranges.append(
                PredictiveRange(
                    task=output["task"],
                    sensor=output["sensor"],
                    published=one["published"],
                    low=one["accepted_low"],
                    high=one["accepted_high"],
                    level=level,
                    use=one["use"],
                    goes_with=_goes_with(tables["sensitivity"], one["output"]),
                )
            )
    findings = tuple(
        Finding(one["statement"], _share(one, "prior"), _share(one, "accepted"), one["reference"], one["reason"])
        for one in tables["findings"]
    )
    return Calibrated(tuple(ranges), findings, tuple(notes))


def _goes_with(sensitivity: Sequence[Mapping[str, Any]], output: str) -> dict[str, float]:
    """Return the nuisances that an output goes with beyond chance, those it goes with most."""
    apart = [one for one in sensitivity if one["output"] == output and (one["low"] > 0 or one["high"] < 0)]
    largest = sorted(apart, key=lambda one: -abs(one["correlation"]))[:MOST_NAMED]
    return {one["parameter"]: one["correlation"] for one in largest}


def _share(one: Mapping[str, Any], name: str) -> Share | None:
    if one[f"{name}_share"] is None:
        return None
    return Share(one[f"{name}_share"], one[f"{name}_low"], one[f"{name}_high"], one[f"{name}_n"])
