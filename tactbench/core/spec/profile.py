"""Profiles of a recording's normal force over time: a ramp, or a path of straight pieces."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise, takewhile
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from tactbench.core.spec.quantity import Frozen, Quantity, Source, assumed, sourced

PAPER = "Karl et al. 2016, ML-based tactile sensor calibration"


class ForceRamp(Frozen):
    """A ramp: the force stays at its start for `hold_s` and then rises linearly to its end."""

    kind: Literal["ramp"] = "ramp"
    start: Quantity = sourced(0.0, "N", PAPER)
    end: Quantity = sourced(5.0, "N", PAPER)
    hold: Quantity = assumed(7.2, "s", "the paper's first 600 samples: only the initialization of the setup")
    duration: Quantity = sourced(60.0, "s", PAPER)
    """Duration of the whole recording, including the hold [time]."""
    samples: int = Field(default=5000, ge=1)
    """Number of samples of the reference clock in the whole recording."""

    @property
    def largest_n(self) -> float:
        """The largest force of the profile [N]."""
        return max(self.start.to("N"), self.end.to("N"))

    @property
    def hold_s(self) -> float:
        """Time for which the force stays at its start, at most the duration of the recording [s]."""
        return min(self.hold.to("s"), self.duration.to("s"))

    @property
    def corners(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Times [s] and forces [N] of the corners between which the force is linear in time."""
        start, end, duration = self.start.to("N"), self.end.to("N"), self.duration.to("s")
        if self.hold_s >= duration:
            return (0.0, duration), (start, start)
        return (0.0, self.hold_s, duration), (start, start, end)


class ForcePath(Frozen):
    """A force profile that is linear between given points, as for presses, taps and ripples."""

    kind: Literal["path"] = "path"
    times_s: tuple[float, ...] = Field(min_length=2)
    """Times of the points, (k,), ascending from 0 [s]; the last is the end of the recording."""
    forces_n: tuple[Annotated[float, Field(ge=0)], ...]
    """Forces at the points, (k,) [N]."""
    samples: int = Field(ge=1)
    """Number of samples of the reference clock over the whole recording."""
    source: Source

    @model_validator(mode="after")
    def _runs(self) -> ForcePath:
        if len(self.times_s) != len(self.forces_n):
            raise ValueError("times_s and forces_n must have equal lengths, one force for each time")
        if self.times_s[0] != 0 or any(b <= a for a, b in pairwise(self.times_s)):
            raise ValueError("the times of a force path must ascend and begin at 0 s")
        return self

    @property
    def duration(self) -> Quantity:
        """Duration of the whole recording, the last of the times."""
        return Quantity(value=self.times_s[-1], unit="s", source=self.source)

    @property
    def largest_n(self) -> float:
        """The largest force of the profile [N]."""
        return max(self.forces_n)

    @property
    def hold_s(self) -> float:
        """Time for which the force stays at its start value [s]."""
        points = zip(self.times_s, self.forces_n, strict=True)
        return max(time for time, _ in takewhile(lambda point: point[1] == self.forces_n[0], points))

    @property
    def corners(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Times [s] and forces [N] of the points between which the force is linear in time."""
        return self.times_s, self.forces_n


def _profile_kind(given: Any) -> str:
    """Return the name of a profile's kind, by default `ramp`."""
    return str(given.get("kind", "ramp") if isinstance(given, Mapping) else getattr(given, "kind", "ramp"))


ForceProfile = Annotated[
    Annotated[ForceRamp, Tag("ramp")] | Annotated[ForcePath, Tag("path")], Discriminator(_profile_kind)
]
"""Any profile of the normal force, a ramp or a path."""
