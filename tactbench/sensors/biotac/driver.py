"""Driver of the BioTac: sends batches of SPI transfers and returns blocks of counts.

**Wiring.** The sensor is a slave on SPI, mode 0, 0.5 to 10 MHz, select active low, supply 3.3-5 V; the host clocks
every byte. An SPI bridge (``spi://bridge/…``, a microcontroller that carries out batches by itself, ``docs/links.md``)
keeps the time of 4400 words a second.

**Sampling.** A batch is one frame: 44 words in 10 ms, pauses in whole microseconds chosen so that the mean rate is
4400 words a second to 1 us in any stretch (:class:`~tactbench.sensors.biotac.frames.FrameBatches`). Some batches are
sent ahead of the running one, so that the host may be late by as many frames.

**Times.** A bridge stamps each batch with its own microseconds: `device_ns` of a row is that stamp, counted on over its
wraps, and the word's place in the batch; `t_ns` is when the reply was in the host, the same for all rows of a batch.
Without such a counter there is only `t_ns`, counted back from the end of the batch.

**Faults.** Names in brackets are those of :attr:`BioTacDriver.counts`; rows are raw counts, and a gap is never filled.

=====================================  =================================================================================
fault                                  in the recording
=====================================  =================================================================================
a bit turned on the line               SUSPECT, the number as it came [parity E7]; two turned bits of a byte may pass
both parities good, a fixed bit not    SUSPECT [reserved bits E7]
an error reply                         MISSING [error reply E7]
the line idle, one word or for long    MISSING [not connected E7]; sensor or select line is not there
the word before once more, or a        not seen: its bytes are good
channel that stays where it is
the reply to a batch lost or damaged   its rows are absent: a gap in the sequence [batches lost]
the host too late for the next batch   its rows come later [batches late]; whole frames that had their time in the pause
                                       are a gap in the sequence [frames not requested]
cable, port or bridge gone             the reading ends with LinkUnplugged
=====================================  =================================================================================

**Tested** against an emulator written from the same public sources, never with a real BioTac or bridge. Assumed
is above all that the sensor samples at the last bit of its command, that a property is read with the pause of a
sampling command, and that a resend needs the same pause.
"""

from __future__ import annotations

import contextlib
from collections import Counter, deque
from collections.abc import Mapping

from tactbench.plugin import Block, RigError, Source, StreamSpec
from tactbench.plugin.devices import (
    Driver,
    DriverSettings,
    LinkError,
    LinkTimeout,
    SpiBridge,
    SpiLink,
    SpiReply,
    SpiStep,
)
from tactbench.sensors.biotac.codec import (
    COMMAND_RATE,
    FASTEST_CLOCK,
    PROPERTIES,
    SAMPLING_PAUSE,
    SLOWEST_CLOCK,
    WORD_PAUSE,
    property_command,
    property_text,
)
from tactbench.sensors.biotac.frames import DEFAULT_FRAME, BioTacOptions, FrameBatches, streams_of

PATIENCE_S = 0.5
"""Seconds (assumed) after the end of a batch until its reply counts as lost. USB and a busy host take less."""


