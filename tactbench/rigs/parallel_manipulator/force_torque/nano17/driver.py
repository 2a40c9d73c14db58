"""The driver of a Nano17 by its gauge voltages: frames of the gauge stream into forces and torques."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tactbench.plugin import Block, Quality, RigError, StreamSpec
from tactbench.plugin.devices import (
    ByteLink,
    Driver,
    DriverSettings,
    LinkTimeout,
    LinkUnplugged,
    Unwrap,
    open_for,
    read_file,
    read_options,
)
from tactbench.rigs.parallel_manipulator.force_torque.nano17.codec import GAUGES, read_calibration
from tactbench.rigs.parallel_manipulator.force_torque.nano17.gauges import (
    STEP_V,
    GaugeReader,
    GaugeSamples,
    Nano17Options,
)
from tactbench.rigs.parallel_manipulator.force_torque.wrench import STREAM, SampleCounter, stream

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

ABOUT_S = 2.5
"""Within which the microcontroller has said who it is: it does so once a second."""
ANSWER_S = 0.5
"""Within which samples come, over the time they take (assumed)."""
LEAST_TARE = 100
MOST_READS = 64
"""Of the link for one block."""


class Nano17Driver(Driver):
    """A Nano17 on a byte stream.

    Blocks hold every sample that came, in the order of arrival: `sequence` is the sample's own number, `device_ns` the
    microcontroller's time at which it was taken, `t_ns` when the first byte of its frame was in the host.

    A gauge at an end of its range marks all six channels SATURATED, since each depends on each gauge. Damaged frames
    and unknown ones are counted and are gaps in the sequence; ``beyond_range`` counts samples beyond the rated range,
    where the calibration is not stated: they are handed on unmarked.
    """

    def __init__(self, settings: DriverSettings) -> None:
        self._options = read_options(Nano17Options, settings.options, "nano17")
        self._calibration = read_calibration(read_file(self._options.calibration, "The calibration"))
        self._clock = settings.clock
        self._reader = GaugeReader()
        self._bias_v: FloatArray = np.zeros(GAUGES)
        self._beyond = 0
        self._before: list[Block] = []
        self._restart()
        self._link = open_for(settings, "nano17", ByteLink, "serial:///dev/ttyACM0?baud=921600")  # type: ignore[type-abstract]

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """`force_torque`, at the rate that the options state."""
        return (stream(self._options.rate_hz),)

    @property
    def counts(self) -> Mapping[str, int]:
        """Frames ``damaged`` and ``unknown``, samples ``beyond_range``; those that are 0 are left out."""
        found = {"damaged": self._reader.damaged, "unknown": self._reader.unknown, "beyond_range": self._beyond}
        return {name: count for name, count in found.items() if count}

    def identify(self) -> Mapping[str, str]:
        """Wait until the microcontroller says who it is; return that, and what the calibration file says.

        Raises
        ------
        LinkTimeout
            If it says nothing, or nothing that is a gauge stream.
        RigError
            If it speaks another version, or samples at another rate than the options state.
        """
        self._reader.about = None
        self._pump_until(lambda: self._reader.about is not None, ABOUT_S, "said who it is")
        about = self._reader.about
        assert about is not None
        if abs(about.rate_hz - self._options.rate_hz) > 1e-3 * self._options.rate_hz:
            raise RigError(
                f"The microcontroller samples {about.rate_hz:g} times a second, expected was "
                f"{self._options.rate_hz:g}.",
                hint=f"Write rate_hz: {about.rate_hz:g}, or change its firmware.",
            )
        return {
            "model": self._calibration.body_style or "Nano17",
            "calibration": f"{self._calibration.serial} {self._calibration.part_number}".strip(),
            "converter": about.name,
            "firmware": str(about.firmware),
            "rate_hz": f"{about.rate_hz:g}",
        }

    def start(self) -> None:
        """Drop what has come, and take the bias if the options ask for it: the sensor must be unloaded then.

        Raises
        ------
        LinkTimeout
            If no samples come.
        RigError
            If a gauge is at an end of its range.
        """
        with suppress(LinkTimeout):
            for _ in range(MOST_READS):
                self._reader.feed(self._link.read(0.0))
        self._reader.taken()
        self._before = []
        self._restart()
        if self._options.bias_samples:
            self._average(self._options.bias_samples)
            self._before = []
        else:
            self._pump_until(lambda: len(self._reader) > 0, self._time_s(1), "sent a sample")

    def read(self, timeout_s: float) -> list[Block]:
        """Return the samples that came.

        Raises
        ------
        RigError
            If the microcontroller has begun to count anew, or speaks another version.
        LinkUnplugged
            If it is gone.
        """
        blocks, self._before = self._before, []
        deadline = self._clock() + round(1e9 * timeout_s)
        try:
            while not (blocks or len(self._reader)):
                self._reader.feed(self._link.read(max(0.0, (deadline - self._clock()) / 1e9)))
            for _ in range(MOST_READS):
                self._reader.feed(self._link.read(0.0))
        except LinkTimeout:
            pass
        except LinkUnplugged:
            if not (blocks or len(self._reader)):
                raise
        return [*blocks, *([self._block(*self._reader.taken())] if len(self._reader) else [])]

    def stop(self) -> None:
        """Drop what has come; the microcontroller listens to nothing and sends on."""
        self._reader.taken()
        self._before = []

    def tare(self) -> bool:
        """Take the average of the next samples as zero, 100 of them at least; those so far are of the old zero.

        Raises
        ------
        LinkTimeout, LinkUnplugged, RigError
            As :meth:`start`.
        """
        self._average(max(LEAST_TARE, self._options.bias_samples))
        return True

    def close(self) -> None:
        """Close the link."""
        self._link.close()

    def _restart(self) -> None:
        self._samples, self._micros = SampleCounter("The Nano17's microcontroller"), Unwrap(32)

    def _time_s(self, samples: int) -> float:
        return ANSWER_S + 1.1 * samples / self._options.rate_hz

    def _pump_until(self, done: Callable[[], bool], seconds: float, what: str) -> None:
        """Take what comes until `done`; raises LinkTimeout."""
        deadline = self._clock() + round(1e9 * seconds)
        while not done():
            left_s = (deadline - self._clock()) / 1e9
            try:
                if left_s <= 0.0:
                    raise LinkTimeout("Time is over.")
                self._reader.feed(self._link.read(left_s))
            except LinkTimeout:
                raise LinkTimeout(
                    f"Nothing on {self._link.address} has {what} within {seconds:g} s ({len(self._reader)} samples, "
                    f"{self._reader.damaged} damaged frames came).",
                    hint="Is it the microcontroller's port and rate, with the firmware of docs/links.md?",
                ) from None

    def _average(self, samples: int) -> None:
        seconds = self._time_s(samples)
        self._pump_until(lambda: len(self._reader) >= samples, seconds, f"sent {samples} samples")
        found, t_ns = self._reader.taken()
        block = self._block(found, t_ns)
        volts = found.counts[-samples:] * STEP_V
        if self._calibration.quality(volts, step_v=STEP_V).any():
            raise RigError(
                "A gauge is at an end of its range: no zero can be taken.",
                hint="Unload the sensor; if it is unloaded, it was overloaded once or its wires are broken.",
            )
        self._before.append(block)
        self._bias_v = volts.mean(axis=0)

    def _block(self, samples: GaugeSamples, t_ns: npt.NDArray[np.int64]) -> Block:
        volts = samples.counts * STEP_V
        data = self._calibration.wrench(volts, self._bias_v)
        marks = self._calibration.quality(volts, step_v=STEP_V)
        good = (marks == Quality.GOOD).all(axis=1)
        self._beyond += int((self._calibration.beyond_range(data).any(axis=1) & good).sum())
        return Block(
            stream=STREAM,
            t_ns=t_ns,
            data=data,
            quality=marks if marks.any() else None,
            sequence=self._samples.counted_on(samples.counter),
            device_ns=1000 * self._micros(samples.micros),
        )


def build(settings: DriverSettings) -> Nano17Driver:
    """Read the calibration and open the link.

    Raises
    ------
    UsageError
        For options that are not known, a calibration that is none, or a link that carries no bytes.
    LinkError
        If the link does not open.
    """
    return Nano17Driver(settings)
