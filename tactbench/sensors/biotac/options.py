"""Options of the BioTac's driver in a rig file, and of the reader of a BioTac's text log."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field

from tactbench.plugin.devices import Options
from tactbench.sensors.biotac.codec import CHANNELS
from tactbench.sensors.biotac.frames import DEFAULT_FRAME


def _names(given: object) -> object:
    """Return the channel names of a frame, given as text in a rig file."""
    names = tuple(given.replace(",", " ").split()) if isinstance(given, str) else given
    if isinstance(names, tuple) and (not names or set(names) - set(CHANNELS)):
        raise ValueError(f"names of channels, separated by blanks, are expected: {', '.join(CHANNELS)}")
    return names


class BioTacOptions(Options):
    """Options of the BioTac's driver and emulator."""

    select: int = Field(default=1, ge=1, le=0xFF)
    """Mask of the select lines that are active while this sensor is addressed; line i is bit i. On the maker's board
    for several sensors 1, 2 and 4 select the first three [sourced: driver]."""
    frame: Annotated[tuple[str, ...], BeforeValidator(_names)] = DEFAULT_FRAME
    """Channels in the order of their commands, separated by blanks; 4400 commands a second whatever the frame."""
    resends: int = Field(default=0, ge=0, le=3)
    """Number of times that every word is requested again, so that words of wrong parity can be replaced."""
    batch_words: int | None = Field(default=None, ge=1, le=1000)
    """Words in a batch; None: one frame. Reduce for a bridge with a short buffer: a word is 14 bytes of payload."""
    batches_ahead: int = Field(default=8, ge=2, le=16)
    """Number of batches sent ahead, as far as the adapter can store them: the host may be late by their duration."""


class LogOptions(Options):
    """Options of the reader of the BioTac's text logs."""

    sensor: int = Field(default=0, ge=0)
    """Index, from 0, of the sensor: each has one pair of columns (value, parity) in the log."""
    rate_hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    """Sampling commands per second, needed if the log does not state this rate."""
