"""Options of a BioTac in a rig file, and of a log of one."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field

from tactbench.plugin.devices import Options
from tactbench.sensors.biotac.codec import CHANNELS
from tactbench.sensors.biotac.frames import DEFAULT_FRAME


def _names(given: object) -> object:
    """Return a frame's names from a rig file's text."""
    names = tuple(given.replace(",", " ").split()) if isinstance(given, str) else given
    if isinstance(names, tuple) and (not names or set(names) - set(CHANNELS)):
        raise ValueError(f"names of channels, separated by blanks, were expected: {', '.join(CHANNELS)}")
    return names


class BioTacOptions(Options):
    """Of the driver and the emulator."""

    select: int = Field(default=1, ge=1, le=0xFF)
    """Mask of the select lines that are active while this sensor is addressed, line i being bit i. A board for several
    sensors may put numbers on its lines: 1, 2, 4 are the first three on the maker's [sourced: driver]."""
    frame: Annotated[tuple[str, ...], BeforeValidator(_names)] = DEFAULT_FRAME
    """Channels in the order of their commands, separated by blanks; 4400 commands a second whatever the frame."""
    resends: int = Field(default=0, ge=0, le=3)
    """Number of times that every word is requested again, so that words of bad parity can be replaced."""
    batch_words: int | None = Field(default=None, ge=1, le=1000)
    """Words in a batch; None: a frame. Fewer where a bridge takes only short batches: a word is 14 bytes of payload."""
    batches_ahead: int = Field(default=8, ge=2, le=16)
    """Batches under way at once, as far as the adapter holds them: so long may the host be late without a gap."""


class LogOptions(Options):
    """Of the reader of text logs."""

    sensor: int = Field(default=0, ge=0)
    """Index of the pair of columns, from 0."""
    rate_hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    """Commands a second, where the log does not state them."""
