"""Emulator of a BioTac on an SPI bus: a function from received bytes and times to sent bytes.

Written from the public sources of :mod:`tactbench.sensors.biotac.codec`, never compared with a real sensor. No source
states the order in which a sensor checks parity, command and channel, what it puts on the line during a command, what
follows a property's last byte, nor which commands but sampling need a pause: these are assumed, below.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from tactbench.plugin import UsageError
from tactbench.plugin.devices import (
    EmulatorSettings,
    Fault,
    Senses,
    SpiDeviceEmulator,
    fault_concerns,
    read_options,
)
from tactbench.sensors.biotac.channels import CONVERTER_TOP, STREAMS
from tactbench.sensors.biotac.codec import (
    CLOCK,
    ERROR,
    FASTEST_CLOCK,
    INDEX,
    NAMES,
    PROPERTIES,
    READ,
    SAMPLING_PAUSE,
    WRITE,
    encoded,
    parity_holds,
)
from tactbench.sensors.biotac.frames import BioTacOptions

_ROUNDING_S = 1e-9
"""Tolerance for rounded times: float64 seconds are 0.1 ns apart after eleven days."""

_IDLE = b"\xff"
"""Byte that the host reads while the sensor does not drive the data line [assumed: high]."""

_FILLERS = (0x00, 0x01)
"""First bytes that a host may send while it reads a reply: 00 00, 00 01 and 01 00 are in use [sourced: driver, manual,
and a public bridge for a PIC32]."""


@dataclass(frozen=True)
class BioTacFault(Fault):
    """A fault of the emulated sensor.

    Raises
    ------
    UsageError
        For the reasons of every Fault, for a channel that no BioTac has, or an `error` outside 0 to 255.
    """

    known: ClassVar[Mapping[str, str]] = {
        "parity": "one bit of a word is turned on its way, another one each time",
        "dropped-reply": "the line stays idle while a word is read",
        "doubled-reply": "the word before comes once more in place of this one",
        "stuck-channel": "a channel stays at what it read when the fault began",
        "not-connected": "the line stays idle throughout, and the sensor forgets all, as without power",
        "error-reply": "a word is A5 and `error`",
    }

    channels: frozenset[str] = frozenset()
    """Names of the channels that have the fault; empty: all channels."""
    error: int = 0x2E
    """Second byte of the error reply that the fault causes."""

    def __post_init__(self) -> None:
        super().__post_init__()
        unknown = sorted(self.channels - set(INDEX))
        if unknown:
            raise UsageError(
                f"The fault {self.name!r} names the channels {', '.join(unknown)}, which no BioTac has.",
                hint=f"Choose from {', '.join(INDEX)}.",
            )
        if not 0 <= self.error <= 0xFF:
            raise UsageError(f"The fault {self.name!r} has the error code {self.error}.", hint="Give a byte, 0 to 255.")


@dataclass
class _Answer:
    data: bytes
    """Bytes that the host has still to receive as the answer to a command."""
    word: bytes = b""
    """Word that a resend command repeats; empty if no word was sent."""
    channel: str = ""
    early: int | None = None
    """Second byte of the error reply that is sent instead of the data if read before `ready_s`."""
    ready_s: float = -math.inf


REST: Mapping[str, float] = {
    channel.name: channel.rest.value for stream in STREAMS for channel in stream.channels if channel.rest is not None
}
"""Readings [count] of the BioTac's channels at rest."""

DEFAULT_PROPERTIES: Mapping[str, bytes] = {
    "flex version": b"BD",
    "software version": b"0238",
    "serial number": b"BT2P0220B11E0004",
}
"""Bytes of the sensor's properties, as in the maker's examples [sourced: QuickStart Guide]."""


