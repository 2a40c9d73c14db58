"""Summaries of a channel over a window of a recording, which are features of recordings or frames."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.sensor import ChannelKind


class Summary(Frozen):
    """A number for each channel over a window, from the channel's own samples up to the window's end.

    Nothing is resampled: each stream is summarised on its own clock.
    """

    measure: Literal["mean", "deviation", "minimum", "maximum", "range", "change", "mean-step", "band-energy"]
    """``mean``; ``deviation``: standard deviation; ``range``: maximum less minimum; ``change``: last less first;
    ``mean-step``: mean absolute difference of neighbouring samples; ``band-energy``: mean square of what a causal
    band-pass (Butterworth, two poles at either end) leaves, in the channel's unit squared."""
    start: float = Field(default=0.0, ge=0)
    end: float = Field(default=1.0, gt=0)
    unit: Literal["recording", "s"] = "recording"
    """Unit of `start` and `end`: shares of each stream's samples, or seconds. Both count from the first sample that the
    protocol keeps; in a frame, they are shares of its length or seconds from its beginning."""
    band_hz: tuple[float, float] | None = None
    """Ends of the band of ``band-energy`` [Hz]; None for other measures."""
    kinds: tuple[ChannelKind, ...] = ()
    """Kinds of channels; empty: all that the task uses."""

    @model_validator(mode="after")
    def _one_window_one_band(self) -> Summary:
        if not self.start < self.end:
            raise ValueError("a window ends after it starts")
        if self.unit == "recording" and self.end > 1:
            raise ValueError("a window in shares of a recording ends at 1 at the latest; set unit: s for seconds")
        if (self.measure == "band-energy") != (self.band_hz is not None):
            raise ValueError("band_hz belongs to band-energy, which needs it")
        if self.band_hz and not 0 < self.band_hz[0] < self.band_hz[1]:
            raise ValueError("a band's lower end is above 0 Hz and below its upper end")
        return self

    @property
    def name(self) -> str:
        """Name in features and rows."""
        band = "" if self.band_hz is None else f" {self.band_hz[0]:g}-{self.band_hz[1]:g} Hz"
        whole = self.unit == "recording" and (self.start, self.end) == (0.0, 1.0)
        unit = "s" if self.unit == "s" else "of the recording"
        kinds = f" of {', '.join(self.kinds)}" if self.kinds else ""
        return f"{self.measure}{band}{'' if whole else f' {self.start:g}-{self.end:g} {unit}'}{kinds}"
