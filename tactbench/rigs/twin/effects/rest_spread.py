"""Rest levels that differ from channel to channel within one unit."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Move each taxel's rest level by the sensor parameter ``rest_spread`` (sd), the same in every recording."""
    stated = run.sensor.spec.parameters.get("rest_spread")
    if stated is None:
        return
    for track in run.tracks:
        columns = track.by_kind().get("taxel")
        if columns:
            numbers = run.of_every_channel(track, "taxel", run.of_unit("rest", "taxel"))
            track.readings[:, columns] += stated.value * numbers
