"""Driver of an iCub fingertip, which is read from its board on a CAN bus."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from typing import Literal, Self

from pydantic import Field, model_validator

from tactbench.plugin import Block, Source, StreamSpec
from tactbench.plugin.devices import (
    CanFrame,
    CanLink,
    Driver,
    DriverSettings,
    LinkError,
    LinkTimeout,
    LinkUnplugged,
    Options,
)
from tactbench.sensors.icub import STREAMS
from tactbench.sensors.icub.codec import (
    BoardSetup,
    Command,
    OldSetup,
    OldSetup2,
    Sample,
    SkinDecoder,
    Transmit,
    TriangleSetup,
    VersionRequest,
    command_frame,
    read_version,
    skin_id,
    to_block,
)

SETTLE_S = 0.5
"""Seconds between set-up and start, for the board to take its baseline [sourced: icub-main CanBusSkin.cpp]."""
ANSWER_S = 0.5
"""Seconds to wait for a board's version [assumed: a frame takes 0.14 ms, a full board's queue 4.3 ms]."""
MOST_FRAMES = 4096
"""Largest number of frames in one call of `read`, so that it returns even on a full bus (after 0.5 s)."""


class FingertipOptions(Options):
    """Options of one fingertip's driver: its triangle and board, and the board's settings.

    The set-up concerns the whole board: it disables the other triangles. The defaults are those of two robots'
    fingertips [sourced: robotology/robots-configuration, iCubGenova01 and iCubGenova04, left_arm…skinSpec.xml: board
    14, type 1, reading at rest 240, shift 0, offset 2000], except for the period: 50 ms there, here that of the
    sensor's spec, which no source shows in use.
    """

    board: int = Field(default=14, ge=0, le=14)
    triangle: int = Field(default=0, ge=0, le=15)
    skin_type: Literal[0, 1, 2, 8] = 1
    """Skin type, see :class:`~tactbench.sensors.icub.codec.BoardSetup`; not 3, which numbers triangles differently,
    and not 7, which sends no readings."""
    period_ms: int = Field(default=20, ge=1, le=255)
    """Milliseconds between the samples that the board sends."""
    no_load: int = Field(default=240, ge=1, le=254)
    """Reading at rest, counts; with 0 or 255 the board would flag every taxel as out of range."""
    shift: int = Field(default=0, ge=0, le=7)
    """Scale of the readings: one count is ``2**shift`` steps of the converter."""
    cdc_offset: int = Field(default=0x2000, ge=0, le=0xFFFF)
    """Offset of the capacitance converter, as the value of the AD7147's register."""
    old_setup: bool = False
    """Option for early firmware: set the board up by the old commands, and accept frames of class 3, too."""

    @model_validator(mode="after")
    def _only_what_is_sent(self) -> Self:
        """Raise an error for options absent from the old commands: type, and period (no source states its unit)."""
        if self.old_setup and self.model_fields_set & {"skin_type", "period_ms"}:
            raise ValueError("old_setup=true allows neither skin_type nor period_ms; leave them out")
        return self

    @property
    def period_s(self) -> float:
        """Seconds between samples; 0.04 for the old set-up, as in MTB4 firmware [sourced: icub-firmware]."""
        return 0.04 if self.old_setup else 1e-3 * self.period_ms

    @property
    def commands(self) -> tuple[Command, ...]:
        """Commands of the set-up, in order; then the board takes a baseline and waits, or sends after an old set-up.

        [sourced: icub-main CanBusSkin.cpp, except the first command, a stop, since the board may be sending]
        """
        if self.old_setup:
            halves = (OldSetup(cdc_offset=self.cdc_offset), OldSetup2(shift=self.shift, no_load=self.no_load))
            return (Transmit(on=False), *halves)
        return (
            Transmit(on=False),
            BoardSetup(self.skin_type, self.period_ms, self.no_load),
            TriangleSetup(self.triangle, self.triangle, self.shift, True, self.cdc_offset),
        )


