"""Approximate Bayesian computation by rejection: draws whose numbers lie near the published ones.

Pritchard et al. 1999, Population growth of human Y chromosomes, Mol. Biol. Evol. 16: simulate from the prior, keep what
comes near. The distance here is the largest difference of a fitted number in units of its scale, so that a tolerance
reads as it stands: every fitted number within so many scales.
"""

from __future__ import annotations

from collections.abc import Sequence

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


def accepted(draws: Sequence[Draw], targets: Sequence[PublishedNumber], tolerance: float) -> list[Draw]:
    """Return the draws within `tolerance` of all targets."""
    near = distances(draws, targets) <= tolerance
    return [draw for draw, kept in zip(draws, near, strict=True) if kept]