class Emulator(SpiDeviceEmulator):
    """Emulated BioTac on an SPI bus.

    A sampling command samples at its last bit; the word is read after the pause. For several sensors that are selected
    together, use several emulators with the same bytes.

    `senses` maps a time [s] to counts of channels, rounded and clipped to 0-4095; channels left out are at rest (None:
    all). The sensor has E1 to E19, PDC, TDC, TAC and PAC, and further channels given (E20 to E24 on an SP). It has only
    the properties given. It receives bytes only if all lines of the mask `select` are active. `clock_hz` is the clock
    of the bus, and determines the duration of a byte. `faults` may be changed at any time.
    """

    def __init__(
        self,
        senses: Senses | None = None,
        *,
        properties: Mapping[str, bytes] = DEFAULT_PROPERTIES,
        faults: Iterable[BioTacFault] = (),
        select: int = 1,
        clock_hz: float | None = None,
    ) -> None:
        self._senses = senses or (lambda _: {})
        self._properties = {PROPERTIES[name][0]: data for name, data in properties.items()}
        self.faults = list(faults)
        self._select = select
        self._byte_s = 8.0 / (CLOCK.to("Hz") if clock_hz is None else clock_hz)
        self._answer: _Answer | None = None
        self._last: _Answer | None = None
        self._seen: Counter[Fault] = Counter()
        self._turned = 0
        self._held: dict[tuple[BioTacFault, str], int] = {}

    def exchange(self, select: int, data: bytes, now_s: float) -> bytes:
        """Return the bytes that the host receives while it sends `data` in one period of the `select` lines.

        `data` is two bytes of a command, or fillers (first byte 00 or 01) while a reply is read; bytes after a command
        are read at once, without the pause. During a command, and while the sensor is not selected, the line is idle
        [assumed].
        """
        if any(fault.name == "not-connected" and fault.active(now_s) for fault in self.faults):
            self._answer, self._last = None, None
            return _IDLE * len(data)
        if select & self._select != self._select:
            return _IDLE * len(data)
        if self._answer is not None and data[:1] and data[0] in _FILLERS:
            return self._read(len(data), now_s)
        if len(data) < 2:
            return _IDLE * len(data)
        end_s = now_s + 2 * self._byte_s
        self._answer = self._command(data[0], data[1], end_s)
        return _IDLE * 2 + self._read(len(data) - 2, end_s)

    def _shown(self, name: str, channel: str, now_s: float) -> list[BioTacFault]:
        """Return the faults called `name` that affect the next word of `channel` at `now_s`."""
        return [
            fault
            for fault in self.faults
            if (not fault.channels or channel in fault.channels) and fault_concerns([fault], name, now_s, self._seen)
        ]

    def _read(self, n: int, now_s: float) -> bytes:
        answer = self._answer
        if answer is None or n == 0:
            return _IDLE * n
        if answer.early is not None and now_s < answer.ready_s - _ROUNDING_S:
            answer = self._answer = self._error(answer.early)
        if answer.word:
            self._last = answer
        out, answer.data = answer.data[:n], answer.data[n:]
        if answer.word and not answer.data:
            self._answer = None
        # What follows a property's last byte is assumed: the driver reads texts up to a 00 or FF.
        return out + _IDLE * (n - len(out))

    def _command(self, first: int, second: int, now_s: float) -> _Answer:
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
        channel = NAMES.get(index, "")
        sensed = self._senses(now_s).get(channel, REST.get(channel))
        if sensed is None:
            return self._error(0x58)
        count = min(max(round(sensed), 0), int(CONVERTER_TOP))
        for fault in self._shown("stuck-channel", channel, now_s):
            count = self._held.setdefault((fault, channel), count)
        word = encoded(count)
        for fault in self._shown("error-reply", channel, now_s):
            word = bytes([ERROR, fault.error])
        answer = self._word(word, channel, now_s)
        answer.early, answer.ready_s = 0x2D, now_s + SAMPLING_PAUSE.to("s")
        return answer

    def _resend(self, now_s: float) -> _Answer:
        """Return the last two bytes sent, which may be an error reply [assumed]; no pause is needed [assumed]."""
        if self._last is not None:
            return self._word(self._last.word, self._last.channel, now_s)
        # As the driver has it; the manual says that such a request is ignored.
        return self._error(0x5F)

    def _word(self, word: bytes, channel: str, now_s: float) -> _Answer:
        """Return the answer with `word` after faults of the line; a resend repeats the word without these faults."""
        answer = _Answer(word, word, channel)
        if self._shown("doubled-reply", channel, now_s) and self._last is not None:
            answer.data = self._last.word
        for _ in self._shown("parity", channel, now_s):
            answer.data = (int.from_bytes(answer.data, "big") ^ 1 << self._turned % 16).to_bytes(2, "big")
            self._turned += 1
        if self._shown("dropped-reply", channel, now_s):
            answer.data = _IDLE * 2
        return answer

    def _error(self, second: int) -> _Answer:
        word = bytes([ERROR, second])
        return _Answer(word, word)


def build_emulator(settings: EmulatorSettings) -> Emulator:
    """Return the emulator for `settings`, as ``SensorDescriptor.emulator`` requires; it uses no random numbers.

    The clock of the bus is unknown here, and assumed to be the fastest that a sensor allows, so that no pause of 50 us
    is too short; at 4.4 MHz the emulator samples 2 us early and accepts a pause that is 2 us too short.

    Raises
    ------
    UsageError
        If an option or a fault is unknown.
    """
    options = read_options(BioTacOptions, settings.options, "biotac")
    faults = [BioTacFault.parse(text) for text in settings.faults]
    return Emulator(settings.senses, faults=faults, select=options.select, clock_hz=FASTEST_CLOCK.to("Hz"))
