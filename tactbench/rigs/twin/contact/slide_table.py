"""Change of the readings of one contact by a tangential force, tabulated over both forces.

The traction of a contact pressed by P that carries Q along a slide is, after Cattaneo and Mindlin in the general form
of Ciavarella (1998) and Jaeger (1998), the difference of two contacts without friction:

    q = A p(P) - B p(P*),    P* = (c/a)³ P the load inside the part that sticks,    A P - B P* = Q

A = B = mu after a first push; a contact that slips as a whole has B = 0. A push after a slip lies between the two:
``q = Q/P p(P) + b mu [(P*/P) p(P) - p(P*)]`` with b from 0 to 1, a share of the pressure plus b times the rest of a
first push's traction. The readings are composed likewise: exactly for b = 0 and b = 1, and for every b if they are
linear in traction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import Skin, SkinState
from tactbench.rigs.twin.contact.interpolant import Interpolant
from tactbench.rigs.twin.contact.load_table import LoadTable
from tactbench.rigs.twin.contact.press import AnyPress
from tactbench.rigs.twin.contact.tangential import Direction, TangentialResponse, tangential_of

_SHARES = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
"""Shares of mu P carried by a traction proportional to the pressure; a share of 0 changes nothing."""
_PUSHES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
"""Shares of mu P carried after a first push; for 0 and 1 this traction, too, is proportional to the pressure."""


def traction_shares(
    force_n: FloatArray, tangential_n: FloatArray, stick_ratio: FloatArray, friction: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Q/(mu P), P*/P and b at (n,) moments.

    b is bounded such that no traction exceeds mu times the pressure.
    """
    limit = friction * force_n
    share = np.clip(np.divide(tangential_n, limit, out=np.zeros_like(limit), where=limit > 0), -1.0, 1.0)
    inner = np.where(limit > 0, stick_ratio, 0.0) ** 3
    b = np.divide(1.0 - share, inner, out=np.zeros_like(share), where=inner > 0)
    return share, inner, np.minimum(b, 1.0)


def dragged_state(
    state: SkinState,
    inner: SkinState,
    along: TangentialResponse,
    direction: Direction,
    outer_by: float,
    inner_by: float,
) -> SkinState:
    """Return `state` with the traction ``outer_by p(state) - inner_by p(inner)`` in `direction` and its displacement.

    Where more load has lowered the pressure (in a shell's dent, at a cover's edge), the inner pressure is limited to
    the lower one and scaled elsewhere to keep its force: friction cannot hold a place without pressure.
    """
    touched, inner_mpa = state.pressure_mpa > 0, np.minimum(inner.pressure_mpa, state.pressure_mpa)
    if inner_mpa.any():
        inner = replace(inner, pressure_mpa=inner_mpa * (inner.pressure_mpa.sum() / inner_mpa.sum()))
    shear = np.multiply.outer(np.array(direction), outer_by * state.pressure_mpa - inner_by * inner.pressure_mpa)
    moved = along.pressed(state) + outer_by * along.dragged(state, direction, touched)
    if inner_by:
        moved -= inner_by * along.dragged(inner, direction, touched)
    return replace(state, tangential_displacement_mm=moved, shear_mpa=shear)


@dataclass(frozen=True)
class SlideTable:
    """Change of the readings by a slide in one direction over one surface."""

    friction: float
    """Static friction coefficient mu."""
    proportional: Interpolant
    """(m,) loads -> (m, shares * channels) changes of the readings by a traction proportional to the pressure."""
    partial: Interpolant
    """(m,) loads -> (m, pushes * channels) readings after a first push, less those under a proportional traction."""

    def __call__(
        self, force_n: FloatArray, load_n: FloatArray, tangential_n: FloatArray, stick_ratio: FloatArray
    ) -> FloatArray:
        """Return the (n, channels) change of the readings.

        The response follows `force_n` (n,), the true normal force `load_n` or one that lags behind it. `stick_ratio` is
        the radius of the part that sticks over that of the contact; 0 where everything slips.
        """
        share, inner, b = traction_shares(load_n, tangential_n, stick_ratio, self.friction)
        at = np.clip(force_n, 0.0, self.proportional.loads[-1])
        added = _between(_SHARES, self.proportional(at), share)
        return added + b[:, None] * _between(_PUSHES, self.partial(at), 1.0 - inner)


def build_slide_table(
    press: AnyPress,
    read: Callable[[SkinState], FloatArray],
    table: LoadTable,
    skin: Skin,
    direction: Direction,
    friction: float,
) -> SlideTable:
    """Return the slide table at the loads of `table`, a load table made with the same `press` and `read`."""
    along = tangential_of(skin, press.medium.grid)
    proportional, partial = [], []
    for load, plain in zip(table.loads_n.tolist(), table.readings, strict=True):
        state = press(load)

        def added(inner: SkinState, outer_by: float, inner_by: float, state: SkinState = state) -> FloatArray:
            return read(dragged_state(state, inner, along, direction, friction * outer_by, friction * inner_by))

        even = {push: added(state, push, 0.0) - plain for push in {*_SHARES.tolist(), *_PUSHES.tolist()}}
        first = {push: added(press((1.0 - push) * load), 1.0, 1.0) - plain for push in _PUSHES.tolist()}
        proportional.append(np.concatenate([even[push] for push in _SHARES.tolist()]))
        partial.append(np.concatenate([first[push] - even[push] for push in _PUSHES.tolist()]))
    loads = table.loads_n.tolist()
    return SlideTable(friction, *(Interpolant(loads, one, table.touch_down_n) for one in (proportional, partial)))


def _between(nodes: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """Return (n, channels): the polynomial through (n, nodes * channels) `values` at (n,) `at` (Lagrange)."""
    weights = np.ones((at.size, nodes.size))
    for i, node in enumerate(nodes):
        for other in np.delete(nodes, i):
            weights[:, i] *= (at - other) / (node - other)
    return np.asarray(np.einsum("ni,nic->nc", weights, values.reshape(at.size, nodes.size, -1)))
