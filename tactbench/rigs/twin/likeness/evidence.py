"""What statistics are computed from, whether a twin or somebody's sensor gave it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, NotApplicable
from tactbench.plugin.simulation import RealFigure

IntArray = npt.NDArray[np.int64]
LOADED_FROM = 10.0
"""Without a pressure channel: a fingertip counts as loaded when a taxel has moved by this many counts."""
MOVED_FROM = 3.0
"""Counts from which a channel is said to rise or to fall: seven times the noise, rounding included."""


@dataclass(frozen=True)
class Evidence:
    """Readings of one condition; counts. What is missing is empty or None."""

    channels: tuple[str, ...]
    rest: tuple[FloatArray, ...] = ()
    """(n, channels) untouched stretches, one a recording."""
    pressure_rest: tuple[FloatArray, ...] = ()
    """(n,) the fluid's pressure meanwhile."""
    vibration: tuple[FloatArray, ...] = ()
    """(n,) the fluid's vibration in this condition, one a recording, on its own clock."""
    vibration_hz: float | None = None
    """Rate of that clock."""
    change: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """(m, channels) loaded states less rest."""
    pressure: FloatArray | None = None
    """(m,) the fluid's pressure above rest."""
    unit: IntArray | None = None
    """(m,) which unit a state is of, where there are several: the fingertips of a hand."""
    angle_deg: FloatArray | None = None
    """(m, channels) between each channel's normal and the contact's direction."""
    released: FloatArray | None = None
    """(m, channels) what is left of `change` after its release."""
    dt_s: float | None = None
    """Between rows of `rest`; None without a clock."""
    one_session: bool = True
    """The stretches belong to one session."""

    def within(self, figure: RealFigure) -> npt.NDArray[np.bool_]:
        """Return (m,) which states lie in the figure's band.

        Raises
        ------
        NotApplicable
            If there is none, or no pressure to tell.
        """
        inside = np.ones(self.change.shape[0], dtype=np.bool_)
        if figure.band is not None:
            if self.pressure is None:
                raise NotApplicable("there is no channel of the fluid's pressure to order loads by")
            inside = (self.pressure >= figure.band[0]) & (self.pressure < figure.band[1])
        if not inside.any():
            raise NotApplicable("no state is loaded like that")
        return inside

    def states(self, figure: RealFigure) -> FloatArray:
        """Return the (m, channels) changes the figure is about."""
        change = self.change[self.within(figure)]
        if not figure.channels:
            return change
        missing = [name for name in figure.channels if name not in self.channels]
        if missing:
            raise NotApplicable(f"there is no channel {', '.join(missing)}")
        return change[:, [self.channels.index(name) for name in figure.channels]]
