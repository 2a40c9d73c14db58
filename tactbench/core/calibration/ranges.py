"""Ranges of parameters before and after, and of published numbers as predicted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactbench.core.calibration.acceptance import accept, by_fitted
from tactbench.core.calibration.draw import Draw, finished, output_values, parameter_values
from tactbench.core.samples import FloatArray
from tactbench.core.spec.calibration import CalibrationSpec, Fixed, PublishedNumber

LEVEL = 0.8
FEWEST = 10
"""With fewer draws the 10 % and 90 % quantiles are hardly more than the ends."""


class Range(NamedTuple):
    """Median and middle 80 %."""

    n: int
    median: float
    low: float
    high: float


class ParameterRange(NamedTuple):
    """What the published numbers say about one nuisance."""

    name: str
    sets: str
    unit: str
    before: Range | None
    after: Range | None
    """Over the accepted draws; None: too few were accepted."""


class Predicted(NamedTuple):
    """One published number and where draws lie."""

    output: str
    title: str
    unit: str
    published: float
    use: str
    before: Range | None
    after: Range | None
    """Over the draws accepted by the fitted numbers."""
    left_out: Range | None
    """Over the draws accepted by all other published numbers: what those predict for this one."""
    left_out_reach: float
    """How far those draws are from the others, in scales."""

    @property
    def inside(self) -> bool | None:
        """Whether the published number lies in the range after; None: there is no range."""
        return None if self.after is None else self.after.low <= self.published <= self.after.high

    @property
    def inside_left_out(self) -> bool | None:
        """Whether it lies in what all others predict; None: there is no range."""
        return None if self.left_out is None else self.left_out.low <= self.published <= self.left_out.high


def range_of(values: FloatArray) -> Range | None:
    """Return median and middle 80 % of (n,) values, NaN left out; None of fewer than ten."""
    there = values[~np.isnan(values)]
    if there.size < FEWEST:
        return None
    low, median, high = np.quantile(there, [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2])
    return Range(int(there.size), float(median), float(low), float(high))


def parameter_ranges(spec: CalibrationSpec, draws: Sequence[Draw]) -> list[ParameterRange]:
    """Return the ranges of every nuisance that is not fixed, over all finished `draws` and over the accepted ones."""
    kept = by_fitted(spec, draws).draws
    return [
        ParameterRange(
            one.name, one.sets, one.unit,
            range_of(parameter_values(draws, one.name)), range_of(parameter_values(kept, one.name)),
        )
        for one in spec.nuisances if not isinstance(one.prior, Fixed)
    ]  # fmt: skip


def predictions(spec: CalibrationSpec, draws: Sequence[Draw]) -> list[Predicted]:
    """Return what the draws predict for every published number."""
    kept = by_fitted(spec, draws).draws
    return [_predicted(spec, draws, kept, one) for one in spec.published]


def _predicted(spec: CalibrationSpec, draws: Sequence[Draw], kept: Sequence[Draw], one: PublishedNumber) -> Predicted:
    all_others = [other for other in spec.published if other is not one]
    others = accept(draws, all_others, spec.tolerance, spec.at_least)
    output = spec.output(one.output)
    before, after, left_out = (range_of(output_values(some, one.output)) for some in (draws, kept, others.draws))
    return Predicted(one.output, output.title, output.unit, one.value, one.use, before, after, left_out, others.reach)


def median_and_ends(draws: Sequence[Draw], output: str) -> tuple[float, float, float] | None:
    """Return median, least and largest of an output over the draws that have it; None if none has."""
    values = output_values(finished(draws), output)
    values = values[np.isfinite(values)]
    return (float(np.median(values)), float(values.min()), float(values.max())) if values.size else None
