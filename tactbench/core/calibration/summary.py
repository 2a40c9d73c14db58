"""Everything read off a finished calibration, as plain records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tactbench.core.calibration.acceptance import accept, by_fitted
from tactbench.core.calibration.agreement import Agreement, SameVerdict, agreements, same_verdicts
from tactbench.core.calibration.draw import Draw, finished
from tactbench.core.calibration.findings import FindingFrequency, Share, findings
from tactbench.core.calibration.ranges import ParameterRange, Predicted, Range, parameter_ranges, predictions
from tactbench.core.calibration.result import CalibrationResult
from tactbench.core.calibration.sensitivity import Sensitivity, sensitivities
from tactbench.core.spec.calibration import CalibrationSpec


@dataclass(frozen=True)
class Summary:
    """What a calibration says."""

    draws: tuple[Draw, ...]
    """Those carried out."""
    failed: int
    n_accepted: int
    """By the fitted numbers."""
    n_near: int
    """Those of them within the tolerance."""
    reach: float
    """The largest distance of an accepted draw [scales]."""
    n_all: int
    """Near all published numbers at once."""
    parameters: tuple[ParameterRange, ...]
    predictions: tuple[Predicted, ...]
    findings: tuple[FindingFrequency, ...]
    sensitivities: tuple[Sensitivity, ...]
    agreements: tuple[Agreement, ...]
    verdicts: tuple[SameVerdict, ...]


def summary(result: CalibrationResult, *, sensitivity: bool = True) -> Summary:
    """Return everything; the bootstrap of sensitivities is seeded with the result's own seed.

    Parameters
    ----------
    sensitivity
        Whether to compute sensitivities: by far the slowest part.
    """
    spec, draws = result.spec, finished(result.draws)
    kept = by_fitted(spec, draws)
    rng = np.random.default_rng(np.random.SeedSequence([result.seed, 0x5E]))
    return Summary(
        draws=tuple(draws),
        failed=len(result.draws) - len(draws),
        n_accepted=len(kept.draws),
        n_near=kept.near,
        reach=kept.reach,
        n_all=accept(draws, spec.published, spec.tolerance, 0).near,
        parameters=tuple(parameter_ranges(spec, draws)),
        predictions=tuple(predictions(spec, draws)),
        findings=tuple(findings(spec, draws)),
        sensitivities=tuple(sensitivities(spec, draws, rng)) if sensitivity else (),
        agreements=tuple(agreements(spec, draws)),
        verdicts=tuple(same_verdicts(spec, draws)),
    )


def acceptance(spec: CalibrationSpec, stats: Summary) -> str:
    """Return how the accepted draws were chosen and how near they are, in two sentences."""
    near = f"{stats.n_near} of {len(stats.draws)} draws lie within {spec.tolerance:g} scales of every fitted number"
    chosen = "they are accepted" if stats.n_accepted == stats.n_near else f"the {stats.n_accepted} nearest are accepted"
    return (
        f"{near}; {chosen} and reach {stats.reach:.1f} scales. Within {spec.tolerance:g} scales of all "
        f"{len(spec.published)} published numbers at once: {stats.n_all}."
    )


def records(stats: Summary) -> dict[str, list[dict[str, Any]]]:
    """Return the tables of a summary as flat records, by name of the table."""
    return {
        "parameters": [
            {"name": one.name, "sets": one.sets, "unit": one.unit, **_range(one.before, "prior"),
             **_range(one.after, "accepted")}
            for one in stats.parameters
        ],
        "published": [
            {"output": one.output, "title": one.title, "unit": one.unit, "use": one.use, "published": one.published,
             **_range(one.before, "prior"), **_range(one.after, "accepted"), "inside": one.inside,
             **_range(one.left_out, "by_all_others"), "by_all_others_reach": one.left_out_reach,
             "inside_by_all_others": one.inside_left_out}
            for one in stats.predictions
        ],
        "findings": [
            {"name": one.name, "statement": one.statement, "reason": one.reason, "reference": one.reference,
             **_share(one.prior, "prior"), **_share(one.accepted, "accepted")}
            for one in stats.findings
        ],
        "sensitivity": [one._asdict() for one in stats.sensitivities],
        "agreement": [one._asdict() for one in stats.agreements],
        "same_verdict": [{"finding": one.finding, **_share(one.alike, "alike")} for one in stats.verdicts],
    }  # fmt: skip


def _range(one: Range | None, name: str) -> dict[str, Any]:
    values = (None, None, None, None) if one is None else one
    return dict(zip((f"{name}_n", f"{name}_median", f"{name}_low", f"{name}_high"), values, strict=True))


def _share(one: Share, name: str) -> dict[str, Any]:
    return {
        f"{name}_share": one.share, f"{name}_low": one.low, f"{name}_high": one.high, f"{name}_n": one.n,
    }  # fmt: skip
