"""Readings against load, solved at a few loads only.

Quasi-static contact depends on time through the force alone. So the skin is solved at adaptively chosen loads, all
wanted readings are kept, and a shape-preserving cubic between the nodes answers for every sample. Midpoints that
were solved to test an interval become nodes themselves; twice the largest difference they showed is the reported
bound.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactbench.plugin import FloatArray, SkinState
from tactbench.rigs.twin.contact.interpolant import Interpolant
from tactbench.rigs.twin.contact.press import AnyPress, scalars

_FIRST_NODES = 6
_POWER = 1.7
"""First nodes at ``j^1.7``: dense where a cap's contact grows fastest."""
_NARROWEST_N = 0.02
"""No interval narrower than this is split."""
_UNSEEN = 2.0
"""Safety of the reported bound: one midpoint per interval sees at least half of what a single bend in it can hide
at a quarter of its width."""
_TOUCH_DOWN_N = 0.01
"""How closely the load is bracketed at which the film closes."""


MOST_NODES = 16
"""Nodes after which refining ends. Past touch-down the readings step by a count or two as single cells meet the
core, whatever the interpolant: more nodes would follow the mesh, not the physics."""


class SkinCurves(NamedTuple):
    """The skin's scalars at (m,) loads."""

    depth_mm: FloatArray
    contact_radius_mm: FloatArray
    fluid_pressure_mpa: FloatArray


@dataclass(frozen=True)
class LoadTable:
    """Readings of one contact for any load from zero to the largest."""

    loads_n: FloatArray
    """(n,) nodes, the first at zero."""
    readings: FloatArray
    """(n, channels)"""
    states: tuple[SkinState, ...]
    """(n,) the skin at the nodes, without its fields."""
    touch_down_n: tuple[float, float] | None
    """Bracket of the load at which the core is touched; None when it never is."""
    error: FloatArray
    """(channels,) twice the largest difference between a solved reading and an interpolant it was no part of."""
    interpolant: Interpolant
    curves: Interpolant
    """Depth, contact radius and fluid pressure against load."""
    solves: int
    solved_s: float
    """Seconds spent on the skin; what reading it took is not among them."""

    @property
    def residual(self) -> float:
        """Largest residual of all nodes."""
        return max(state.residual for state in self.states)

    def __call__(self, force_n: FloatArray) -> FloatArray:
        """Return the (m, channels) readings at (m,) forces; forces beyond the table are held at its ends."""
        return self.interpolant(np.clip(force_n, 0.0, self.loads_n[-1]))

    def skin(self, force_n: FloatArray) -> SkinCurves:
        """Return what the skin as a whole does at (m,) forces, held at the table's ends like the readings."""
        depth, radius, pressure = self.curves(np.clip(force_n, 0.0, self.loads_n[-1])).T
        return SkinCurves(depth_mm=depth, contact_radius_mm=radius, fluid_pressure_mpa=pressure)


class _Builder:
    def __init__(self, press: AnyPress, read: Callable[[SkinState], FloatArray], clock: Callable[[], float]) -> None:
        self._press = press
        self._clock = clock
        self.read_s = 0.0
        self._read = read
        self.nodes: dict[float, tuple[SkinState, FloatArray]] = {}
        self.closed: dict[float, bool] = {}

    def node(self, force: float) -> FloatArray:
        if force not in self.nodes:
            state = self._press(force)
            began = self._clock()
            self.nodes[force] = (scalars(state), self._read(state))
            self.read_s += self._clock() - began
            self.closed[force] = force > 0 and self._press.closing_mm(state) > 0
        return self.nodes[force][1]

    def interpolant(self, touch_down: tuple[float, float] | None) -> Interpolant:
        return self._through([self.nodes[load][1] for load in sorted(self.nodes)], touch_down)

    def curves(self, touch_down: tuple[float, float] | None) -> Interpolant:
        return self._through([_scalars(self.nodes[load][0]) for load in sorted(self.nodes)], touch_down)

    def _through(self, values: list[FloatArray], touch_down: tuple[float, float] | None) -> Interpolant:
        loads = sorted(self.nodes)
        breaks = [] if touch_down is None else [loads.index(load) for load in touch_down]
        return Interpolant(np.array(loads), np.stack(values), breaks)


