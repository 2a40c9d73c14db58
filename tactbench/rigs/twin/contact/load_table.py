"""Tables of readings against load, solved at a few loads only.

Quasi-static contact depends on time only through the force. So the skin is solved at a few loads (nodes), and a
shape-preserving cubic between the nodes gives every sample. The reported error bound is the difference, at a node,
from an interpolant through all *other* nodes: its interval is twice as wide, and so its error is larger.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import SkinState
from tactbench.rigs.twin.contact.press import AnyPress, whole_skin

_SCOUTS = 4
_SCOUTS_POWER = 1.7
"""Exponent of the spacing of the first loads above 0 N, ``j^1.7``: they show roughly where a film closes."""
_INTERVALS = 6
"""Number of intervals between nodes of a load table in which the skin never touches the core."""
_INTERVALS_BELOW, _INTERVALS_ABOVE = 5, 4
"""Number of intervals below the load of touch-down on the core (dense at both ends), and above (dense at its start)."""
_LARGEST_GAP = 1.3
"""Width of a gap between nodes, in even intervals, above which the gap is split."""
_UNSEEN = 3.0
"""Safety factor of the reported error bound: where readings bend sharply, just above touch-down, the error between two
nodes was up to 2.4 times the largest difference found at a node."""
_NARROWEST_N = 0.02
"""Width [N] of an interval between nodes below which it is not split."""
_TOUCH_DOWN_N = 0.01
"""Width [N] of the bracket around the load at which the film closes."""


_SKIN = 3
"""Number of skin values (depth, contact radius, fluid pressure) before the readings in each row of a table."""


_ABOVE_POWER = 0.75
"""Exponent of the variable above touch-down, ``(F - F_td)^0.75``: with five nodes there, the rms error over caps of 5
to 40 mm is 0.05 to 0.12 counts, against 0.08 to 0.14 in F itself and 0.05 to 0.2 in the square root."""
_ROUNDING_N = 0.05
"""Offset [N] under the power of the load; without the offset the power's slope at the break would be infinite."""


def slopes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the (n, c) slopes, at (n,) nodes ``x``, of the interpolant of (n, c) values ``y``.

    Slopes of the cubic spline (not-a-knot ends), limited to three times the smaller neighbouring secant wherever both
    secants have one sign: monotone data give a monotone interpolant (Hyman 1983). On a BioTac's electrodes below
    touch-down the error at equal nodes is 2 to 13 times smaller than that of PCHIP, whose slopes are of second order.
    """
    from scipy.interpolate import CubicSpline

    secant = np.diff(y, axis=0) / np.diff(x)[:, None]
    d = CubicSpline(x, y)(x, 1)
    left = np.concatenate([secant[:1], secant])
    right = np.concatenate([secant, secant[-1:]])
    bound = 3 * np.minimum(np.abs(left), np.abs(right))
    limited = np.where(left > 0, np.clip(d, 0.0, bound), np.clip(d, -bound, 0.0))
    return np.where(left * right > 0, limited, np.where(left * right < 0, d, 0.0))


class Interpolant:
    """Piecewise cubic interpolation of (n, c) values over (n,) ascending loads, n >= 2.

    `touch_down` (two of the loads; None: no such loads) are nodes where one spline ends and the next begins. Beyond the
    second the cubics' variable is ``(load - second load)^0.75``, rounded off; elsewhere it is the load itself.
    """

    def __init__(
        self, loads: Sequence[float], values: Sequence[FloatArray], touch_down: tuple[float, float] | None = None
    ) -> None:
        from scipy.interpolate import CubicHermiteSpline, PPoly

        self.loads = np.array(loads)
        last = self.loads.size - 1
        breaks = [last] if touch_down is None else [loads.index(load) for load in touch_down]
        self._bent_from = float(loads[breaks[-1]])
        self._x = self._bent(self.loads)
        edges, table = sorted({0, *breaks, last}), np.stack(values)
        parts = [slice(low, high + 1) for low, high in itertools.pairwise(edges)]
        cubics = [
            CubicHermiteSpline(self._x[part], table[part], slopes(self._x[part], table[part])).c for part in parts
        ]
        self._cubics = PPoly(np.concatenate(cubics, axis=1), self._x)

    def __call__(self, load: FloatArray) -> FloatArray:
        """Return the (m, c) values at (m,) loads within the nodes' range."""
        return np.asarray(self._cubics(self._bent(load)))

    def steepest(self, low: float, high: float) -> FloatArray:
        """Return (c,) upper bounds of the absolute slopes between two loads within the nodes' range.

        The bounds hold for whole intervals. A cubic's slope is a parabola, steepest at an end or at the vertex. Where
        the variable is a power of the load, the factor between the two slopes is monotone: its larger end bounds it.
        """
        first, last = np.searchsorted(self.loads, [low, high], side="right") - 1
        at = np.arange(min(first, self.loads.size - 2), min(last, self.loads.size - 2) + 1)
        d, c, b, _ = self._cubics.c[:, at]
        end = np.diff(self._x)[at][:, None]
        vertex = np.clip(-c / np.where(d != 0, 3 * d, np.inf), 0.0, end)
        parabola = [np.abs(b + t * (2 * c + 3 * d * t)) for t in (0.0, vertex, end)]
        factor = np.maximum(self._stretch(self.loads[at]), self._stretch(self.loads[at + 1]))[:, None]
        out: FloatArray = (np.maximum.reduce(parabola) * factor).max(axis=0)
        return out

    def _stretch(self, load: FloatArray) -> FloatArray:
        """Return the (m,) derivatives, with respect to the load, of the variable of the cubics."""
        beyond = load - self._bent_from
        bent = _ABOVE_POWER * (np.maximum(beyond, 0.0) + _ROUNDING_N) ** (_ABOVE_POWER - 1.0)
        if self._bent_from == self.loads[-1]:
            return np.ones_like(load)
        # At the break itself either side may be meant: the steeper.
        return np.where(beyond < 0, 1.0, np.where(beyond > 0, bent, np.maximum(bent, 1.0)))

    def _bent(self, load: FloatArray) -> FloatArray:
        """Return the variable of the cubics: the load up to the break, then the break's load plus the bent distance."""
        beyond = np.maximum(load - self._bent_from, 0.0)
        bent = (beyond + _ROUNDING_N) ** _ABOVE_POWER - _ROUNDING_N**_ABOVE_POWER
        return np.asarray(np.minimum(load, self._bent_from) + bent)


