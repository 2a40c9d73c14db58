"""Whether a place, or every place of a straight move, is permitted: reach, joint ranges, assembly mode, singularities.

Along a straight line (derived) reach, s and the sideways angle are concave or affine, so the ends decide; a joint value
turns at one place at most, and abs(du/dx) <= 1/(s L), so sigma_U and sigma_W change by at most sqrt(3)/(s L) per
length. A move is sampled every `SAMPLE_M`, and must keep between its samples what this bound permits to be lost there.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from tactbench.plugin import RigError
from tactbench.rigs.parallel_manipulator.kinematics import ROUNDING, LinearDelta, measures, solve_inverse

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

SAMPLE_M = 0.2e-3
"""Distance of samples along a move; with s = 0.15 and L = 250 mm sigma may be less by 0.005 between two of them."""

_COLUMNS = (
    *(f"reach of leg {leg}" for leg in (1, 2, 3)),
    *(f"lowest joint value of leg {leg}" for leg in (1, 2, 3)),
    *(f"highest joint value of leg {leg}" for leg in (1, 2, 3)),
    "assembly mode",
    *(f"s of leg {leg}" for leg in (1, 2, 3)),
    "sigma_U",
    "sigma_W",
    *(f"sideways angle of leg {leg}" for leg in (1, 2, 3)),
)
_LEAVABLE = np.array([not name.startswith(("reach", "assembly")) for name in _COLUMNS])
_Measure = Annotated[FiniteFloat, Field(ge=0.01, lt=1)]


class PlaceRefusedError(RigError):
    """A place or a move is not permitted; nothing has moved."""


class Postures(BaseModel):
    """How near a singularity the manipulator may go."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    serial: _Measure = 0.15
    """Least s of any leg (assumed: joint speeds grow to at most 7 times)."""
    parallel: _Measure = 0.15
    """Least sigma_U (assumed)."""
    constraint: _Measure = 0.15
    """Least sigma_W (assumed)."""
    sideways_deg: Annotated[FiniteFloat, Field(gt=0, lt=90)] = 30.0
    """Largest angle of a link out of its leg's plane (assumed: rod ends of ordinary size)."""


class Workspace:
    """The places a machine may go to.

    Parameters
    ----------
    delta
        Its geometry.
    postures
        How near a singularity it may go.
    """

    def __init__(self, delta: LinearDelta, postures: Postures | None = None) -> None:
        self.delta, self.postures = delta, postures or Postures()

    def margins(self, p_m: FloatArray) -> FloatArray:
        """Return (n, 18) what is left to each limit at (n, 3) places [m]: m, rad or 1; below 0: not kept."""
        delta, limits = self.delta, self.postures
        q, shortfall = solve_inverse(delta, p_m)
        found = measures(delta, p_m, q)
        low, high = delta.joint_range
        return np.concatenate(
            [
                ROUNDING * delta.link_m - shortfall, q - low, high - q, (found.det * delta.mode)[:, None],
                found.serial - limits.serial, (found.parallel - limits.parallel)[:, None],
                (found.constraint - limits.constraint)[:, None], math.radians(limits.sideways_deg) - found.sideways_rad,
            ], axis=1,
        )  # fmt: skip

    def check_place(self, p_m: FloatArray) -> None:
        """Raise PlaceRefusedError unless the place (3,) [m] is permitted."""
        self.check_move(p_m, p_m)

    def check_move(self, start_m: FloatArray, end_m: FloatArray) -> None:
        """Raise PlaceRefusedError unless the straight move between places (3,) [m] is permitted.

        A move that begins where a joint, a singularity measure or an angle is beyond its limit is a way out: it is
        permitted if that measure never falls further and ends nearer to its limit than it began.
        """
        start, end = np.asarray(start_m, dtype=np.float64), np.asarray(end_m, dtype=np.float64)
        length = float(np.linalg.norm(end - start))
        count = math.ceil(length / SAMPLE_M) + 1
        places = start + np.linspace(0.0, 1.0, max(count, 1))[:, None] * (end - start)
        margin = self.margins(places)
        # The turning point of a joint value lies within half a sample; s L bounds how far it goes there.
        slack = np.zeros(len(_COLUMNS))
        if length > 0:
            half = 0.5 * length / (count - 1)
            least = max(float(margin[:, 10:13].min()) + self.postures.serial, self.postures.serial)
            shortest = float(self.delta.link_m.min())
            slack[3:9] = half**2 / (2 * least**3 * shortest)
            slack[13:15] = math.sqrt(3.0) * half / (least * shortest)
        leaving = (margin[0] < slack) & _LEAVABLE
        worse = np.diff(margin, axis=0, prepend=margin[:1]) < -ROUNDING
        worse[-1] |= margin[-1] <= margin[0] + ROUNDING
        bad = np.where(leaving, worse, margin < np.where(_LEAVABLE, slack, 0.0))
        if bad.any():
            row = int(np.argmax(bad.any(axis=1)))
            column = int(np.argmax(bad[row]))
            place = ", ".join(f"{1e3 * x:.2f}" for x in places[row])
            raise PlaceRefusedError(
                f"({place}) mm is not permitted: the {_COLUMNS[column]} is beyond its limit by "
                f"{_shown(column, -float(margin[:, column].min()))}.",
                hint="Nothing was moved. Choose another place or another way.",
            )


def _shown(column: int, value: float) -> str:
    if column < 9:
        return f"{1e3 * value:.3g} mm"
    return f"{math.degrees(value):.3g} deg" if column >= 15 else f"{value:.3g}"
