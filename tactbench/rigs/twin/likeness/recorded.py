"""The same evidence from recordings of a real sensor, in the project's own format."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, MissingRecordingError, NotApplicable, SensorSpec, UsageError
from tactbench.plugin.simulation import Recording, open_recording
from tactbench.rigs.twin.likeness.evidence import LOADED_FROM, Evidence

UNTOUCHED_WITHIN = 4.0
"""A row is untouched while no taxel is further than this from the recording's first rows [counts]."""
UNKNOWN_SESSIONS = ("", "unknown")


def evidence(folder: Path, spec: SensorSpec) -> Evidence:
    """Read all recordings below `folder` that may be evaluated.

    A recording must begin untouched: the median of its first tenth (100 rows at most) is its rest. If it has a
    multiple of the sensor's number of taxels, each run of so many is a unit of its own: the fingertips of a hand.

    Raises
    ------
    MissingRecordingError
        If there is no recording.
    UsageError
        If a recording's taxels are not those of the sensor, or no multiple of them.
    """
    paths = sorted(folder.rglob("*.h5")) if folder.is_dir() else []
    if not paths:
        raise MissingRecordingError(
            f"There is no recording (*.h5) below {folder}.",
            hint="Import some with `tactbench import MAPPING.yaml --out DIR`.",
        )
    rest: list[FloatArray] = []
    pressure_rest: list[FloatArray] = []
    states: list[FloatArray] = []
    pressures: list[FloatArray] = []
    steps: list[float] = []
    units: list[int] = []
    sessions: set[str] = set()
    for path in paths:
        with open_recording(path) as recording:
            if recording.meta.excluded:
                continue
            sessions.add(recording.meta.session)
            for unit, (counts, pressure, step) in enumerate(_units(recording, spec)):
                if step is not None:
                    steps.append(step)
                level = np.median(counts[: _first(len(counts))], axis=0)
                change = counts - level
                quiet = _leading(np.abs(change).max(axis=1) < UNTOUCHED_WITHIN)
                if quiet:
                    rest.append(counts[:quiet])
                if pressure is None:
                    loaded = change[int(np.abs(change).max(axis=1).argmax())]
                    if np.max(-loaded if _falls(spec) else np.abs(loaded)) >= LOADED_FROM:
                        states.append(loaded[None])
                        units.append(unit)
                    continue
                if quiet:
                    pressure_rest.append(pressure[:quiet])
                states.append(change[quiet:])
                units.extend([unit] * len(states[-1]))
                pressures.append(pressure[quiet:] - np.median(pressure[: _first(len(pressure))]))
    if not rest and not states:
        raise NotApplicable(f"no recording below {folder} may be evaluated: all are excluded by their sources")
    if pressures and sum(map(len, pressures)) != sum(map(len, states)):
        raise UsageError(
            f"Some recordings below {folder} have a channel of the fluid's pressure and some do not.",
            hint="Give them one folder each: loads are ordered by the pressure where there is one.",
        )
    taxels = tuple(channel.name for channel in spec.channels("taxel"))
    return Evidence(
        taxels,
        tuple(rest),
        tuple(pressure_rest),
        change=np.concatenate(states) if states else np.zeros((0, len(taxels))),
        pressure=np.concatenate(pressures) if pressures else None,
        unit=np.array(units, dtype=np.int64),
        dt_s=float(np.median(steps)) if steps else None,
        one_session=len(sessions) == 1 and not sessions.intersection(UNKNOWN_SESSIONS),
    )


def _units(recording: Recording, spec: SensorSpec) -> Iterator[tuple[FloatArray, FloatArray | None, float | None]]:
    """Yield the (n, taxels) counts of each unit in a recording, the fluid's pressure and the step of the clock."""
    each = len(spec.channels("taxel"))
    for name in recording.stream_names:
        stream = recording.stream(name)
        kinds = [channel.kind for channel in stream.spec.channels]
        taxels = [column for column, kind in enumerate(kinds) if kind == "taxel"]
        if not taxels:
            continue
        if len(taxels) % each:
            raise UsageError(
                f"{recording.path} has {len(taxels)} taxels in {name}; {spec.name} has {each}.",
                hint=f"Name the sensor it was recorded with, or give recordings of whole units of {each} taxels.",
            )
        rows = stream[:]
        if len(rows.data) < 2:
            continue
        data = rows.data.astype(np.float64)
        # Samples that are missing take their whole row with them.
        data = data[np.isfinite(data).all(axis=1)]
        if len(data) < 2:
            continue
        pressure = data[:, kinds.index("dc_pressure")] if "dc_pressure" in kinds else None
        step = None if rows.t_ns is None else float(np.median(np.diff(rows.t_ns))) * 1e-9
        for start in range(0, len(taxels), each):
            yield data[:, taxels[start : start + each]], pressure, step


def _first(rows: int) -> int:
    return min(100, max(1, rows // 10))


def _leading(flags: npt.NDArray[np.bool_]) -> int:
    """Return how many flags are set before the first that is not."""
    return len(flags) if flags.all() else int(np.argmin(flags))


def _falls(spec: SensorSpec) -> bool:
    return all(channel.sign < 0 for channel in spec.channels("taxel"))
