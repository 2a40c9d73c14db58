"""A figure measured on real units of a sensor: what a model of it, or another unit, is held against."""

from __future__ import annotations

from pydantic import Field, model_validator

from tactbench.core.spec.quantity import Frozen, Source, Unit


class RealFigure(Frozen):
    """One statistic of real recordings, with the range in which real units and cases lie."""

    statistic: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    """What was computed, by a name the rig knows: ``largest-rise``."""
    condition: str = Field(pattern=r"^[a-z][a-z0-9-]*$")
    """In which family of scenes: ``rest``, ``plate`` …"""
    band: tuple[float, float] | None = None
    """Only states whose fluid pressure lies in this range above rest [counts of the dc_pressure channel]."""
    at: float | None = None
    """The statistic's argument where it has one: an averaging time [s]."""
    frequency: tuple[float, float] | None = None
    """Only what vibrates between these frequencies [Hz]."""
    channels: tuple[str, ...] = ()
    """The channels it is about; empty: all of its kind."""
    low: float
    """Lower end of the real range, included."""
    high: float
    """Upper end, included."""
    typical: float
    """The median, or the one value measured."""
    unit: Unit = "1"
    source: Source
    """What was measured, and where."""
    cause: str = ""
    """Why the sensor's model misses it, where it does and as far as it is known."""

    @model_validator(mode="after")
    def _in_order(self) -> RealFigure:
        if not self.low <= self.typical <= self.high:
            raise ValueError(
                f"{self.statistic}: low {self.low:g}, typical {self.typical:g} and high {self.high:g} must ascend"
            )
        return self

    @property
    def name(self) -> str:
        """Unique within a sensor's condition: ``largest-rise, 200-350 counts``."""
        parts = [self.statistic]
        if self.channels:
            parts.append(" ".join(self.channels))
        if self.at is not None:
            parts.append(f"at {self.at:g} s")
        if self.frequency is not None:
            parts.append(f"{self.frequency[0]:g}-{self.frequency[1]:g} Hz")
        if self.band is not None:
            parts.append(f"{self.band[0]:g}-{self.band[1]:g} counts")
        return ", ".join(parts)
