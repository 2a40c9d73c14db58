"""Rest levels of another unit of the sensor than the one that the spec describes."""

from __future__ import annotations

from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Move the rest levels by what the channels of a unit share and by what is each one's own; the first unit stays."""
    if run.scene.first_unit:
        return
    for track in run.tracks:
        for kind, columns in track.by_kind().items():
            nuisances = run.nuisances(kind)
            if nuisances is None:
                continue
            told = []
            if nuisances.unit_rest_shared is not None:
                shared = float(run.of_unit("shared rest", kind).standard_normal())
                track.readings[:, columns] += nuisances.unit_rest_shared.value * shared
                told.append(f"{nuisances.unit_rest_shared} together ({nuisances.unit_rest_shared.source.tag})")
            if nuisances.unit_rest_own is not None:
                own = run.of_every_channel(track, kind, run.of_unit("own rest", kind))
                track.readings[:, columns] += nuisances.unit_rest_own.value * own
                told.append(f"{nuisances.unit_rest_own} each ({nuisances.unit_rest_own.source.tag})")
            if told:
                run.drawn["remark unit rest"] = (
                    f"units beside 1 are drawn: rest levels of {kind} channels differ by {' and '.join(told)}, sd"
                )