def _scalars(state: SkinState) -> FloatArray:
    return np.array([state.depth_mm, state.contact_radius_mm, state.fluid_pressure_mpa])


def build_table(
    press: AnyPress,
    read: Callable[[SkinState], FloatArray],
    *,
    largest_n: float,
    tolerance: FloatArray,
    most_nodes: int = MOST_NODES,
    clock: Callable[[], float] = time.perf_counter,
) -> LoadTable:
    """Solve and tabulate one contact.

    Parameters
    ----------
    press
        Solves the skin for one force.
    read
        The sensor's noise-free readings of a state: (channels,).
    largest_n
        Upper end of the table; a table of a scene without load has the rest state twice.
    tolerance
        (channels,) wanted bound on the interpolation error.
    most_nodes
        Nodes after which refining ends even if the bound is missed: the achieved one is reported.
    clock
        Seconds, monotonic.
    """
    began = clock()
    builder = _Builder(press, read, clock)
    if not largest_n > 0:
        rest = builder.node(0.0)
        flat = Interpolant(np.array([0.0, 1.0]), np.stack([rest, rest]))
        still = Interpolant(np.array([0.0, 1.0]), np.zeros((2, 3)))
        state = builder.nodes[0.0][0]
        return LoadTable(np.zeros(1), rest[None, :], (state,), None, np.zeros(rest.size), flat, still, 0, 0.0)
    for j in range(_FIRST_NODES):
        builder.node(largest_n * (j / (_FIRST_NODES - 1)) ** _POWER)
    touch_down = _bracket(builder, press)
    error = _refine(builder, press, touch_down, tolerance, most_nodes)
    loads = sorted(builder.nodes)
    return LoadTable(
        loads_n=np.array(loads),
        readings=np.stack([builder.nodes[load][1] for load in loads]),
        states=tuple(builder.nodes[load][0] for load in loads),
        touch_down_n=touch_down,
        error=error,
        interpolant=builder.interpolant(touch_down),
        curves=builder.curves(touch_down),
        solves=press.solves,
        solved_s=clock() - began - builder.read_s,
    )


def _bracket(builder: _Builder, press: AnyPress) -> tuple[float, float] | None:
    """Bracket touch-down and put a node on either side."""
    closed = [load for load in sorted(builder.nodes) if builder.closed[load]]
    if not closed:
        return None
    high = closed[0]
    below = [(load, press.closing_at(load)) for load in sorted(builder.nodes) if load < high][-2:]
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
        closing = press.closing_at(middle)
        if closing > 0:
            high = middle
        else:
            below = [below[-1], (middle, closing)]
    builder.node(low)
    builder.node(high)
    return low, high


def _refine(
    builder: _Builder,
    press: AnyPress,
    touch_down: tuple[float, float] | None,
    tolerance: FloatArray,
    most_nodes: int,
) -> FloatArray:
    """Test every interval at its midpoint, split the worst first; return the bound achieved.

    The bound of an interval is what its parent's midpoint showed before it became a node: the final interpolant,
    which has that node, does better wherever the readings are smooth.
    """
    loads = sorted(builder.nodes)
    untested = [pair for pair in itertools.pairwise(loads) if pair != touch_down]
    shown: dict[tuple[float, float], FloatArray] = {}

    def test(low: float, high: float, interpolant: Interpolant) -> None:
        middle = 0.5 * (low + high)
        difference = np.abs(builder.node(middle) - interpolant(np.array([middle]))[0])
        shown[low, middle] = shown[middle, high] = difference

    first = builder.interpolant(touch_down)
    for low, high in untested:
        test(low, high, first)
    while len(builder.nodes) < most_nodes:
        wide = {pair: d for pair, d in shown.items() if pair[1] - pair[0] > 2 * _NARROWEST_N}
        worst = max(wide, key=lambda pair: float(np.max(wide[pair] / tolerance)), default=None)
        if worst is None or np.all(wide[worst] <= tolerance):
            break
        del shown[worst]
        test(*worst, builder.interpolant(touch_down))
    bound: FloatArray = _UNSEEN * np.max(np.stack(list(shown.values())), axis=0)
    return bound
