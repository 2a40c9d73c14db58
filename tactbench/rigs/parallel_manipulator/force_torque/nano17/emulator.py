"""A Nano17 and the microcontroller that digitises its gauges, as a model: nothing in, frames out.

A :class:`tactbench.plugin.devices.DeviceEmulator`. It listens to nothing, as the format has it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from tactbench.plugin import UsageError
from tactbench.plugin.devices import (
    CanFrame,
    DeviceEmulator,
    EmulatorSettings,
    Fault,
    Sent,
    fault_concerns,
    read_file,
    read_options,
)
from tactbench.rigs.parallel_manipulator.force_torque.nano17.codec import GaugeCalibration, read_calibration
from tactbench.rigs.parallel_manipulator.force_torque.nano17.gauges import (
    STEP_V,
    About,
    Nano17Options,
    encode_about,
    encode_sample,
)
from tactbench.rigs.parallel_manipulator.force_torque.wrench import wrench_of

EMULATED_CALIBRATION = Path(__file__).with_name("FT8577.cal")
"""Of a Nano17 SI-25-0.25 (sourced: a public MATLAB script for ATI matrices quotes it)."""
BAUD = 921_600
"""Of the line (assumed): it carries 2880 samples a second."""
OFFSET_V = 0.5
"""Gauges of the unloaded sensor read up to this, either way (assumed: a few percent of their range)."""


@dataclass(frozen=True)
class GaugeFault(Fault):
    """A fault of the sensor or of the line."""

    known: ClassVar[Mapping[str, str]] = {
        "dropped": "a sample is not sent",
        "doubled": "a sample is sent twice",
        "damaged": "one bit of a frame is turned",
        "saturated": "the gauges stand at the end of their range",
    }


class GaugeEmulator(DeviceEmulator):
    """A sensor, its six gauges and their converter.

    Parameters
    ----------
    wrench
        Fx, Fy, Fz [N], Tx, Ty, Tz [N*m] at a time [s].
    calibration
        The sensor's.
    rest_v
        (6,) gauges of the unloaded sensor [V].
    rate_hz
        Samples a second.
    first_counter, first_micros
        Of the first sample, to begin near the wraps of the counters.
    faults
        What is wrong with it; may be changed at any time.
    """

    def __init__(
        self,
        wrench: Callable[[float], Sequence[float]],
        calibration: GaugeCalibration,
        rest_v: Sequence[float] = (0.0,) * 6,
        *,
        rate_hz: float = 1000.0,
        first_counter: int = 0,
        first_micros: int = 0,
        faults: Iterable[GaugeFault] = (),
    ) -> None:
        # A tenth is left for the frame a second that says who sends them.
        largest_hz = 0.9 * BAUD / (10 * len(encode_sample(0, 0, (0,) * 6)))
        if not 0.0 < rate_hz <= largest_hz:
            raise UsageError(f"{BAUD} baud carry up to {largest_hz:.0f} samples a second, not {rate_hz:g}.")
        self.faults = list(faults)
        self._wrench = wrench
        self._calibration = calibration
        self._rest_v = np.asarray(rest_v, dtype=float)
        self._rate_hz = rate_hz
        self._first_counter, self._first_micros = first_counter, first_micros
        self._begin_s: float | None = None
        self._sample = 0
        self._free_s = -math.inf
        self._seen: Counter[Fault] = Counter()
        self._sent: list[Sent] = []

    def feed(self, piece: bytes | CanFrame, now_s: float) -> list[Sent]:
        """Listen to nothing; return what `poll` returns."""
        return self.poll(now_s)

    def poll(self, now_s: float) -> list[Sent]:
        """Go on to `now_s`; return the frames whose last byte has left by then. The first call is power-on."""
        if self._begin_s is None:
            self._begin_s = now_s
        while self._begin_s + self._sample / self._rate_hz <= now_s:
            self._one(self._begin_s + self._sample / self._rate_hz)
            self._sample += 1
        left = [piece for piece in self._sent if piece[0] <= now_s]
        del self._sent[: len(left)]
        return left

    def next_s(self) -> float:
        """Return when the next sample is taken or a frame has left; 0 before power-on."""
        if self._begin_s is None:
            return 0.0
        taken_s = self._begin_s + self._sample / self._rate_hz
        return min(taken_s, self._sent[0][0]) if self._sent else taken_s

    def _one(self, at_s: float) -> None:
        if self._sample % max(1, round(self._rate_hz)) == 0:
            self._send(encode_about(About(1, self._rate_hz, "tactbench emulator")), at_s)
        counts = np.rint(self._calibration.volts(self._wrench(at_s), self._rest_v) / STEP_V)
        if any(fault.name == "saturated" and fault.active(at_s) for fault in self.faults):
            counts = np.where(counts < 0, -np.inf, np.inf)
        counts = np.clip(counts, -(1 << 15), (1 << 15) - 1)
        micros = self._first_micros + round(1e6 * self._sample / self._rate_hz)
        frame = encode_sample(self._first_counter + self._sample, micros, tuple(counts.astype(int).tolist()))
        dropped, doubled, damaged = (
            fault_concerns(self.faults, name, at_s, self._seen) for name in ("dropped", "doubled", "damaged")
        )
        if damaged:
            frame = bytes([frame[0], frame[1] ^ 0x80]) + frame[2:]
        for _ in range(0 if dropped else 2 if doubled else 1):
            self._send(frame, at_s)

    def _send(self, frame: bytes, at_s: float) -> None:
        self._free_s = max(self._free_s, at_s) + 10 * len(frame) / BAUD
        self._sent.append((self._free_s, frame))


def build(settings: EmulatorSettings) -> GaugeEmulator:
    """Return an emulated sensor that reads `settings.senses`: fx, fy, fz [N], tx, ty, tz [N*m].

    Raises
    ------
    UsageError
        For options or faults that are not known, or a calibration that cannot be read.
    """
    options = read_options(Nano17Options, settings.options, "nano17")
    return GaugeEmulator(
        lambda at_s: wrench_of(settings.senses(at_s)),
        read_calibration(read_file(options.calibration, "The calibration")),
        settings.rng.uniform(-OFFSET_V, OFFSET_V, 6).tolist(),
        rate_hz=options.rate_hz,
        faults=[GaugeFault.parse(text) for text in settings.faults],
    )
