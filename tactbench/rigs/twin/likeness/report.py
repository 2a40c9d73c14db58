"""The report: a sensor's real figures as checks, answered by the twin or by recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

from tactbench.plugin import ChannelKind, NotApplicable, SensorDescriptor, UsageError
from tactbench.plugin.simulation import Check, RealFigure, Verdict
from tactbench.rigs.twin.likeness import recorded, scenes
from tactbench.rigs.twin.likeness.evidence import Evidence
from tactbench.rigs.twin.likeness.named import take

NEEDS: Mapping[str, ChannelKind] = {
    "pressure-rest": "dc_pressure",
    "pressure-noise": "dc_pressure",
    "vibration-rms": "ac_pressure",
}
"""Channels beside taxels that a statistic at rest is taken from."""
Source = Callable[[str], Evidence]


def checks(sensor: SensorDescriptor, recordings: Path | None = None) -> Sequence[Check]:
    """Return one check for each figure the sensor declares, in its order.

    Nothing is carried out before a check is run; figures of one condition share its scenes. A check that yields no
    verdict is a figure that cannot be answered: its title says why.

    Parameters
    ----------
    sensor
        Its spec's `likeness` is what is checked.
    recordings
        Folder of recordings that answer instead of the twin.

    Raises
    ------
    UsageError
        If the sensor declares no figure.
    MissingRecordingError
        If the folder holds no recording.
    """
    figures = sensor.spec.likeness
    if not figures:
        raise UsageError(
            f"{sensor.name} declares no figure of real units to be held against.",
            hint="Give SensorSpec.likeness: see docs/likeness.md.",
        )
    if recordings is not None:
        found = recorded.evidence(Path(recordings), sensor.spec)
        return [_check(sensor, figure, lambda condition: found, of_twin=False) for figure in figures]

    @cache
    def carried_out(condition: str) -> Evidence:
        return scenes.evidence(sensor, condition)

    return [_check(sensor, figure, carried_out, of_twin=True) for figure in figures]


def _check(sensor: SensorDescriptor, figure: RealFigure, source: Source, *, of_twin: bool) -> Check:
    name = f"{figure.condition}: {figure.name}"
    title = f"{figure.statistic} in {figure.low:g} to {figure.high:g} {figure.unit} as on real units"
    reason = _twin_lacks(sensor, figure) if of_twin else _cannot(source, figure)
    if reason:
        return Check(name=name, group=figure.condition, title=f"left out: {reason}", run=lambda: ())

    def run() -> Sequence[Verdict]:
        try:
            found = take(source(figure.condition), figure)
        except NotApplicable:
            return ()
        reached = figure.low <= found <= figure.high
        return (
            Verdict(
                name=figure.name,
                found=found,
                low=figure.low,
                high=figure.high,
                unit=figure.unit,
                source=f"{figure.source.reference} (typical {figure.typical:g})",
                note=figure.cause if of_twin and not reached else "",
            ),
        )

    return Check(name=name, group=figure.condition, title=title, run=run)


def _cannot(source: Source, figure: RealFigure) -> str:
    """Return why the evidence does not answer; empty if it does."""
    try:
        take(source(figure.condition), figure)
    except NotApplicable as reason:
        return reason.message
    return ""


def _twin_lacks(sensor: SensorDescriptor, figure: RealFigure) -> str:
    """Return why the twin will not answer, known without solving anything; empty if it should."""
    if figure.condition not in scenes.CONDITIONS:
        return f"the twin carries out no scene of the kind {figure.condition!r}"
    kind = NEEDS.get(figure.statistic)
    if kind is not None and not scenes.gives(sensor, kind):
        return f"no installed effect gives {kind} of {sensor.name}"
    return ""
