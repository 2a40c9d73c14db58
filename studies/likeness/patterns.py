"""The share of the variance of real patterns that another real trial explains, and that the simulation does."""

from __future__ import annotations

import itertools
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np

from studies.likeness.scenes import LOADED, PLATE_N, Bench, direction
from tactbench.core.recording.reader import open_recording

NEAREST = 10
TILTS_DEG, AZIMUTHS_DEG = range(0, 76, 5), range(-180, 180, 15)
"""Plates of the simulation from which the nearest is taken."""
TILT_BINS_DEG = (0, 30, 50, 90, 181)


class Trial(NamedTuple):
    """Plates pressed in one trial."""

    change: np.ndarray
    """(states, electrodes) from rest [counts]."""
    direction: np.ndarray
    """(states, 3) unit vectors from the finger to the plate; the pad faces -z."""


def explained(real: np.ndarray, predicted: np.ndarray) -> float:
    """Return ``1 - sum |c - p|² / sum |c - mean(c)|²`` of (states, channels)."""
    return float(1 - np.sum((real - predicted) ** 2) / np.sum((real - real.mean(axis=0)) ** 2))


def correlations(real: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return (states,) the correlation of each state's pattern with its prediction."""
    a, b = (x - x.mean(axis=1, keepdims=True) for x in (real, predicted))
    return np.sum(a * b, axis=1) / np.sqrt(np.sum(a**2, axis=1) * np.sum(b**2, axis=1))


def read_plates(folder: Path) -> tuple[Trial, Trial]:
    """Return both trials: ``X`` has the 19 electrodes line by line, ``Y`` the three components of the direction."""
    return tuple(
        Trial(np.loadtxt(folder / f"X{number}.txt").T, np.loadtxt(folder / f"Y{number}.txt").T) for number in (1, 2)
    )


def _apart(wanted: Trial, known: Trial) -> np.ndarray:
    """Return (wanted, known) how far apart states are: 5 degrees count as 10 % of size."""
    angle = np.degrees(np.arccos(np.clip(wanted.direction @ known.direction.T, -1, 1))) / 5
    size = [np.log(np.linalg.norm(trial.change, axis=1) + 1.0) for trial in (wanted, known)]
    return np.hypot(angle, (size[0][:, None] - size[1][None, :]) / 0.1)


def predicted(wanted: Trial, known: Trial, nearest: int) -> np.ndarray:
    """Return (wanted, electrodes) the mean of the states of `known` nearest in direction and size."""
    found = np.empty_like(wanted.change)
    for first in range(0, len(found), 500):
        part = Trial(wanted.change[first : first + 500], wanted.direction[first : first + 500])
        order = np.argpartition(_apart(part, known), nearest - 1, axis=1)[:, :nearest]
        found[first : first + 500] = known.change[order].mean(axis=1)
    return found


def simulated_plates(bench: Bench) -> Trial:
    """Return plates of all orientations under all loads."""
    changes, ways = [], []
    for tilt in TILTS_DEG:
        for azimuth in AZIMUTHS_DEG if tilt else (0,):
            changes.append(bench.press(bench.plate(direction(tilt, azimuth)), PLATE_N)[:, :-1])
            ways.append(np.tile(direction(tilt, azimuth), (len(PLATE_N), 1)))
    return Trial(np.concatenate(changes), np.concatenate(ways))


def compare_plates(trials: tuple[Trial, Trial], twin: Trial) -> dict[str, tuple[int, float]]:
    """Return how many states, and explained variance or correlation: each trial by the other, and by the simulation.

    Which way the axes of the trials point is not stated: of the sixteen ways (two may be swapped, each of the three may
    be reversed) the one is taken by which the simulation explains most of the first trial; figures are of the second.
    """
    first, second = trials

    def turned(trial: Trial, way: tuple[int, ...]) -> Trial:
        x, y, z = trial.direction.T
        x, y = (y, x) if way[3] else (x, y)
        return Trial(trial.change, np.stack([way[0] * x, way[1] * y, way[2] * z], axis=1))

    every = list(itertools.product((1, -1), (1, -1), (1, -1), (0, 1)))
    way = max(every, key=lambda one: explained(first.change, predicted(turned(first, one), twin, 1)))
    first, second = turned(first, way), turned(second, way)
    by_twin = predicted(second, twin, 1)
    found = {
        "ceiling: the second trial by the first": _share(second, predicted(second, first, NEAREST)),
        "ceiling: the first trial by the second": _share(first, predicted(first, second, NEAREST)),
        "the second trial by the simulation": _share(second, by_twin),
    }
    tilt = np.degrees(np.arccos(np.clip(-second.direction[:, 2], -1, 1)))
    for low, high in itertools.pairwise(TILT_BINS_DEG):
        inside = (tilt >= low) & (tilt < high)
        r = np.median(correlations(second.change[inside], by_twin[inside])) if inside.any() else np.nan
        found[f"median correlation, tilts of {low} to {high} degrees"] = (int(inside.sum()), float(r))
    return found


def _share(trial: Trial, by: np.ndarray) -> tuple[int, float]:
    return len(trial.change), explained(trial.change, by)


def read_grasps(folder: Path) -> dict[tuple[str, int], np.ndarray]:
    """Return (trials, 12) the row of the largest change by object and finger, of fingertips that count as loaded."""
    found = defaultdict(list)
    for path in sorted(folder.rglob("*.h5")):
        with open_recording(path) as recording:
            if recording.meta.excluded:
                continue
            data = recording.read("taxels").data.astype(float)
            change = (data - np.median(data[: max(1, len(data) // 10)], axis=0)).reshape(len(data), -1, 12)
            for finger in range(change.shape[1]):
                row = change[np.abs(change[:, finger]).max(axis=1).argmax(), finger]
                if -row.min() >= LOADED:
                    found[recording.meta.labels["object"], finger].append(row)
    return {key: np.array(rows) for key, rows in found.items() if len(rows) > 1}


def simulated_grasps(bench: Bench) -> np.ndarray:
    """Return (presses, taxels) changes under caps and flats, all over the pad."""
    low, high, arc = (edge.to("mm") for edge in bench.sheet.pad)
    places = [(x, s) for x in np.linspace(low, high, 10) for s in np.linspace(-arc / 2, arc / 2, 6)]
    gaps = [bench.cap(radius, x, s) for radius in (5.0, 10.0, 20.0, np.inf) for x, s in places]
    return np.concatenate([bench.press(gap, (0.5, 1.0, 2.0, 4.0)) for gap in gaps])


def compare_grasps(grasps: dict[tuple[str, int], np.ndarray], twin: np.ndarray) -> dict[str, tuple[int, float]]:
    """Return how many, and the explained variance about each finger's mean: by other trials, and by the best press."""
    real, others, best = [], [], []
    for (_, finger), rows in grasps.items():
        mean = np.concatenate([own for (_, one), own in grasps.items() if one == finger]).mean(axis=0)
        real.append(rows - mean)
        others.append((rows.sum(axis=0) - rows) / (len(rows) - 1) - mean)
        nearest = np.square(rows[:, None, :] - twin[None, :, :]).sum(axis=2).argmin(axis=1)
        best.append(twin[nearest] - mean)
    real, others, best = (np.concatenate(parts) for parts in (real, others, best))
    total = np.sum(real**2)
    return {
        "ceiling: by the object's other trials": (len(real), float(1 - np.sum((real - others) ** 2) / total)),
        "by the most similar of the simulation's presses": (len(real), float(1 - np.sum((real - best) ** 2) / total)),
    }
