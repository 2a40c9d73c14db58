"""Stick-slip of a dragged skin: sticking, slipping and steady sliding, each phase in closed form.

The surface moves at a constant speed; load, contact radius and stiffness change slowly and are linear between the
nodes of a grid. There are no time steps: the end of a phase is computed in closed form.

- **stick**: the skin moves with the surface, until elastic and viscous force reach ``mu_s N``. The force follows
  Cattaneo and Mindlin.
- **slip**: see below; the kinetic friction is that at the slip's mean speed, fixed when the slip begins.
- **slide**: if the skin never sticks again; the force follows the LuGre bristle. The phase ends where sliding is no
  longer stable (friction weakens with speed faster than the skin is damped) and a slip would end in sticking.
- **held**: after the motion the skin stays, and slides back as far as a falling load cannot hold it. Its partial slip
  follows from the force ratio as in sticking; after a slip the whole contact sticks until the load falls.

In a slip the skin under the contact is a damped oscillator ``x'' + 2 z w x' + w^2 (x - x_e) = 0`` about ``x_e``, the
deflection that kinetic friction holds. A slip begins at ``x_e + u`` with the surface's speed V and ends when the skin
has this speed again. Without damping (two-coefficient friction, Rabinowicz 1965) it ends at ``x_e - u``, after
``(2/w)(pi - atan(w u/V))``, for any V: the force falls by ``2 (mu_s - mu_k) N``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.contact.tangential import share_of_force, stick_ratio
from tactbench.rigs.twin.effects.memory import ComplexArray, recurrence
from tactbench.rigs.twin.synthesis import Tangential

REST, STICK, SLIP, SLIDE, HELD = range(5)
COULOMB_MM_S = 1e-6
"""Stribeck speed below which friction falls from static to kinetic at once; all measured speeds are higher."""
NOTHING_MM = 1e-12
"""Deflection, a femtometre, below which a deflection counts as zero."""
_LEAST_LOAD_N = 1e-4
"""Smallest load [N] with stick-slip; under smaller loads the skin slides steadily."""
_RUNG_OUT = math.log(1e3)
"""Exponent of decay, to a thousandth, after which the oscillation of a slip without sticking counts as ended."""


@dataclass(frozen=True)
class Drive:
    """The motion of a surface over the skin, and the properties of the contact."""

    speed_mm_s: float
    start_s: float
    end_s: float
    static: float
    kinetic: float
    stribeck_mm_s: float
    mode: Mode
    t_s: FloatArray
    """(m,) ascending times of the grid's nodes, over the whole recording."""
    load_n: FloatArray
    """(m,) normal force at the grid's nodes."""
    stiffness: FloatArray
    """(m,) tangential stiffness of the skin, N/mm; above 0 wherever the load is."""