class SkinCurves(NamedTuple):
    """Depth, contact radius and fluid pressure of the skin at (m,) loads."""

    depth_mm: FloatArray
    contact_radius_mm: FloatArray
    fluid_pressure_mpa: FloatArray


@dataclass(frozen=True)
class LoadTable:
    """Readings of one contact for any load from zero to the largest."""

    loads_n: FloatArray
    """(n,) loads at which the skin was solved, the first 0 N."""
    readings: FloatArray
    """(n, channels) readings at the solved loads."""
    depth_mm: float
    """Depth of the indenter under the largest load."""
    residual: float
    """Largest relative residual of the solutions at all nodes."""
    touch_down_n: tuple[float, float] | None
    """Two loads [N] between which the skin first touches the core; None if it never touches the core."""
    error: FloatArray
    """(channels,) three times the largest difference of a solved reading from the interpolant through the others."""
    interpolant: Interpolant
    """Interpolant over load [N] of depth, contact radius and fluid pressure, followed by the readings."""

    def __call__(self, force_n: FloatArray) -> FloatArray:
        """Return the (m, channels) readings at (m,) forces; forces beyond the table are held at its ends."""
        return self.interpolant(np.clip(force_n, 0.0, self.loads_n[-1]))[:, _SKIN:]

    def steepest(self, low_n: float, high_n: float) -> FloatArray:
        """Return (channels,) upper bounds of the readings' absolute slopes, per newton, between two forces.

        Forces beyond the table are replaced by its ends.
        """
        low, high = np.clip([low_n, high_n], 0.0, self.loads_n[-1])
        return self.interpolant.steepest(float(low), float(high))[_SKIN:]

    def per_mm(self, of: Callable[[FloatArray], FloatArray], force_n: FloatArray) -> FloatArray:
        """Return the (n, k) slopes per mm of depth, at (n,) forces, of a function `of` force, from 50 chords."""
        nodes = np.linspace(0.0, float(self.loads_n[-1]), 51)
        deeper = np.diff(self.skin(nodes).depth_mm)
        risen = np.diff(of(nodes), axis=0)
        chords = np.divide(risen.T, deeper, out=np.zeros_like(risen.T), where=deeper > 0)
        middles = 0.5 * (nodes[1:] + nodes[:-1])
        return np.column_stack([np.interp(force_n, middles, chord) for chord in chords])

    def skin(self, force_n: FloatArray) -> SkinCurves:
        """Return depth, contact radius and fluid pressure at (m,) forces, held at the ends of the table."""
        return SkinCurves(*self.interpolant(np.clip(force_n, 0.0, self.loads_n[-1])).T[:_SKIN])


def build_table(
    press: AnyPress,
    read: Callable[[SkinState], FloatArray],
    *,
    largest_n: float,
    tolerance: FloatArray,
    most_nodes: int = 14,
) -> LoadTable:
    """Solve and tabulate the (channels,) readings of one contact up to `largest_n`; for 0 N, two equal rows at rest.

    `tolerance` (channels,) is the wanted bound on the interpolation error; refinement ends at `most_nodes` nodes even
    if the bound is larger. The table states the achieved bound.
    """
    builder = _Builder(press, read)
    builder.node(0.0)
    if not largest_n > 0:
        rest = builder.nodes[0.0]
        flat = Interpolant([0.0, 1.0], [rest, rest])
        return LoadTable(np.zeros(1), rest[None, _SKIN:], 0.0, 0.0, None, np.zeros(rest.size - _SKIN), flat)
    for j in range(1, _SCOUTS + 1):
        builder.node(largest_n * (j / _SCOUTS) ** _SCOUTS_POWER)
    builder.bracket_touch_down()
    builder.fill(largest_n)
    error = builder.refine(tolerance, most_nodes)
    loads = sorted(builder.nodes)
    return LoadTable(
        loads_n=np.array(loads),
        readings=np.stack([builder.nodes[load][_SKIN:] for load in loads]),
        depth_mm=float(builder.nodes[largest_n][0]),
        residual=builder.residual,
        touch_down_n=builder.touch_down,
        error=error,
        interpolant=builder.interpolant(loads),
    )


