"""Whether a cheap answer stands for the dear one: same order of draws, same winners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tactbench.core.calibration.draw import Draw, output_values
from tactbench.core.calibration.findings import Share, holds, share
from tactbench.core.spec.calibration import CalibrationSpec


class Agreement(NamedTuple):
    """One output beside the dearer one it stands for."""

    output: str
    dear: str
    n: int
    rank_correlation: float | None
    """Spearman's, over the draws that have both; None of fewer than three draws or where one never changes."""
    mean_difference: float
    """Cheap less dear."""
    largest_difference: float


class SameVerdict(NamedTuple):
    """In which share of the draws a finding is answered alike by cheap and dear outputs."""

    finding: str
    alike: Share


def agreements(spec: CalibrationSpec, draws: Sequence[Draw]) -> list[Agreement]:
    """Return every pair of outputs of which one stands for the other, over the draws that have both."""
    from scipy.stats import spearmanr

    found = []
    for output in spec.outputs:
        if output.stands_for is None:
            continue
        cheap, dear = output_values(draws, output.stands_for), output_values(draws, output.name)
        both = ~(np.isnan(cheap) | np.isnan(dear))
        cheap, dear = cheap[both], dear[both]
        if not cheap.size:
            continue
        moves = cheap.size >= 3 and np.ptp(cheap) > 0 and np.ptp(dear) > 0
        rank = float(spearmanr(cheap, dear).statistic) if moves else None
        off = cheap - dear
        found.append(
            Agreement(output.stands_for, output.name, int(cheap.size), rank, float(off.mean()),
                      float(np.abs(off).max()))
        )  # fmt: skip
    return found


def same_verdicts(spec: CalibrationSpec, draws: Sequence[Draw]) -> list[SameVerdict]:
    """Return how often each finding that dear outputs can answer is answered as by the cheap ones."""
    dear = {output.stands_for: output.name for output in spec.outputs if output.stands_for is not None}
    found = []
    for finding in spec.findings:
        names = {name for one in finding.all_of for name in (one.above, one.below)}
        if not names <= set(dear):
            continue
        pairs = [(holds(finding, draw.outputs), holds(finding, _instead(draw, dear))) for draw in draws]
        alike = [cheap == instead for cheap, instead in pairs if cheap is not None and instead is not None]
        found.append(SameVerdict(finding.name, share(sum(alike), len(alike))))
    return found


def _instead(draw: Draw, dear: Mapping[str, str]) -> dict[str, float]:
    return {cheap: draw.outputs[name] for cheap, name in dear.items() if name in draw.outputs}