class Dragged:
    """Motion of the skin under a dragged surface (`drive`): gives the tangential state at any moment."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        contact = drive.load_n > _LEAST_LOAD_N
        per_n = np.divide(1.0, drive.stiffness, out=np.zeros_like(drive.stiffness), where=contact)
        # Viscous force at the drive's speed over the stiffness.
        lag_mm = 2.0 * drive.mode.damping / drive.mode.omega * drive.speed_mm_s
        self._static_mm = np.maximum(drive.static * drive.load_n * per_n - lag_mm, 0.0)
        """(m,) deflection at which a slip begins while the surface moves."""
        self._release_mm = drive.static * drive.load_n * per_n
        # Friction during a slip: at the mean speed of an undamped one.
        u = (drive.static - drive.kinetic) * drive.load_n * per_n
        mean_mm_s = drive.speed_mm_s + 2.0 / math.pi * drive.mode.omega * u
        self._kinetic = coefficient(mean_mm_s, drive.static, drive.kinetic, drive.stribeck_mm_s)
        self._kinetic_mm = self._kinetic * drive.load_n * per_n
        steady = coefficient(np.array(drive.speed_mm_s), drive.static, drive.kinetic, drive.stribeck_mm_s)
        self._steady_mm = steady * drive.load_n * per_n
        self._breaks = (
            contact & self._unstable() & is_caught(drive.mode, self._static_mm - self._kinetic_mm, drive.speed_mm_s)
        )
        """(m,) True where sliding is unstable, so that stick-slip occurs."""
        self._lead_mm = drive.speed_mm_s * drive.t_s - self._static_mm
        self._x_t: list[FloatArray] = []
        self._x_mm: list[FloatArray] = []
        self._phases: list[tuple[float, int, float, float, float]] = []
        """Beginning [s] and kind of each phase, which lasts until the next one begins; deflection of the skin at its
        beginning [mm]; equilibrium of a slip or, of a held skin, the deflection at which tractions were last
        proportional to pressure [mm]; kinetic friction coefficient of a slip."""
        self._run()
        self._begin, self._kind, self._from, self._about, self._friction = np.array(self._phases).T
        self._knots_t = np.concatenate([*self._x_t, [np.inf]])
        self._knots_mm = np.concatenate([*self._x_mm, [0.0]])

    @property
    def let_go_s(self) -> FloatArray:
        """(k,) times at which the skin began to slip."""
        return np.asarray(self._begin[self._kind == SLIP])

    def _unstable(self) -> npt.NDArray[np.bool_]:
        """Return (m,) True where friction weakens with speed faster than the skin is damped (N |mu'(V)| > c)."""
        drive = self.drive
        if drive.stribeck_mm_s < COULOMB_MM_S:
            return np.zeros(drive.t_s.size, dtype=bool)
        fall = (drive.static - drive.kinetic) / drive.stribeck_mm_s
        fall *= math.exp(-drive.speed_mm_s / drive.stribeck_mm_s)
        return drive.load_n * fall > 2.0 * drive.mode.damping / drive.mode.omega * drive.stiffness

    def _run(self) -> None:
        drive = self.drive
        self._phases.append((-math.inf, REST, 0.0, 0.0, 0.0))
        end = min(drive.end_s, float(drive.t_s[-1]))
        t, x, since = drive.start_s, 0.0, 0.0
        sliding = bool(np.interp(t, drive.t_s, drive.load_n) <= _LEAST_LOAD_N)
        while t < end:
            if sliding:
                t, x = self._slide(t, x, end)
                sliding, since = False, x
                continue
            since = x
            self._phases.append((t, STICK, x, 0.0, 0.0))
            t, x = self._lets_go(t, x, end)
            if t >= end:
                break
            about = float(np.interp(t, drive.t_s, self._kinetic_mm))
            lasting = slip_s(drive.mode, x - about, drive.speed_mm_s)
            sliding = math.isinf(lasting)
            if sliding:
                lasting = _RUNG_OUT / drive.mode.decay if drive.mode.decay > 0 and x > about else 0.0
            self._phases.append((t, SLIP, x, about, float(np.interp(t, drive.t_s, self._kinetic))))
            lasting = min(lasting, end - t)
            u, _ = swing(drive.mode, x - about, drive.speed_mm_s, lasting)
            # A slip of no length at all would let go again at the same moment, for ever.
            t, x = max(t + lasting, math.nextafter(t, math.inf)), about + float(u)
            since = x
        if drive.end_s < drive.t_s[-1]:
            self._hold(max(t, drive.start_s), x, since)

    def _lets_go(self, t: float, x: float, end: float) -> tuple[float, float]:
        """Return time (at most `end`) and deflection at which the skin, sticking since time t at x, begins to slip."""
        drive = self.drive
        lead_mm = drive.speed_mm_s * t - x
        if x >= np.interp(t, drive.t_s, self._static_mm):
            return t, x
        at = int(np.searchsorted(drive.t_s, t, side="right"))
        over = self._lead_mm[at:] >= lead_mm
        if over.any():
            node = at + int(over.argmax())
            low, high = self._lead_mm[node - 1 : node + 1]
            share = (lead_mm - low) / (high - low) if high > low else 1.0
            cross = drive.t_s[node - 1] + share * (drive.t_s[node] - drive.t_s[node - 1])
            end = min(max(float(cross), t), end)
        return end, x + drive.speed_mm_s * (end - t)

    def _slide(self, t: float, x: float, end: float) -> tuple[float, float]:
        """Append a phase of sliding from time t until it is unstable or `end`; return its end time and deflection."""
        drive = self.drive
        first = int(np.searchsorted(drive.t_s, t, side="right"))
        last = int(np.searchsorted(drive.t_s, end, side="left"))
        broken = self._breaks[first:last]
        stop = first + int(broken.argmax()) if broken.any() else last
        until = float(drive.t_s[stop]) if broken.any() else end
        knots = np.concatenate([[t], drive.t_s[first:stop], [until]])
        limit = np.interp(knots, drive.t_s, self._steady_mm)
        # A load that falls faster than the bristle turns over lets the skin back at once: never above mu_s N.
        most = np.interp(knots, drive.t_s, self._release_mm)
        deflection = bristle(knots, drive.speed_mm_s, limit, x, most)
        self._phases.append((t, SLIDE, x, 0.0, 0.0))
        self._x_t.append(knots)
        self._x_mm.append(deflection)
        return until, float(deflection[-1])

    def _hold(self, t: float, x: float, since: float) -> None:
        drive = self.drive
        first = int(np.searchsorted(drive.t_s, t, side="right"))
        self._phases.append((t, HELD, x, since, 0.0))
        self._x_t.append(np.concatenate([[t], drive.t_s[first:]]))
        now = min(x, float(np.interp(t, drive.t_s, self._release_mm)))
        held = np.concatenate([[now], self._release_mm[first:]])
        self._x_mm.append(np.minimum.accumulate(held))

    def __call__(self, t_s: FloatArray) -> Tangential:
        """Return the tangential state of the contact at (n,) times."""
        drive = self.drive
        phase = np.searchsorted(self._begin, t_s, side="right") - 1
        kind, begin, x0, about = self._kind[phase], self._begin[phase], self._from[phase], self._about[phase]
        stiffness, load, limit = (
            np.interp(t_s, drive.t_s, values) for values in (drive.stiffness, drive.load_n, self._static_mm)
        )
        x, slip = np.zeros(t_s.size), np.zeros(t_s.size)
        share = np.zeros(t_s.size)
        force = np.zeros(t_s.size)

        own = kind == STICK
        x[own] = x0[own] + drive.speed_mm_s * (t_s[own] - begin[own])
        left = limit[own] - x0[own]
        share[own] = np.divide(x[own] - x0[own], left, out=np.ones(left.size), where=left > NOTHING_MM)
        viscous_mm = 2.0 * drive.mode.damping / drive.mode.omega * drive.speed_mm_s
        force[own] = stiffness[own] * (x0[own] + left.clip(0.0) * share_of_force(share[own]) + viscous_mm)

        own = kind == SLIP
        u, velocity = swing(drive.mode, x0[own] - about[own], drive.speed_mm_s, t_s[own] - begin[own])
        x[own] = about[own] + u
        slip[own] = drive.speed_mm_s - velocity
        force[own] = self._friction[phase[own]] * load[own]

        own = (kind == SLIDE) | (kind == HELD)
        if own.any():
            x[own] = np.interp(t_s[own], self._knots_t, self._knots_mm)
            force[own] = stiffness[own] * x[own]
        own = kind == HELD
        left = np.interp(t_s[own], drive.t_s, self._release_mm) - about[own]
        share[own] = np.divide(x[own] - about[own], left, out=np.ones(left.size), where=left > NOTHING_MM)
        # What sticks keeps the force of its partial slip: only where all has slipped is it that of the whole way.
        stuck = left.clip(0.0) * share_of_force(share[own])
        force[own] = stiffness[own] * np.where(left > NOTHING_MM, about[own] + stuck, x[own])
        slip[kind == SLIDE] = drive.speed_mm_s
        slipping = (kind == SLIP) | (kind == SLIDE)
        touched = load > _LEAST_LOAD_N
        moved = drive.speed_mm_s * (np.clip(t_s, drive.start_s, drive.end_s) - drive.start_s)
        return Tangential(
            force_n=np.where(touched, force, 0.0),
            displacement_mm=x,
            slip_mm_s=slip,
            slip_mm=moved - x,
            slipping=slipping,
            stick_ratio=np.where(touched & ~slipping, stick_ratio(share), 0.0),
        )


def coefficient(speed_mm_s: FloatArray, static: float, kinetic: float, stribeck_mm_s: float) -> FloatArray:
    """Return (n,) friction coefficients at (n,) speeds: ``mu_k + (mu_s - mu_k) exp(-|v|/v_s)``, Tustin's form (1947).

    The coefficient falls fastest at rest, so that the slowest slide is the least stable. For ``v_s`` below a nanometre
    per second it has two values only, static and kinetic (Coulomb).
    """
    if stribeck_mm_s < COULOMB_MM_S:
        return np.where(speed_mm_s == 0, static, kinetic)
    return kinetic + (static - kinetic) * np.exp(-np.abs(speed_mm_s) / stribeck_mm_s)


def bristle(
    t_s: FloatArray, speed_mm_s: float, limit_mm: FloatArray, start_mm: float, most_mm: FloatArray | None = None
) -> FloatArray:
    """Return the (n,) deflection of the LuGre bristle at (n,) ascending times and a constant speed, from `start_mm` on.

    Canudas de Wit, Olsson, Åström and Lischinsky 1995: ``dz/dt = v - |v| z/g(v)``. With v and g held over a step, z
    decays exponentially with the distance travelled: ``z' = b z + (1 - b) g sign(v)``, ``b = exp(-|v| dt/g)``.

    At a speed of 0, and between equal times, the deflection stays. `limit_mm` (n,) is the deflection ``g`` of steady
    sliding, at least 0 and constant from each sample to the next; where it is 0, motion leaves no deflection. With
    `most_mm` (n,), the deflection is at most this at every sample; samples are computed one after the other only if
    this limit is reached, which is rare.
    """
    way = abs(speed_mm_s) * np.diff(t_s, prepend=t_s[:1])
    held = np.concatenate([limit_mm[:1], limit_mm[:-1]])
    lost = -np.expm1(-np.divide(way, held, out=np.where(way > 0, np.inf, 0.0), where=held > NOTHING_MM))
    drive = lost * held * np.sign(speed_mm_s)
    drive[0] = start_mm
    found: FloatArray = recurrence(1.0 - lost, drive)
    if most_mm is not None and (found > most_mm).any():
        first = int((found > most_mm).argmax())
        found[first] = most_mm[first]
        for sample in range(first + 1, found.size):
            free = (1.0 - lost[sample]) * found[sample - 1] + drive[sample]
            found[sample] = min(free, most_mm[sample])
    return found


@dataclass(frozen=True)
class Mode:
    """A damped tangential oscillation of the skin under the contact."""

    omega: float
    """Undamped angular frequency, rad/s."""
    damping: float
    """Share of the critical damping, 0 to below 1."""

    def __post_init__(self) -> None:
        if not (self.omega > 0 and 0 <= self.damping < 1):
            raise RigError(
                f"The skin cannot oscillate at {self.omega:g} rad/s with {self.damping:g} of the critical damping.",
                hint="State skin_mode_frequency above 0 and skin_mode_damping from 0 to below 1 in the sensor's spec.",
            )

    @property
    def decay(self) -> float:
        """Decay rate of the oscillation, 1/s."""
        return self.damping * self.omega

    @property
    def swing(self) -> float:
        """Damped angular frequency, rad/s."""
        return self.omega * math.sqrt(1.0 - self.damping**2)


def swing(
    mode: Mode, u: FloatArray | float, speed: float, after_s: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Return deflection from equilibrium and velocity, (n,) each, `after_s` (n,) after a slip starts at `u` (n,)."""
    w, r = mode.swing, mode.decay
    c, s = np.cos(w * after_s), np.sin(w * after_s)
    faded = np.exp(-r * after_s)
    return (
        faded * (u * c + (speed + r * u) / w * s),
        faded * (speed * c - (mode.omega**2 * u + r * speed) / w * s),
    )


def is_caught(mode: Mode, u: FloatArray, speed: float) -> npt.NDArray[np.bool_]:
    """Return (n,) True where the skin, in a slip that begins at `u` (n,), reaches the surface's speed again."""
    w, r = mode.swing, mode.decay
    back = (mode.omega**2 * u + r * speed) / w
    highest = np.arctan2(r * speed + back * w, r * back - speed * w) + math.pi
    _, velocity = swing(mode, u, speed, highest / w)
    return (u > 0) & (velocity >= speed)


def slip_s(mode: Mode, u: float, speed: float) -> float:
    """Return the duration of the slip in seconds; infinity if the skin never sticks again.

    The velocity rises throughout the half period after its minimum, so that it reaches the surface's speed once there.
    """
    from scipy.optimize import brentq

    w, r = mode.swing, mode.decay
    back = (mode.omega**2 * u + r * speed) / w
    if not u > 0:
        return math.inf

    def excess(t: float) -> float:
        return math.exp(-r * t) * (speed * math.cos(w * t) - back * math.sin(w * t)) - speed

    low = math.atan2(r * speed + back * w, r * back - speed * w) / w
    high = low + math.pi / w
    if excess(high) < 0:
        return math.inf
    # In the rounding of a deflection of almost nothing the velocity may not fall at all.
    return low if excess(low) >= 0 else float(brentq(excess, low, high, xtol=1e-18, rtol=1e-15))


def shaken(t_s: FloatArray, pushed: FloatArray, mode: Mode) -> FloatArray:
    """Return the (n,) solution q of ``q'' + 2 z w q' + w^2 q = w^2 u``, at rest in equilibrium at the first sample.

    `t_s` (n,) ascends; equal neighbours change nothing. u is `pushed` (n,), the displacement under a slow push,
    linear between samples. With ``l = -z w + i wd`` and ``p = q' - conj(l) q`` the equation is one complex lag, ``p' =
    l p + w^2 u``, and ``q = Im p / wd``: exact like the lag of ``memory``, and solved as quickly.
    """
    root = complex(-mode.decay, mode.swing)
    dt = np.diff(t_s, prepend=t_s[:1])
    turned: ComplexArray = np.exp(root * dt)
    before = np.concatenate([pushed[:1], pushed[:-1]])
    rise = np.divide(pushed - before, dt, out=np.zeros_like(dt), where=dt > 0)
    grown = (turned - 1.0) / root
    drive = mode.omega**2 * (before * grown + rise * (grown - dt) / root)
    drive[0] = -root.conjugate() * pushed[0]
    return np.asarray(recurrence(turned, drive).imag / mode.swing)
