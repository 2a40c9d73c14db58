"""How often a finding of the publication comes out, over the prior and over the accepted draws."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from tactbench.core.calibration.acceptance import by_fitted
from tactbench.core.calibration.draw import Draw
from tactbench.core.spec.calibration import CalibrationSpec, Finding

LEVEL = 0.95


class Share(NamedTuple):
    """How many of how many, and Wilson's interval of the share."""

    hits: int
    n: int
    low: float
    high: float

    @property
    def share(self) -> float | None:
        """Hits by draws; None without any."""
        return self.hits / self.n if self.n else None


class FindingFrequency(NamedTuple):
    """One finding, and in which share of the draws it is true."""

    name: str
    statement: str
    reason: str
    reference: str
    prior: Share
    accepted: Share


def share(hits: int, n: int) -> Share:
    """Return a share with its 95 % interval by Wilson 1927; without draws it reaches from 0 to 1."""
    if not n:
        return Share(0, 0, 0.0, 1.0)
    from scipy.stats import binomtest

    interval = binomtest(hits, n).proportion_ci(confidence_level=LEVEL, method="wilson")
    return Share(hits, n, float(interval.low), float(interval.high))


def holds(finding: Finding, outputs: Mapping[str, float]) -> bool | None:
    """Return whether a finding is true of one draw's outputs; None where one of them is missing."""
    verdicts = []
    for comparison in finding.all_of:
        above, below = outputs.get(comparison.above, math.nan), outputs.get(comparison.below, math.nan)
        if math.isnan(above) or math.isnan(below):
            return None
        verdicts.append(above - below > comparison.margin)
    return all(verdicts)


def findings(spec: CalibrationSpec, draws: Sequence[Draw]) -> list[FindingFrequency]:
    """Return every finding's frequency over the finished `draws` and over those accepted by the fitted numbers."""
    kept = by_fitted(spec, draws).draws
    return [
        FindingFrequency(
            one.name, one.statement, one.reason, one.source.reference, _over(draws, one), _over(kept, one)
        )
        for one in spec.findings
    ]  # fmt: skip


def _over(draws: Sequence[Draw], finding: Finding) -> Share:
    verdicts = [verdict for draw in draws if (verdict := holds(finding, draw.outputs)) is not None]
    return share(sum(verdicts), len(verdicts))
