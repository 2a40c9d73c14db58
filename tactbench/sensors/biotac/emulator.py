"""A BioTac as a model on SPI: bytes in, bytes out, on a clock that is passed in.

Written from the public sources of :mod:`tactbench.sensors.biotac.codec`, never held against a real sensor. No source
states the order in which a sensor checks parity, command and channel, what it puts on the line during a command, what
follows a property's last byte, nor which commands but sampling need a pause: these are assumed, below.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

from tactbench.sensors.biotac.channels import CONVERTER_TOP, STREAMS
from tactbench.sensors.biotac.codec import (
    CLOCK,
    ERROR,
    INDEX,
    PROPERTIES,
    READ,
    SAMPLING_PAUSE,
    WRITE,
    encoded,
    parity_holds,
    with_parity,
)
from tactbench.sensors.biotac.frames import DEFAULT_FRAME

State = Callable[[float], Mapping[str, float]]
"""Counts of each channel at a time in seconds."""

FaultName = Literal["parity", "dropped-reply", "doubled-reply", "stuck-channel", "not-connected", "error-reply"]

_ROUNDING_S = 1e-9
"""Seconds as float64 are 0.1 ns apart after eleven days, and a host's sum of pauses rounds more than once."""

_NAMES = {index: name for name, index in INDEX.items()}

_FILLERS = (0x00, 0x01)
"""First byte that a host sends while it reads: 00 00, 00 01 and 01 00 are in use [sourced: driver, manual, and a public
bridge for a PIC32]."""


@dataclass
class EmulatedFault:
    """A fault that the emulator shows; times in seconds of the clock passed in.

    ``parity`` turns one bit of a word on its way, another one each time; ``dropped-reply`` and ``doubled-reply`` stand
    for a bridge between host and bus that loses or repeats an answer, since on the bus itself the host clocks every
    byte; ``stuck-channel`` holds what the channel read when the fault began; ``not-connected`` leaves the line idle and
    loses all state, as without power; ``error-reply`` answers A5 and `error`.

    Raises
    ------
    ValueError
        For a name that is none of these, or `every` below 1.
    """

    name: FaultName
    start_s: float = -math.inf
    end_s: float = math.inf
    every: int = 1
    """It concerns every so-many-eth of the words it could concern."""
    channels: frozenset[str] = frozenset()
    """Of these channels only; empty: of all."""
    error: int = 0x2E
    """Second byte of an error reply."""
    _seen: int = field(default=0, init=False, repr=False)
    _held: dict[str, int] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        if self.name not in get_args(FaultName):
            raise ValueError(f"no fault is called {self.name!r}; there are {', '.join(get_args(FaultName))}")
        if self.every < 1:
            raise ValueError(f"every {self.every} words is none: 1 or more")

    def active(self, now_s: float) -> bool:
        """Return whether it is shown at `now_s`."""
        return self.start_s <= now_s < self.end_s

    def turn(self, now_s: float, channel: str) -> int | None:
        """Return how many words of `channel` it concerned before this one, or None if it does not concern this one."""
        if not self.active(now_s) or (self.channels and channel not in self.channels):
            return None
        self._seen += 1
        turns, left = divmod(self._seen, self.every)
        return None if left else turns - 1

    def held(self, channel: str, count: int) -> int:
        """Return what `channel` read when this was asked for the first time."""
        return self._held.setdefault(channel, count)


@dataclass
class _Answer:
    data: bytes
    """What comes over the line."""
    word: bytes = b""
    """What the sensor sent, to be repeated; empty: nothing."""
    channel: str = ""
    early: int | None = None
    """Second byte of the error that is sent instead before `ready_s`."""
    ready_s: float = -math.inf
    dropped: bool = False
    doubled: bool = False
    sent: int = 0


def rest_state(_t_s: float) -> Mapping[str, float]:
    """Return the counts of the spec's channels at rest, whatever the time."""
    return _REST


_REST = {
    channel.name: channel.rest.value for stream in STREAMS for channel in stream.channels if channel.rest is not None
}

DEFAULT_PROPERTIES: Mapping[str, bytes] = {
    "flex version": b"BD",
    "software version": b"0238",
    "serial number": b"BT2P0220B11E0004",
    "cpu speed": (16000).to_bytes(2, "big"),
    "sampling frequency": (4400).to_bytes(2, "big"),
    "sampling pattern": b"".join(
        bytes([with_parity(0x40 | INDEX[name]), 0xFE if place == len(DEFAULT_FRAME) - 1 else 0x01])
        for place, name in enumerate(DEFAULT_FRAME)
    ),
}
"""Serial and versions as in the maker's examples [sourced: QuickStart Guide]; speed [assumed]; big-endian frequency
[assumed]; the default frame as pattern [derived]."""


