"""The force sensor of a rig as recorded: selection and sign of its pressing channel, and its zero."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from tactbench.core.errors import RigError, UsageError
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.rig_file import ForceEntry
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec

if TYPE_CHECKING:
    from tactbench.core.samples import Block, FloatArray

LEAST_ROWS = 10
"""Least number of rows from which a zero is computed."""
STRETCHES = 30
"""Number of parts of a zero's rows whose means are compared to estimate the scatter."""
STRETCH_S = 0.02
"""Time of correlated noise [s] (assumed: a held sample of 50 Hz). A zero below 0.6 s has no drift test."""
MOST_BAD = 0.1
"""Largest part of a zero's rows that may be marked as bad or not finite (assumed)."""
_PRESSED = "normal"
"""Name of the pressing channel if it is not simply `fz`; tasks accept both names."""


class PressingForce:
    """The force sensor of a rig as recorded: the channel of the rig file's `entry`, rising when pressed.

    Attributes
    ----------
    streams
        Streams of the force sensor; the pressing channel has sign 1, and the name `normal` where it is not plain `fz`.
    stream, column, sign
        Stream and column of the pressing force, and 1 or -1: pressing makes the device's channel rise or fall.
    zero
        (channels,) zero of this stream; 0 until :meth:`take_zero`.

    Raises
    ------
    UsageError
        If the force sensor lacks the channel.
    """

    def __init__(self, entry: ForceEntry, streams: tuple[StreamSpec, ...]) -> None:
        import numpy as np

        self._entry, self.sign, self._counted = entry, entry.sign, ""
        self._plain = (entry.channel, entry.sign) == ("fz", 1)
        places = [(stream, place) for stream in streams for place in range(len(stream.channels))]
        named = {stream.channels[place].name: (stream, place) for stream, place in reversed(places)}
        if entry.channel not in named:
            raise UsageError(
                f"The force sensor {entry.device!r} has no channel {entry.channel!r}; it has {', '.join(named)}.",
                hint="Correct `channel:` under `force:` in the rig file.",
            )
        stream, self.column = named[entry.channel]
        self.stream = stream.name
        channels = list(stream.channels)
        self.zero: FloatArray = np.zeros(len(channels))
        self._forces = {place: channel.name for place, channel in enumerate(channels) if channel.unit == "N"}
        update = {"sign": 1} if self._plain else {"sign": 1, "name": _PRESSED}
        channels[self.column] = ChannelSpec.model_validate({**dict(channels[self.column]), **update})
        pressed = stream.model_copy(update={"channels": tuple(channels)})
        self.streams = tuple(pressed if one is stream else one for one in streams)

    def take_zero(self, blocks: Iterable[Block]) -> None:
        """Set the zero of every channel of the stream to its mean in `blocks`, read without load.

        Every channel of unit N is tested: the size of its mean, its spread, its drift (the last third's mean less the
        first's). Rows that are not finite or marked are counted and left out.

        Raises
        ------
        RigError
            If the sensor is not at rest, or a tenth of its rows are marked or not finite, or it sends fewer than ten.
        """
        import numpy as np

        entry = self._entry
        if entry.zero_s == 0:
            return
        own = [
            np.where(0 if block.quality is None else block.quality, np.nan, block.data)
            for block in blocks
            if block.stream == self.stream
        ]
        rows = np.concatenate([np.empty((0, self.zero.size)), *own])
        good = np.isfinite(rows).all(axis=1)
        self._counted = f"{len(rows)} rows in {entry.zero_s:g} s, {int((~good).sum())} of them not finite or marked"
        if good.sum() < LEAST_ROWS or good.mean() < 1 - MOST_BAD:
            hint = "Check the force sensor with `tactbench doctor`."
            raise RigError(f"The zero of the force cannot be taken from so few good rows: {self._counted}.", hint=hint)
        rows = rows[good]
        wrong = [text for place, name in self._forces.items() for text in self._at_rest(name, rows[:, place])]
        if wrong:
            raise RigError(
                f"The force sensor is not at rest, and its zero is refused: {'; '.join(wrong)} ({self._counted}).",
                hint="Take hands and loads off and start again; else bias the sensor, or correct its range_n, noise_n "
                "or largest_zero_n under `force:`.",
            )
        self.zero = rows.mean(axis=0)

    def _at_rest(self, name: str, values: FloatArray) -> Iterator[str]:
        """Yield the problems in one channel's readings without load: mean, spread and drift."""
        import numpy as np

        entry, third = self._entry, len(values) // 3
        found = [
            ("mean", float(values.mean()), entry.largest_zero_n or 0.1 * entry.range_n),
            ("spread", float(values.std()), 2 * entry.noise_n if entry.noise_n else 0.05 * entry.range_n),
        ]
        if entry.zero_s >= STRETCHES * STRETCH_S and len(values) >= STRETCHES:
            drift = float(values[-third:].mean() - values[:third].mean())
            # The scatter of the means includes held or filtered noise; a drift changes neighbours little.
            means = values[: len(values) // STRETCHES * STRETCHES].reshape(STRETCHES, -1).mean(axis=1)
            deviation = float(np.sqrt(np.mean(np.diff(means) ** 2) / 2 * 6 / STRETCHES))
            found.append(("drift", drift, max(0.01 * entry.range_n, 5 * deviation)))  # one zero in ten thousand
        for what, value, most in found:
            if abs(value) > most:
                yield f"{name} has a {what} of {value:.3g} N, permitted are {most:.3g} N"

    def about(self) -> dict[str, Scalar]:
        """Return facts for a recording: the pressing channel with its sign, and the zeros."""
        about: dict[str, Scalar] = {f"zero of {self.stream}": ", ".join(f"{value:.6g}" for value in self.zero)}
        if not self._plain:
            about["normal force"] = f"{'-' if self.sign < 0 else ''}{self._entry.channel} of {self._entry.device}"
        return {**about, **({f"zero rows of {self.stream}": self._counted} if self._counted else {})}

    def turned(self, block: Block) -> Block:
        """Return a block; in blocks of the stream the zero is subtracted, and the force is positive when pressing."""
        if block.stream != self.stream:
            return block
        data = block.data - self.zero
        data[:, self.column] *= self.sign
        return replace(block, data=data)