class BioTacDriver(Driver):
    """Driver of one BioTac on an SPI bus.

    Parameters
    ----------
    settings
        The link is an SPI link; options are those of :class:`~tactbench.sensors.biotac.frames.BioTacOptions`.

    Raises
    ------
    UsageError
        If an option is unknown.
    RigError
        If the link is no SPI link, or its clock is out of a BioTac's range or too slow for the resends.
    LinkError
        If the link cannot be opened.
    """

    device, link_kind, address, options_kind = "biotac", SpiLink, "spi://bridge/PORT?speed_hz=4400000", BioTacOptions
    link: SpiLink
    options: BioTacOptions

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        self._counts: Counter[str] = Counter()
        self._running = False
        self._ahead = min(self.options.batches_ahead, self.link.holds)
        try:
            slowest, fastest = SLOWEST_CLOCK.to("Hz"), FASTEST_CLOCK.to("Hz")
            if not slowest <= self.link.speed_hz <= fastest:
                raise RigError(
                    f"{self.link.address} runs at {self.link.speed_hz} Hz; {slowest:g} to {fastest:g} Hz is expected "
                    "for a BioTac.",
                    hint="Choose speed_hz=4400000, or the adapter's next lower clock.",
                )
            self._set_up()
        except RigError:
            self.link.close()
            raise

    def _set_up(self) -> None:
        """Reset the driver to frame position 0 and no pending batches."""
        options = self.options
        self._batches = FrameBatches(
            options.frame,
            speed_hz=self.link.speed_hz,
            select=options.select,
            resends=options.resends,
            # About as many words as in the default frame: a batch for each short one would ask too much of a bridge.
            words=len(options.frame) * max(1, len(DEFAULT_FRAME) // len(options.frame)),
        )
        self._sent: deque[tuple[int, int]] = deque()
        self._skipped = 0
        self._last: tuple[int, int] | None = None
        self._received_ns = self.clock()

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The spec's streams, limited to the channels in the option `frame`, at that frame's rates."""
        rate_hz = COMMAND_RATE.to("Hz")
        source = Source(tag="derived", reference=f"{rate_hz:g} commands/s in frames of {len(self.options.frame)}")
        return streams_of(self.options.frame, rate_hz, source)

    @property
    def counts(self) -> Mapping[str, int]:
        """Numbers of faults by name and channel, as ``parity E7``; ``resent E7``: words without fault in a repetition.

        Further names are ``batches lost`` (without reply), ``batches late`` (begun more than a word's time after the
        end of the previous batch) and ``frames not requested`` (whose time passed in this pause).
        """
        return dict(self._counts + self._batches.counts)

    def identify(self) -> Mapping[str, str]:
        """Return serial number, flex version and software version as the maker's tools show them.

        Raises
        ------
        RigError
            If the serial number read does not begin with BT, or the sensor is sampling.
        LinkTimeout, LinkUnplugged, LinkError
            If the adapter does not answer.
        """
        if self._running:
            raise RigError(
                "A BioTac cannot be identified while it samples.", hint="Identify it before start, or after stop."
            )
        self._property("software version")  # thrown away, as the maker's library does
        found = {}
        for name in ("serial number", "flex version", "software version"):
            raw = self._property(name)
            text = property_text(name, raw)
            if text is None and name == "serial number":
                raise RigError(
                    f"No BioTac answers at {self.link.address}, select lines {self.options.select:#x}: the serial "
                    f"number was read as bytes {raw.hex(' ')}; a text that begins with BT is expected.",
                    hint="Check supply, wiring and the option `select`.",
                )
            found[name] = raw.hex(" ") if text is None else text
        if isinstance(self.link, SpiBridge):
            found["adapter"] = self.link.name
        return found

    def _property(self, name: str) -> bytes:
        select, pauses = self.options.select, (round(SAMPLING_PAUSE.to("us")), round(WORD_PAUSE.to("us")))
        data = (property_command(name), bytes(PROPERTIES[name][1]))
        number = self.link.send([SpiStep(part, select, pause) for part, pause in zip(data, pauses, strict=True)])
        while True:
            reply = self.link.receive(PATIENCE_S)
            if reply.number == number:
                return reply.data[1]

    def start(self) -> None:
        """Send the first batches; sequence numbers begin at 0, device times at the present count of the adapter."""
        if not self._running:
            self._counts = Counter(self.counts)
            self._set_up()
            self._running = True
            self._send()

    def _send(self) -> None:
        while len(self._sent) < self._ahead:
            first, steps = self._batches.next()
            self._sent.append((self.link.send(steps), first))

    def read(self, timeout_s: float) -> list[Block]:
        """Return the samples of the frames that have ended; see :class:`Driver`. When stopped, return an empty list.

        With an adapter that cannot run batches by itself, the call runs one and takes at least the batch's time.
        """
        if not self._running:
            return []
        for _ in range(self._ahead):
            self._send()
            try:
                reply = self.link.receive(timeout_s)
            except LinkTimeout:
                self._give_up_lost()
                break
            self._take(reply)
            timeout_s = 0.0
        return self._batches.blocks()

    def _give_up_lost(self) -> None:
        """Drop all pending batches if no reply has come for longer than they can take together."""
        due_ns = self._ahead * self._batches.timing(0)[1] + round(PATIENCE_S * 1e9)
        if self.clock() - self._received_ns > due_ns:
            self.link.abandon()
            self._counts["batches lost"] += len(self._sent)
            self._sent.clear()
            self._received_ns = self.clock()

    def _take(self, reply: SpiReply) -> None:
        """Take the rows of a batch from its reply; earlier batches that are still unanswered count as lost."""
        self._received_ns = self.clock()
        numbers = [number for number, _ in self._sent]
        if reply.number not in numbers:
            return
        for _ in range(numbers.index(reply.number)):
            self._sent.popleft()
            self._counts["batches lost"] += 1
        _, first = self._sent.popleft()
        device_ns = None if reply.device_us is None else 1000 * self._begun_us(reply.device_us, first)
        self._batches.take(first, reply.data, t_ns=reply.t_ns, device_ns=device_ns, skipped=self._skipped)

    def _begun_us(self, counter_us: int, first: int) -> int:
        """Return a batch's start [us] by the adapter's counter without wraps; count frames not requested before it."""
        begun_us = counter_us
        if self._last is not None:
            last_first, last_us = self._last
            begun_us = last_us + (counter_us - last_us) % 2**32
            word_us = 1e6 / COMMAND_RATE.to("Hz")
            late_us = begun_us - last_us - (first - last_first) * word_us
            if late_us > word_us:
                frames = round(late_us / (len(self._batches.frame) * word_us))
                self._counts["batches late"] += 1
                self._counts["frames not requested"] += frames
                self._skipped += frames * len(self._batches.frame)
        self._last = (first, begun_us)
        return begun_us

    def stop(self) -> None:
        """Wait for the replies to all pending batches and drop them."""
        if not self._running:
            return
        self._running = False
        with contextlib.suppress(LinkError):
            while self._sent:
                self.link.receive(PATIENCE_S)
                self._sent.popleft()
        self.link.abandon()
