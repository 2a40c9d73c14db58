"""Options of an iCub fingertip's driver in a rig file, and of the reader of its CAN log."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from tactbench.plugin.devices import Options
from tactbench.sensors.icub.codec import BoardSetup, Command, OldSetup, OldSetup2, Transmit, TriangleSetup


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
        """Commands of the set-up, in order; then the board takes a baseline and waits (old set-up of MTB4: sends).

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
    """Options of the log reader: the fingertip's board and triangle, and whether early firmware was in use."""

    board: int | None = Field(default=None, ge=0, le=14)
    """Number of the board; None: the only board in the log."""
    triangle: int | None = Field(default=None, ge=0, le=15)
    """Number of the fingertip's triangle on the board; None: the only triangle in the log."""
    old_ids: bool = False
    """Accept frames of class 3, too, which early firmware sends, but other analog sensors as well."""
