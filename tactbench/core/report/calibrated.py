"""What a calibration has found out, as far as a report needs to know it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from tactbench.core.calibration.ranges import LEVEL
from tactbench.core.calibration.result import load_result
from tactbench.core.calibration.summary import acceptance, records, summary
from tactbench.core.calibration.tables import text_tables
from tactbench.core.report.plain import PlainTable, plain

NARROWER = 0.8
"""A nuisance is asked for if the accepted draws leave less than this share of its prior's range; a range of few draws
differs from the prior's by a tenth or two by chance alone."""
MOST_ASKED = 3
"""So many nuisances are named, the narrowest first."""


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
    asks: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By nuisance, with its unit: where the draws lie that the fitted numbers chose."""


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
    tables: tuple[PlainTable, ...] = ()
    """What else the calibration says, as it says it."""

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
    told = summary(result)
    notes = (f"Read off {result.shown}.", acceptance(result.spec, told))
    found = calibrated_from(result.spec.model_dump(mode="json"), records(told), notes, LEVEL)
    tables = tuple(
        plain(one.title, one.columns, [[row.get(name, "") for name in one.columns] for row in one.rows],
              numeric=one.numeric, notes=one.below)
        for one in text_tables(result, told)
        if one.columns[0] != "finding"  # those stand in a table of their own, with who states them
    )  # fmt: skip
    return replace(found, tables=tables)


def calibrated_from(
    procedure: Mapping[str, Any], tables: Mapping[str, Sequence[Mapping[str, Any]]], notes: Sequence[str], level: float
) -> Calibrated:
    """Return a calibration from its plain records.

    Parameters
    ----------
    procedure
        With ``outputs`` (name, task, sensor) and ``nuisances`` (name, sensors, prior).
    tables
        Records called ``published``, ``parameters`` and ``findings``; ranges are ``prior_low``, ``accepted_high`` …,
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
                    asks=_asked(procedure["nuisances"], tables["parameters"], output["sensor"]),
                )
            )
    findings = tuple(
        Finding(one["statement"], _share(one, "prior"), _share(one, "accepted"), one["reference"], one["reason"])
        for one in tables["findings"]
    )
    return Calibrated(tuple(ranges), findings, tuple(notes))


def _asked(
    nuisances: Sequence[Mapping[str, Any]], parameters: Sequence[Mapping[str, Any]], sensor: str
) -> dict[str, tuple[float, float]]:
    """Return the nuisances of a sensor that the accepted draws say most about."""
    own = {one["name"]: one["prior"]["kind"] for one in nuisances if not one["sensors"] or sensor in one["sensors"]}
    left: list[tuple[float, str, tuple[float, float]]] = []
    for one in parameters:
        if one["name"] in own and one["prior_low"] is not None and one["accepted_low"] is not None:
            scale = math.log if own[one["name"]] == "log-uniform" else float
            before = scale(one["prior_high"]) - scale(one["prior_low"])
            after = scale(one["accepted_high"]) - scale(one["accepted_low"])
            name = one["name"] if one["unit"] == "1" else f"{one['name']} [{one['unit']}]"
            if before > 0 and after < NARROWER * before:
                left.append((after / before, name, (one["accepted_low"], one["accepted_high"])))
    return {name: bounds for _, name, bounds in sorted(left)[:MOST_ASKED]}


def _share(one: Mapping[str, Any], name: str) -> Share | None:
    if one[f"{name}_share"] is None:
        return None
    return Share(one[f"{name}_share"], one[f"{name}_low"], one[f"{name}_high"], one[f"{name}_n"])