class _Builder:
    """Nodes of a table, and the two nodes [N] between which the skin first touches the core (None: it never does)."""

    def __init__(self, press: AnyPress, read: Callable[[SkinState], FloatArray]) -> None:
        self._press = press
        self._read = read
        self.nodes: dict[float, FloatArray] = {}
        """Load [N] -> depth, contact radius and fluid pressure, followed by the readings."""
        self.residual = 0.0
        self.touch_down: tuple[float, float] | None = None

    def node(self, force: float) -> None:
        if force not in self.nodes:
            state = self._press(force)
            self.nodes[force] = np.concatenate([whole_skin(state), self._read(state)])
            self.residual = max(self.residual, state.residual)

    def interpolant(self, loads: list[float]) -> Interpolant:
        return Interpolant(loads, [self.nodes[load] for load in loads], self.touch_down)

    def bracket_touch_down(self) -> None:
        closing = self._press.closing_at
        below, high = [], None
        for load in sorted(self.nodes):
            if (at := closing(load)) > 0:
                high = load
                break
            below.append((load, at))
        if high is None:
            return
        margin = 0.4 * _TOUCH_DOWN_N
        for step in itertools.count(1):
            low, at_low = below[-1]
            if high - low <= _TOUCH_DOWN_N:
                break
            middle = 0.5 * (low + high)
            if step % 3 and len(below) > 1 and at_low > below[-2][1]:
                # Straight on from below, where the closing is smooth: above, the core already holds the skin back.
                root = low - at_low * (low - below[-2][0]) / (at_low - below[-2][1])
                middle = root + margin if high > root + 2 * margin else root - margin
                middle = min(max(middle, low + margin), high - margin)
            if (at := closing(middle)) > 0:
                high = middle
            else:
                below.append((middle, at))
        self.touch_down = low, high
        for load in self.touch_down:
            self.node(load)

    def fill(self, largest_n: float) -> None:
        """Split the widest gaps between nodes, below and above touch-down, until their spacing is nearly even."""
        if self.touch_down is None:
            self._split_gaps(0.0, largest_n, _INTERVALS, 0.5)
            return
        low, high = self.touch_down
        self._split_gaps(0.0, low, _INTERVALS_BELOW, None)
        if largest_n - high > _NARROWEST_N:
            self._split_gaps(high, largest_n, _INTERVALS_ABOVE, 1 / 1.5)

    def _split_gaps(self, start: float, end: float, intervals: int, power: float | None) -> None:
        """Add nodes from `start` to `end` N, spaced evenly in ``share^power``, or (None) in the angle of a half circle.

        As many pieces as fit are cut from the widest gap, the first of them at once: an odd gap is not halved unevenly
        again and again.
        """

        def place(load: float) -> float:
            share = min(max((load - start) / (end - start), 0.0), 1.0)
            return math.acos(1 - 2 * share) / math.pi if power is None else float(share**power)

        while True:
            places = [place(load) for load in sorted(self.nodes) if start <= load <= end]
            width, left = max((right - left, left) for left, right in itertools.pairwise(places))
            if width * intervals <= _LARGEST_GAP:
                return
            at = left + width / max(2, round(width * intervals))
            share = (1 - math.cos(math.pi * at)) / 2 if power is None else at ** (1 / power)
            self.node(start + (end - start) * share)

    def refine(self, tolerance: FloatArray, most_nodes: int) -> FloatArray:
        """Add nodes beside the node of largest error until all errors are within `tolerance`; return their bound."""
        while True:
            loads = sorted(self.nodes)
            fixed = {loads[0], loads[-1], *(self.touch_down or ())}
            missed = {}
            for load in set(loads) - fixed:
                others = self.interpolant([other for other in loads if other != load])
                missed[load] = np.abs(self.nodes[load] - others(np.array([load]))[0])[_SKIN:]
            if not missed:
                return np.zeros(tolerance.size)
            bound: FloatArray = _UNSEEN * np.max(np.stack(list(missed.values())), axis=0)
            gaps = []
            for load, difference in missed.items():
                k = loads.index(load)
                low, high = max(((loads[k - 1], load), (load, loads[k + 1])), key=lambda pair: pair[1] - pair[0])
                if high - low > 2 * _NARROWEST_N and (low, high) != self.touch_down:
                    gaps.append((float(np.max(difference / tolerance)), low, high))
            if len(loads) >= most_nodes or np.all(bound <= tolerance) or not gaps or _UNSEEN * max(gaps)[0] <= 1.0:
                return bound
            _, low, high = max(gaps)
            self.node(0.5 * (low + high))
