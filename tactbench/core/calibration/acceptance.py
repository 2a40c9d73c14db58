"""Approximate Bayesian computation by rejection: draws whose numbers lie near the published ones.

Pritchard et al. 1999, Population growth of human Y chromosomes, Mol. Biol. Evol. 16: simulate from the prior, keep what
comes near. The distance here is the largest difference of a fitted number in units of its scale, so that a tolerance
reads as it stands: every fitted number within so many scales. Where too few draws are that near, the nearest ones are
taken, and their reach (their largest distance) stands beside everything that is read off them: a reach above the
tolerance says that the prior hardly holds what was published.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactbench.core.calibration.draw import Draw, output_values
from tactbench.core.samples import FloatArray
from tactbench.core.spec.calibration import CalibrationSpec, PublishedNumber


def fitted(spec: CalibrationSpec) -> tuple[PublishedNumber, ...]:
    """Return the published numbers that decide what is accepted."""
    return tuple(one for one in spec.published if one.use == "fitted")


def distances(draws: Sequence[Draw], targets: Sequence[PublishedNumber]) -> FloatArray:
    """Return (n,) distances of draws from the targets; infinite where a draw lacks one of their outputs."""
    away = [np.abs(output_values(draws, one.output) - one.value) / one.scale for one in targets]
    largest = np.max(away, axis=0, initial=0.0) if away else np.zeros(len(draws))
    return np.asarray(np.where(np.isnan(largest), np.inf, largest))


class Accepted(NamedTuple):
    """The draws that count, and how near they are."""

    draws: tuple[Draw, ...]
    near: int
    """How many draws lie within the tolerance."""
    reach: float
    """The largest distance of an accepted draw [scales]; 0 without any."""


def accept(draws: Sequence[Draw], targets: Sequence[PublishedNumber], tolerance: float, at_least: int) -> Accepted:
    """Return the draws within `tolerance` of all targets, or the `at_least` nearest where fewer are."""
    away = distances(draws, targets)
    near = int(np.sum(away <= tolerance))
    comparable = int(np.sum(np.isfinite(away)))
    number = min(max(near, at_least), comparable)
    places = sorted(np.argsort(away, kind="stable")[:number].tolist())
    return Accepted(tuple(draws[place] for place in places), near, float(max(away[places], default=0.0)))


def by_fitted(spec: CalibrationSpec, draws: Sequence[Draw]) -> Accepted:
    """Return the draws that the procedure's fitted numbers accept."""
    return accept(draws, fitted(spec), spec.tolerance, spec.at_least)
