"""Whether a place, or every place of a straight move, is permitted: reach, joint ranges, assembly mode, singularities.

Along a straight line (derived; x is the way along it):

- Rails: q_i is concave for branch 1 and convex for -1, s_i is concave, u_i.t_i affine. So reach, s, the sideways angle
  and one joint limit are decided at the two ends, and the other joint limit at one more place, the extremum of q_i:
  with rad(x) = C - V (x - x0)^2 and rail speed alpha it is at x0 + b alpha sqrt(C/(V (V + alpha^2))).
- Arms: places between two that are reached may be out of reach. u_i.t_i is still affine.
- Both: abs(du/dx) <= 1/(s L), so both sigma change by at most sqrt(sum 1/(s_i L_i)^2) per length; and
  abs(ds/dx) <= (1/L + k)/s with curvature k of the joint centre's path, so s^2 >= s0^2 - 2 (1/L + k) r within r.

So a sample speaks for its neighbourhood. Moves are halved until every piece is decided, or is `FINEST` of a link long:
what is accepted keeps its limits to a slack of about 1e-3 of a measure, and not only where it was sampled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import RigError
from tactbench.rigs.parallel_manipulator.geometry import Delta, LinearDelta
from tactbench.rigs.parallel_manipulator.kinematics import ROUNDING, solve_inverse
from tactbench.rigs.parallel_manipulator.singularity import PostureLimits, measures

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

COARSEST = 1 / 32
"""First pieces of a move, of the shortest link."""
FINEST = 2.0**-15
"""Shortest half piece, of the shortest link: 7 um of 220 mm, about the repeatability of such a machine."""

_LEGS = (1, 2, 3)
_COLUMNS: tuple[tuple[str, int | None], ...] = (
    *(("reach", leg) for leg in _LEGS),
    *(("lowest joint value", leg) for leg in _LEGS),
    *(("highest joint value", leg) for leg in _LEGS),
    ("assembly mode", None),
    *(("s", leg) for leg in _LEGS),
    ("sigma_U", None),
    ("sigma_W", None),
    *(("sideways angle", leg) for leg in _LEGS),
)
_REACH, _MODE = slice(0, 3), 9
_JOINTS, _S, _SIGMA, _SIDEWAYS = slice(3, 9), slice(10, 13), slice(13, 15), slice(15, 18)
_ALWAYS = np.array([name in ("reach", "assembly mode") for name, _ in _COLUMNS])


class PlaceRefusedError(RigError):
    """A place or a move is not permitted; nothing has moved.

    Attributes
    ----------
    measure
        What is not kept: `reach`, `lowest joint value`, `highest joint value`, `assembly mode`, `s`, `sigma_U`,
        `sigma_W` or `sideways angle`.
    leg
        Number of the leg, from 1; None: the measure is of all legs together.
    place_m
        The first such place on the way [m].
    value
        The worst value found on the way: m (reach: what is missing), rad (angles), m or rad (joints), else 1.
    limit
        What it is held against, in the same unit.
    """

    measure: str = ""
    leg: int | None = None
    place_m: tuple[float, ...] = ()
    value: float | None = None
    limit: float | None = None


@dataclass(frozen=True)
class _Examined:
    margin: FloatArray
    """(n, 18) what is left to each limit; below 0: not kept."""
    serial: FloatArray
    """(n, 3) abs(s_i)."""


class Workspace:
    """The places a machine may go to.

    Parameters
    ----------
    delta
        Its geometry.
    limits
        How near a singularity it may go.
    """

    def __init__(self, delta: Delta, limits: PostureLimits | None = None) -> None:
        self.delta = delta
        self.limits = limits or PostureLimits()
        low, high = delta.joint_range
        stated = self.limits
        self._limit = np.array(
            [*(0.0,) * 3, *low, *high, 0.0]
            + [stated.serial.to("1")] * 3
            + [stated.parallel.to("1"), stated.constraint.to("1")]
            + [stated.sideways.to("rad")] * 3
        )
        # What a measure must exceed has sign 1, what it must stay below -1.
        self._sign = np.array([-1.0 if name in ("reach", "highest joint value", "sideways angle") else 1.0
                               for name, _ in _COLUMNS])  # fmt: skip
        self._shortest = float(delta.link_m.min())

    def permits(self, p_m: FloatArray) -> FloatArray:
        """Return (n,) whether each of (n, 3) places [m] is permitted."""
        return np.asarray((self._examine(p_m).margin >= 0).all(axis=1))

    def check_place(self, p_m: FloatArray) -> None:
        """Raise PlaceRefusedError unless the place (3,) [m] is permitted."""
        place = np.asarray(p_m, dtype=np.float64)
        margin = self._examine(place[None]).margin[0]
        if (margin < 0).any():
            column = int(np.argmax(margin < 0))
            raise self._refusal(column, place, float(margin[column]), "is not permitted")

    def check_move(self, start_m: FloatArray, end_m: FloatArray) -> None:
        """Raise PlaceRefusedError unless the straight move between places (3,) [m] is permitted.

        A move that begins where a joint, a singularity measure or an angle is beyond its limit is a way out: it is
        permitted if that measure never falls further and ends nearer to its limit than it began.
        """
        start, end = np.asarray(start_m, dtype=np.float64), np.asarray(end_m, dtype=np.float64)
        where, margin = self._along(start, end)
        way_out = (margin[0] < 0) & ~_ALWAYS
        refused = []
        for column in np.flatnonzero((margin < 0).any(axis=0)).tolist():
            kept = margin[:, column]
            bad = kept < 0
            if way_out[column]:
                # Rounding of singular values and angles is some 1e-16; a move that stays as it is does not lead out.
                bad &= np.diff(kept, prepend=kept[0]) < -ROUNDING
                bad[-1] |= kept[-1] <= kept[0] + ROUNDING
            if bad.any():
                first = self._crossing(start, end, where, kept, int(np.argmax(bad)), column)
                refused.append((first, column, float(kept.min())))
        if refused:
            first, column, worst = min(refused)
            way = f"ends the permitted way from {_text(start)} to {_text(end)}"
            raise self._refusal(column, start + first * (end - start), worst, way)

    def _along(self, start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return fractions (n,) of the way and the margins (n, 18) there, which decide all that lies between."""
        way = end - start
        length = float(np.linalg.norm(way))
        ends = np.array([0.0, 1.0, *self._turns(start, way)])
        where, margins = [ends], [self._examine(start + ends[:, None] * way).margin]
        outside = (margins[0][0] < 0) & ~_ALWAYS
        count = math.ceil(length / (COARSEST * self._shortest))
        centre, half = (np.arange(count) + 0.5) / max(count, 1), 0.5 / max(count, 1)
        while centre.size:
            found = self._examine(start + centre[:, None] * way)
            slack = self._slack(found.serial, half * length)
            # On the way out, each step is looked at.
            decided = (found.margin >= slack) | ((found.margin < -slack) & ~outside)
            # Out of reach is refused wherever it begins; only its first place is looked for.
            reached = found.margin[:, _REACH].min(axis=1)
            done = decided.all(axis=1) | (reached < -half * length) | (half * length <= FINEST * self._shortest)
            where.append(centre[done])
            margins.append(found.margin[done])
            centre = (centre[~done, None] + np.array([-0.5, 0.5]) * half).ravel()
            half *= 0.5
        fractions, found_margins = np.concatenate(where), np.concatenate(margins)
        order = np.argsort(fractions, kind="stable")
        return fractions[order], found_margins[order]

    def _examine(self, p_m: FloatArray) -> _Examined:
        """Return the margins at (n, 3) places."""
        solved = solve_inverse(self.delta, p_m)
        found = measures(self.delta, p_m, solved.q)
        missing = solved.shortfall_m - ROUNDING * self.delta.link_m
        values = np.concatenate(
            [
                np.maximum(missing, 0.0), solved.q, solved.q, np.sign(found.det * self.delta.mode)[:, None],
                found.serial, found.parallel[:, None], found.constraint[:, None], found.sideways_rad,
            ], axis=1,
        )  # fmt: skip
        margin = self._sign * (values - self._limit)
        # Where a leg does not reach there is no posture to measure.
        margin[(missing > 0).any(axis=1), 3:] = np.inf
        return _Examined(margin, found.serial)

    def _slack(self, serial: FloatArray, radius_m: float) -> FloatArray:
        """Return (n, 18) by how much a margin may be less within `radius_m` of each sample; infinity: not known."""
        delta, rails = self.delta, isinstance(self.delta, LinearDelta)
        squared = serial**2 - 2 * (1 / delta.link_m + delta.bend_per_m) * radius_m
        known = (squared > 0).all(axis=1)
        least = np.sqrt(np.where(squared > 0, squared, 1.0))
        slack = np.zeros((len(serial), len(_COLUMNS)))
        if not rails:  # of rails, the ends and the turning points have decided
            slack[:, _JOINTS] = np.tile(radius_m / (delta.gear_m * least), 2)
            slack[:, _S] = serial - least
        slack[:, _SIGMA] = (radius_m * np.linalg.norm(1 / (least * delta.link_m), axis=1))[:, None]
        slack[~known] = np.inf
        return slack

    def _turns(self, start: FloatArray, way: FloatArray) -> FloatArray:
        """Return the fractions of the way at which carriages turn; arms: none are needed."""
        if not isinstance(self.delta, LinearDelta):
            return np.empty(0)
        rail, link = self.delta.rail, self.delta.link_m
        alpha = rail @ way
        beside = way - alpha[:, None] * rail
        w = start - self.delta.anchor_m
        w = w - np.einsum("ij,ij->i", w, rail)[:, None] * rail
        V = np.einsum("ij,ij->i", beside, beside)
        V = np.where((ROUNDING * link) ** 2 < V, V, np.inf)  # along the rail: it does not turn
        x0 = -np.einsum("ij,ij->i", w, beside) / V
        nearest = np.linalg.norm(w + x0[:, None] * beside, axis=1)
        C = np.maximum((link - nearest) * (link + nearest), 0.0)
        turn = x0 + self.delta.branch * alpha * np.sqrt(C / V / (V + alpha**2))
        return np.asarray(np.clip(turn, 0.0, 1.0))

    def _crossing(
        self, start: FloatArray, end: FloatArray, where: FloatArray, kept: FloatArray, index: int, column: int
    ) -> float:
        """Return the fraction of the way at which a margin is first lost, halved between two samples."""
        if index == 0 or kept[index - 1] < 0:
            return float(where[index])
        good, bad = float(where[index - 1]), float(where[index])
        for _ in range(30):
            middle = 0.5 * (good + bad)
            lost = self._examine((start + middle * (end - start))[None]).margin[0, column] < 0
            good, bad = (good, middle) if lost else (middle, bad)
        return bad

    def _refusal(self, column: int, place: FloatArray, margin: float, what: str) -> PlaceRefusedError:
        name, leg = _COLUMNS[column]
        limit = float(self._limit[column])
        value = limit + float(self._sign[column]) * margin
        of_leg = f" of leg {leg}" if leg else ""
        angle = name == "sideways angle" or (name.endswith("joint value") and not isinstance(self.delta, LinearDelta))
        length = name == "reach" or (name.endswith("joint value") and not angle)
        factor, unit = (180 / math.pi, " deg") if angle else (1e3, " mm") if length else (1.0, "")
        if name == "reach":
            problem = f"leg {leg} misses it by up to {factor * value:.3g}{unit}"
        elif name == "assembly mode":
            problem = "the links would stand on the other side of a singularity"
        else:
            problem = f"{name}{of_leg} comes to {factor * value:.3f}{unit}, its limit is {factor * limit:.3f}{unit}"
        error = PlaceRefusedError(
            f"{_text(place)} {what}: {problem}.",
            hint="Nothing was moved. Choose another place or another way.",
        )
        error.measure, error.leg, error.place_m = name, leg, tuple(float(x) for x in place)
        error.value, error.limit = value, limit
        return error


def _text(place: FloatArray) -> str:
    return "(" + ", ".join(f"{1e3 * x:.2f}" for x in place) + ") mm"