class FingertipDriver(Driver):
    """Driver of one fingertip, which is one triangle of one board.

    Times are the frames' host times: the board sends no number and no time. A head (taxels 0 to 6) without tail (taxels
    7 to 11) is a sample by itself after the next head, or after a period without frames. Frames of other triangles,
    boards and hosts are counted and left out; the driver's own commands, which some buses return, are left out.

    Parameters
    ----------
    settings
        The link is a CanLink; the options are those of :class:`FingertipOptions`.

    Raises
    ------
    UsageError
        If an option is unknown or invalid, or the link is not a CanLink.
    LinkError
        If the link cannot be opened.
    """

    device, link_kind, address, options_kind = "icub", CanLink, "can://socketcan/can0", FingertipOptions
    link: CanLink
    options: FingertipOptions

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        options = self.options
        stream = next((one for one in settings.streams if one.name == STREAMS[0].name), STREAMS[0])
        rate = Source(tag="derived", reference=f"the board is set up for {1e3 * options.period_s:g} ms")
        self._stream = stream.model_copy(update={"rate_hz": 1 / options.period_s, "rate_source": rate})
        self._ids = {skin_id(options.board, options.triangle)}
        if options.old_setup:
            self._ids.add(skin_id(options.board, options.triangle, old=True))
        self._sent: set[tuple[int, bytes]] = set()
        self._sampling = False
        self._earlier: Counter[str] = Counter()
        """Numbers of faults by name, from before the last start."""
        self._others = 0
        self._decoder = self._fresh_decoder()

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The stream of the taxels, at the rate for which the board is set up."""
        return (self._stream,)

    @property
    def counts(self) -> Mapping[str, int]:
        """Numbers of faults by the decoder's names, of other senders' frames, and of frames without skin data."""
        return self._earlier + self._counted() + Counter({"frames of others": self._others}) + self.link.counts

    def identify(self) -> Mapping[str, str]:
        """Return board, triangle, and the firmware's version; a board with old firmware may not answer.

        Raises
        ------
        LinkTimeout
            If no node of the bus acknowledges (socketcan).
        LinkUnplugged
            If the adapter is gone.
        """
        options = self.options
        about = {"board": str(options.board), "triangle": str(options.triangle)}
        request = VersionRequest()
        self._send(request)
        until_ns = self.clock() + round(1e9 * ANSWER_S)
        while (left_s := 1e-9 * (until_ns - self.clock())) > 0:
            try:
                answer = read_version(self.link.receive(left_s))
            except LinkTimeout:
                break
            if answer is not None and answer[0] == options.board:
                version = answer[1]
                protocol = "{}.{}".format(*version.protocol)
                if not version.fits:
                    protocol += f" (not {request.major}.{request.minor}, which was requested)"
                model = "MTB4" if version.board_type == 11 else f"type {version.board_type}"
                return {**about, "model": model, "firmware": "{}.{}.{}".format(*version.firmware), "protocol": protocol}
        return {
            **about,
            "firmware": f"no answer within {ANSWER_S:g} s: old firmware has none, or there is no such board",
        }

    def start(self) -> None:
        """Set the board up, wait for its baseline (nothing may touch the skin) and start it.

        Raises
        ------
        LinkTimeout, LinkUnplugged
            For the reasons of :meth:`identify`. The board itself acknowledges no command.
        """
        self._earlier += self._counted()
        self._decoder = self._fresh_decoder()
        self._sampling = False
        for command in self.options.commands:
            self._send(command)
        until_ns = self.clock() + round(1e9 * SETTLE_S)
        while (left_s := 1e-9 * (until_ns - self.clock())) > 0:
            with suppress(LinkTimeout):
                self.link.receive(left_s)  # from before, or of the old set-up, which starts by itself
        self._send(Transmit(on=True))
        self._sampling = True

    def read(self, timeout_s: float) -> list[Block]:  # noqa: D102  (inherited)
        until_ns = self.clock() + round(1e9 * timeout_s)
        samples: list[Sample] = []
        for _ in range(MOST_FRAMES):
            left_s = 0.0 if samples else max(0.0, 1e-9 * (until_ns - self.clock()))
            try:
                frame = self.link.receive(left_s)
            except LinkTimeout:
                samples += self._decoder.flush(self.clock() - round(1e9 * self.options.period_s))
                break
            except LinkUnplugged:
                samples += self._decoder.flush()
                if not samples:
                    raise
                break  # the next call raises it
            samples += self._taken(frame)
        return [to_block(samples)] if samples else []

    def stop(self) -> None:  # noqa: D102  (inherited)
        if self._sampling:
            self._sampling = False
            self._decoder.flush()
            with suppress(LinkError):
                self._send(Transmit(on=False))

    def _fresh_decoder(self) -> SkinDecoder:
        return SkinDecoder(self.options.period_s, old_ids=self.options.old_setup)

    def _counted(self) -> Counter[str]:
        """Return the decoder's numbers of faults; the decoder receives frames of one triangle only."""
        found = Counter({"frames that are no skin data": self._decoder.foreign})
        for counts in self._decoder.counts.values():
            found.update(counts)
        return found

    def _send(self, command: Command) -> None:
        frame = command_frame(self.options.board, command)
        self._sent.add((frame.id, frame.data))
        self.link.send(frame)

    def _taken(self, frame: CanFrame) -> list[Sample]:
        """Return the samples that end with `frame`; count frames that are not the fingertip's."""
        if not self._sampling:
            return []
        if frame.id in self._ids and not frame.extended:
            return self._decoder.feed(frame)
        self._others += (frame.id, frame.data) not in self._sent
        return []
