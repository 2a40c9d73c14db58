"""Reader of CAN logs from a bus with an iCub fingertip."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from tactbench.plugin import DataError, Source, UsageError
from tactbench.plugin.devices import CanFrame, DeviceLog, Options, read_can_log, read_options
from tactbench.sensors.icub import STREAMS
from tactbench.sensors.icub.codec import (
    BROADCAST,
    HEAD,
    OLD_SKIN,
    SKIN,
    TAIL,
    SkinDecoder,
    TriangleSetup,
    read_command,
    to_block,
)


class LogOptions(Options):
    """Options of the log reader: the fingertip's board and triangle, and whether early firmware was in use."""

    board: int | None = Field(default=None, ge=0, le=14)
    """Number of the board; None: the only board in the log."""
    triangle: int | None = Field(default=None, ge=0, le=15)
    """Number of the fingertip's triangle on the board; None: the only triangle in the log."""
    old_ids: bool = False
    """Accept frames of class 3, too, which early firmware sends, but other analog sensors as well."""


def read_log(path: Path, options: Mapping[str, Any]) -> DeviceLog:
    """Read one fingertip's samples from a log in a format of python-can: candump's, Vector's ASC and BLF, ...

    Times count from the log's first message. Samples equal those of the driver from the same frames; a sample that is
    not later than the previous one is left out and counted. Several buses in one log are not distinguished.

    Options are those of :class:`LogOptions`.

    Raises
    ------
    UsageError
        If an option is unknown, or the options fit several fingertips.
    LinkError
        If the file is not a CAN log, or is damaged.
    DataError
        If the log has no frames of the fingertip.
    """
    settings = read_options(LogOptions, options, "a log of icub")
    classes = (OLD_SKIN, SKIN) if settings.old_ids else (SKIN,)
    halves: dict[tuple[int, int], list[CanFrame]] = {}
    commands = []
    frames, left_out = read_can_log(path)
    for frame in frames:
        if not frame.extended and frame.id >> 8 in classes and frame.data[:1] in (bytes([HEAD]), bytes([TAIL])):
            halves.setdefault((frame.id >> 4 & 0xF, frame.id & 0xF), []).append(frame)
        elif (found := read_command(frame)) is not None:
            commands.append(found)
    board, triangle = _chosen(path, settings, sorted(halves), len(frames))
    half = halves[board, triangle]
    steps = np.diff([frame.t_ns for frame in half if frame.data[0] == HEAD])
    steps = steps[steps > 0]
    if not len(steps):
        raise DataError(f"{path} has too few samples to compute their period.", hint="Record for longer.")
    period_s = 1e-9 * float(np.median(steps))
    text = f"{1e3 * period_s:.4g} ms between samples, the median of {path.name}"
    rate = Source(tag="measured", reference=text)
    decoder = SkinDecoder(period_s, old_ids=settings.old_ids)
    samples = [sample for frame in half for sample in decoder.feed(frame)] + decoder.flush()
    if not samples:
        raise DataError(f"{path} has no whole frame of board {board}, triangle {triangle}.", hint="Record it again.")
    kept = samples[:1]
    for sample in samples[1:]:
        if sample.t_ns > kept[-1].t_ns:
            kept.append(sample)
    sent = [command for to, command in commands if to in (board, BROADCAST)]
    counts = {
        **decoder.counts[board, triangle],
        "frames of others": len(frames) - len(half) - len(commands),
        **left_out,
        "samples kept out, not after the one before": len(samples) - len(kept),
        "baselines taken": sum(isinstance(command, TriangleSetup) for command in sent),
    }
    return DeviceLog(
        streams=(STREAMS[0].model_copy(update={"rate_hz": 1 / period_s, "rate_source": rate}),),
        blocks=(to_block(kept),),
        clock="host",
        remarks=(f"Board {board}, triangle {triangle}, {text}.",),
        counts={name: number for name, number in counts.items() if number},
    )


def _chosen(path: Path, settings: LogOptions, there: list[tuple[int, int]], frames: int) -> tuple[int, int]:
    """Return the only (board, triangle) in `there` that fits the options `settings`."""
    fitting = [
        (board, triangle)
        for board, triangle in there
        if settings.board in (None, board) and settings.triangle in (None, triangle)
    ]
    listed = "; ".join(f"board {board}, triangle {triangle}" for board, triangle in there)
    if not fitting:
        raise DataError(
            f"{path} has no frames of the chosen fingertip among its {frames} frames.",
            hint=f"There are: {listed}."
            if there
            else "Give the option old_ids=true for frames of early firmware (class 3).",
        )
    if len(fitting) > 1:
        raise UsageError(
            f"{path} has frames of {len(fitting)} fingertips; one is expected.",
            hint=f"Choose one by the options board and triangle. The log has: {listed}.",
        )
    return fitting[0]
