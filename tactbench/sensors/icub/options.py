"""Options of a fingertip in a rig file, and of a log of its bus."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from tactbench.plugin.devices import Options
from tactbench.sensors.icub.codec import BoardSetup, Command, OldSetup, OldSetup2, Transmit, TriangleSetup


class FingertipOptions(Options):
    """One fingertip: a triangle of a board, and how the board is set up.

    A set-up is the whole board's: its other triangles are disabled by it. The numbers by default are those of two
    robots' fingertips [sourced: robotology/robots-configuration, iCubGenova01 and iCubGenova04, left_arm…skinSpec.xml:
    board 14, type 1, reading at rest 240, shift 0, offset 2000], but for the period: 50 ms there, here that of the
    sensor's spec, which no source shows in use.
    """

    board: int = Field(default=14, ge=0, le=14)
    triangle: int = Field(default=0, ge=0, le=15)
    skin_type: Literal[0, 1, 2, 8] = 1
    """As of :class:`~tactbench.sensors.icub.codec.BoardSetup`; not 3, whose triangles are numbered anew, and not 7,
    which sends no readings."""
    period_ms: int = Field(default=20, ge=1, le=255)
    """Milliseconds between samples."""
    no_load: int = Field(default=240, ge=1, le=254)
    """Reading at rest, counts; at either end the board would call every taxel out of range."""
    shift: int = Field(default=0, ge=0, le=7)
    """One count is ``2**shift`` results of the converter."""
    cdc_offset: int = Field(default=0x2000, ge=0, le=0xFFFF)
    """Of the converter, as the AD7147 takes it."""
    old_setup: bool = False
    """Set the board up by the old messages, and take frames of class 3, too: for early firmware."""

    @model_validator(mode="after")
    def _only_what_is_sent(self) -> Self:
        """Refuse what the old messages do not carry: the type, and the period, for which no source states a unit."""
        if self.old_setup and self.model_fields_set & {"skin_type", "period_ms"}:
            raise ValueError("the old set-up has neither skin_type nor period_ms; leave them out")
        return self

    @property
    def period_s(self) -> float:
        """Seconds between samples; of the old set-up 40 ms, as MTB4 firmware takes it [sourced: icub-firmware]."""
        return 0.04 if self.old_setup else 1e-3 * self.period_ms

    @property
    def commands(self) -> tuple[Command, ...]:
        """Commands of the set-up, in order; then the board takes a baseline and, but for MTB4's old one, does not send.

        [sourced: icub-main CanBusSkin.cpp, but for the stop at the beginning: the board may be sending]
        """
        if self.old_setup:
            halves = (OldSetup(cdc_offset=self.cdc_offset), OldSetup2(shift=self.shift, no_load=self.no_load))
            return (Transmit(on=False), *halves)
        return (
            Transmit(on=False),
            BoardSetup(self.skin_type, self.period_ms, self.no_load),
            TriangleSetup(self.triangle, self.triangle, self.shift, True, self.cdc_offset),
        )


class LogOptions(Options):
    """Triangle of a log that is the fingertip, and what the log does not state."""

    board: int | None = Field(default=None, ge=0, le=14)
    """None: the only one in the log."""
    triangle: int | None = Field(default=None, ge=0, le=15)
    """None: the only one in the log."""
    period_ms: int | None = Field(default=None, ge=1, le=255)
    """Milliseconds between samples; None: the median interval of the log."""
    old_ids: bool = False
    """Also take frames of class 3, which early firmware sends and other analog sensors share."""