class Emulator:
    """One BioTac on an SPI bus.

    A sampling command samples at its last bit; the word is read after the pause. Several sensors that are selected
    together are several emulators that get the same bytes.

    Parameters
    ----------
    state
        Counts of each channel at a time in seconds; rounded, and clipped to 0-4095. Its channels are those that the
        sensor has: E1 to E19, PDC, TDC, TAC and PAC, or E20 to E24, too, on an SP. None: the spec's rest levels.
    properties
        Bytes of each property; one that is left out is unknown to the sensor.
    faults
        What goes wrong; the list may be changed at any time.
    clock_hz
        Of the bus: how long bytes take.
    idle
        What is on the line when the sensor does not drive it: 00 or FF.
    early_resend
        The answer to a resend before any word: ``error`` is A5 5F [sourced: driver], ``ignored`` is none [sourced:
        manual].
    """

    def __init__(
        self,
        state: State | None = None,
        *,
        properties: Mapping[str, bytes] = DEFAULT_PROPERTIES,
        faults: Iterable[EmulatedFault] = (),
        clock_hz: float | None = None,
        idle: int = 0xFF,
        early_resend: Literal["error", "ignored"] = "error",
    ) -> None:
        self._state = rest_state if state is None else state
        self._properties = {PROPERTIES[name].code: data for name, data in properties.items()}
        self.faults = list(faults)
        self._byte_s = 8.0 / (CLOCK.to("Hz") if clock_hz is None else clock_hz)
        self._idle = bytes([idle])
        self._early_resend = early_resend
        self._answer: _Answer | None = None
        self._last: _Answer | None = None

    def feed(self, data: bytes, now_s: float) -> bytes:
        """Return what is on the line while the host clocks `data` in.

        Parameters
        ----------
        data
            One period of the select: two bytes of a command, or fillers (first byte 00 or 01) while a reply is read.
            Bytes after a command in the same period are read at once, without the pause.
        now_s
            When the period begins.

        Returns
        -------
        bytes
            As many as went in, unless a fault drops or doubles a reply. During a command the line is idle [assumed].
        """
        if any(fault.name == "not-connected" and fault.active(now_s) for fault in self.faults):
            self._answer, self._last = None, None
            return self._idle * len(data)
        if self._answer is not None and data[:1] and data[0] in _FILLERS:
            return self._read(len(data), now_s)
        if len(data) < 2:
            return self._idle * len(data)
        end_s = now_s + 2 * self._byte_s
        self._answer = self._command(data[0], data[1], end_s)
        return self._idle * 2 + self._read(len(data) - 2, end_s)

    def poll(self, now_s: float) -> bytes:
        """Return what the sensor sends by itself: nothing, the host clocks every byte."""
        return b""

    def _read(self, n: int, now_s: float) -> bytes:
        answer = self._answer
        if answer is None or n == 0:
            return self._idle * n
        if answer.early is not None and now_s < answer.ready_s - _ROUNDING_S:
            answer = self._answer = self._error(answer.early)
        if answer.word:
            self._last = answer
        out = answer.data[answer.sent : answer.sent + n]
        answer.sent += n
        # What follows a property's last byte is assumed: the driver reads texts up to a 00 or FF.
        out += self._idle * (n - len(out))
        if answer.dropped:
            out = b""
        if answer.word and answer.sent >= len(answer.data):
            self._answer = None
            if answer.doubled:
                out += answer.data
        return out

    def _command(self, first: int, second: int, now_s: float) -> _Answer | None:
        """Return the answer to a command; parity is checked first, then the command, then its channel [assumed]."""
        if first in (0x20, 0x50):
            # 20 [sourced: driver] and 50, as the manual prints it, of even parity.
            return self._resend(now_s)
        if not parity_holds(first) or (first in (READ, WRITE) and not parity_holds(second)):
            return self._error(0x45)
        if first & 0x80:
            return self._sample(first >> 1 & 63, now_s)
        if first == READ and second in self._properties:
            # The pause is sourced, the error before its end assumed.
            return _Answer(self._properties[second], early=0x2E, ready_s=now_s + SAMPLING_PAUSE.to("s"))
        if first == WRITE and second in self._properties:
            return self._error(0x52)
        return self._error(0x3F)

    def _sample(self, index: int, now_s: float) -> _Answer:
        counts, channel = self._state(now_s), _NAMES.get(index, "")
        if channel not in counts:
            return self._error(0x58)
        count = min(max(round(counts[channel]), 0), int(CONVERTER_TOP))
        for fault in self.faults:
            if fault.name == "stuck-channel" and fault.turn(now_s, channel) is not None:
                count = fault.held(channel, count)
        word = encoded(count)
        for fault in self.faults:
            if fault.name == "error-reply" and fault.turn(now_s, channel) is not None:
                word = bytes([ERROR, fault.error])
        answer = self._word(word, channel, now_s)
        answer.early, answer.ready_s = 0x2D, now_s + SAMPLING_PAUSE.to("s")
        return answer

    def _resend(self, now_s: float) -> _Answer | None:
        """Return the last two bytes that were sent, errors among them [assumed], without a pause [assumed]."""
        if self._last is not None:
            return self._word(self._last.word, self._last.channel, now_s)
        return self._error(0x5F) if self._early_resend == "error" else None

    def _word(self, word: bytes, channel: str, now_s: float) -> _Answer:
        """Return a word as it comes over the line; what may be asked for again is the word itself."""
        answer = _Answer(word, word, channel)
        for fault in self.faults:
            if fault.name not in ("parity", "dropped-reply", "doubled-reply"):
                continue
            turn = fault.turn(now_s, channel)
            if turn is None:
                continue
            if fault.name == "parity":
                answer.data = (int.from_bytes(answer.data, "big") ^ 1 << turn % 16).to_bytes(2, "big")
            answer.dropped |= fault.name == "dropped-reply"
            answer.doubled |= fault.name == "doubled-reply"
        return answer

    def _error(self, second: int) -> _Answer:
        word = bytes([ERROR, second])
        return _Answer(word, word)
