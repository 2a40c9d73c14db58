"""Oracles of what happens along the skin: partial slip, stick-slip, the bristle, the skin's mode."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.simulation import Check, Verdict
from tactbench.rigs.twin.effects.bristle import bristle, coefficient
from tactbench.rigs.twin.effects.skin_mode import shaken
from tactbench.rigs.twin.effects.slip_event import Mode, slip_s, swing
from tactbench.rigs.twin.effects.stick_slip import Dragged, Drive
from tactbench.rigs.twin.partial_slip import share_of_force, sliding_stiffness, stick_ratio
from tactbench.rigs.twin.verification import shear

ROUNDING = 1e-9
"""Closed forms against closed forms: what a few hundred operations round."""
STATIC, KINETIC, LOAD_N, STIFFNESS = 0.8, 0.5, 2.0, 3.0


def checks() -> Sequence[Check]:
    """Return the oracles of friction and vibration."""
    return [
        Check("cattaneo", "friction", "partial slip against its tractions, integrated (Cerruti)", _cattaneo),
        Check("mindlin-cycle", "friction", "energy of an oscillating contact against Mindlin's closed form", _cycle),
        Check("stick-slip", "friction", "period and force drop against two-coefficient friction", _stick_slip),
        Check("slip-event", "friction", "one damped slip against a Runge-Kutta integration", _slip_event),
        Check("sliding-energy", "friction", "work of the drive against all that dissipates it, over a cycle", _energy),
        Check("friction-limit", "friction", "force under a rising load against mu_s N", _limit),
        Check("bristle", "friction", "LuGre: one long step, steady sliding, passivity", _bristle),
        Check(
            "boussinesq", "shear", "a pressed layer's surface along itself against the half-space's", shear.boussinesq
        ),
        Check("cattaneo-skin", "shear", "a pressed and pushed layer against Cattaneo and Mindlin", shear.cattaneo),
        Check("skin-mode", "vibration", "the skin's mode: one long step, decay of its energy, resonance", _mode),
    ]


def drive(speed_mm_s: float, damping: float, seconds: float, **more: float) -> Drive:
    """Return a drive under a constant load; `more` changes friction (static, kinetic, stribeck_mm_s)."""
    grid = np.linspace(0.0, seconds, 101)
    return Drive(
        speed_mm_s=speed_mm_s,
        start_s=0.0,
        end_s=math.inf,
        static=more.get("static", STATIC),
        kinetic=more.get("kinetic", KINETIC),
        stribeck_mm_s=more.get("stribeck_mm_s", 0.0),
        mode=Mode(2.0 * math.pi * 300.0, damping),
        t_s=grid,
        load_n=np.full(grid.size, LOAD_N),
        stiffness=np.full(grid.size, STIFFNESS),
    )


def _cattaneo() -> list[Verdict]:
    """Integrate the tractions ``mu (p(r; a) - c/a p(r; c))`` for force and for displacement of the middle.

    By Cerruti, a traction q(r) moves the middle of a half-space by ``int q dr / (2 G*)``.
    """
    radius, shear, limit = 1.7, 0.4, 1.3  # a [mm], G* [MPa], mu P [N]
    share = np.linspace(0.05, 0.95, 10)
    stuck = radius * stick_ratio(share)
    # r = a sin(u): the square root's end does no harm to the midpoint rule.
    u = (np.arange(20000) + 0.5) / 20000 * math.pi / 2.0
    force, moved = [], []
    for c in stuck:
        f, m = np.zeros(2), np.zeros(2)
        for n, edge in enumerate((radius, c)):
            peak = 3.0 * limit / (2.0 * math.pi * radius**2) * (edge / radius)
            r, dr = edge * np.sin(u), edge * np.cos(u) * (u[1] - u[0])
            traction = peak * np.cos(u)
            f[n] = float(np.sum(2.0 * math.pi * r * traction * dr))
            m[n] = float(np.sum(traction * dr)) / (2.0 * shear)
        force.append(f[0] - f[1])
        moved.append(m[0] - m[1])
    stiffness = float(sliding_stiffness(np.array([radius]), shear)[0])
    force_error = np.abs(np.array(force) / limit - share_of_force(share)).max()
    moved_error = np.abs(np.array(moved) * stiffness / limit - share).max()
    radius_error = np.abs(stuck / radius - np.cbrt(1.0 - share_of_force(share))).max()
    slope = float(share_of_force(np.array([1e-7]))[0]) / 1e-7
    source = "Johnson 1985, 7.39-7.42; midpoint rule on 20000 points, error 1e-9"
    return [
        Verdict("force from tractions", float(force_error), 0.0, 1e-8, source=source),
        Verdict("displacement from tractions", float(moved_error), 0.0, 1e-8, source=source),
        Verdict("stick radius", float(radius_error), 0.0, ROUNDING, source="c = a (1 - Q/(mu P))^(1/3)"),
        Verdict("stiffness without slip, over that in slip", slope, 1.5 - 1e-6, 1.5, source="8 a G* over 16 a G*/3"),
    ]


def _cycle() -> list[Verdict]:
    """Hold the loop that Masing's rule makes of the loading curve against Mindlin's energy per cycle."""
    radius, shear, limit = 1.7, 0.4, 1.3
    stiffness = float(sliding_stiffness(np.array([radius]), shear)[0])
    found = []
    shares = np.array([0.02, 0.3, 0.7, 1.0])
    for share in shares:
        s = (np.arange(4000) + 0.5) / 4000 * share
        below = float(np.sum(share_of_force(s))) * share / 4000
        most = float(share_of_force(np.array([share]))[0])
        found.append((8.0 * below - 4.0 * most * share) * limit**2 / stiffness)
    q: FloatArray = share_of_force(shares)
    scale = 9.0 * limit**2 / (10.0 * radius * shear)
    left = 1.0 - q
    closed = scale * (1.0 - left ** (5 / 3) - 5.0 / 6.0 * q * (1.0 + left ** (2 / 3)))
    worst = float(np.abs(np.array(found) / closed - 1.0)[1:].max())
    cubic = float(q[0] * limit) ** 3 / (36.0 * limit * radius * shear)
    return [
        Verdict("energy per cycle", worst, 0.0, 1e-5, source="Johnson 1985, section 7.4; midpoint rule, 4000 points"),
        Verdict("energy of small cycles, over Q^3/(36 mu P a G*)", found[0] / cubic, 1.0, 1.03,
                source="the same for small Q; Q/(mu P) is 0.03, the next term two thirds of it"),
    ]  # fmt: skip


def _stick_slip() -> list[Verdict]:
    verdicts = []
    for speed in (0.01, 5.0, 60.0):
        found = Dragged(drive(speed, 0.0, 40.0 * period_s(speed)))
        periods = np.diff(found.let_go_s)
        let_go, caught = (found(t).displacement_mm for t in (found.let_go_s[1:9], found.caught_s[2:10]))
        drop_mm = 2.0 * (STATIC - KINETIC) * LOAD_N / STIFFNESS
        verdicts += [
            Verdict(f"period at {speed:g} mm/s", float(np.abs(periods / period_s(speed) - 1.0).max()), 0.0, 1e-7,
                    source="2u/V + 2/w (pi - atan(w u/V)), u = (mu_s - mu_k) N/k; instants to 1e-11 of the run"),
            Verdict(f"force drop at {speed:g} mm/s", float(np.abs((let_go - caught) / drop_mm - 1.0).max()), 0.0, 1e-7,
                    source="2 (mu_s - mu_k) N, at any speed without damping"),
        ]  # fmt: skip
    slow = period_s(1e-5) * 1e-5 * STIFFNESS / (2.0 * (STATIC - KINETIC) * LOAD_N)
    return [*verdicts, Verdict("slow drive: period x k V over the force drop", slow, 1.0, 1.0 + 1e-5, source="limit 1")]


def period_s(speed_mm_s: float) -> float:
    """Return the period of undamped stick-slip under two-coefficient friction at the module's load."""
    u, omega = (STATIC - KINETIC) * LOAD_N / STIFFNESS, 2.0 * math.pi * 300.0
    return 2.0 * u / speed_mm_s + 2.0 / omega * (math.pi - math.atan(omega * u / speed_mm_s))


def _slip_event() -> list[Verdict]:
    worst, where = 0.0, 0.0
    for damping, u, speed in ((0.0, 0.2, 5.0), (0.05, 0.2, 30.0), (0.2, 0.1, 10.0), (0.1, 0.01, 0.5)):
        mode = Mode(2.0 * math.pi * 300.0, damping)
        lasting = slip_s(mode, u, speed)
        x, v, steps = u, speed, 20000
        dt = lasting / steps
        for _ in range(steps):
            x, v = _runge_kutta(mode, x, v, dt)
        worst = max(worst, abs(v - speed) / (mode.omega * u))
        closed, _ = swing(mode, np.array([u]), np.array([speed]), np.array([lasting]))
        where = max(where, abs(x - float(closed[0])) / u)
    source = "fourth order, 20000 steps: error below 1e-10"
    return [
        Verdict("velocity when caught, less the surface's", worst, 0.0, 1e-9, source=source),
        Verdict("deflection when caught", where, 0.0, 1e-9, source=source),
    ]


def _runge_kutta(mode: Mode, x: float, v: float, dt: float) -> tuple[float, float]:
    def pull(x: float, v: float) -> float:
        return -2.0 * mode.damping * mode.omega * v - mode.omega**2 * x

    k1x, k1v = v, pull(x, v)
    k2x, k2v = v + dt / 2 * k1v, pull(x + dt / 2 * k1x, v + dt / 2 * k1v)
    k3x, k3v = v + dt / 2 * k2v, pull(x + dt / 2 * k2x, v + dt / 2 * k2v)
    k4x, k4v = v + dt * k3v, pull(x + dt * k3x, v + dt * k3v)
    return x + dt / 6 * (k1x + 2 * k2x + 2 * k3x + k4x), v + dt / 6 * (k1v + 2 * k2v + 2 * k3v + k4v)


def _energy() -> list[Verdict]:
    """Balance one cycle: what the surface does against friction, the skin's damper and the annulus of partial slip."""
    speed, damping = 20.0, 0.1
    found = Dragged(drive(speed, damping, 1.0))
    (stick, end), slip = found.caught_s[5:7], float(found.let_go_s[5])
    viscous = 2.0 * damping / (2.0 * math.pi * 300.0) * STIFFNESS
    work = lost = rubbed = 0.0
    least = math.inf
    for begin, until in ((stick, slip), (slip, end)):
        # Gauss points never ask at the instant itself, which belongs to the next phase.
        nodes, weights = np.polynomial.legendre.leggauss(200)
        t = begin + (until - begin) * 0.5 * (nodes + 1.0)
        dt = 0.5 * (until - begin) * weights
        seen = found(t)
        velocity = speed - seen.slip_mm_s
        work += float(np.sum(seen.force_n * speed * dt))
        rubbed += float(np.sum(seen.force_n * seen.slip_mm_s * dt))
        lost += float(np.sum(viscous * velocity**2 * dt))
        least = min(least, float((seen.force_n * seen.slip_mm_s).min()))
    x = found(np.array([stick, slip])).displacement_mm
    undamped = 2.0 * (STATIC - KINETIC) * LOAD_N
    annulus = 0.1 * STIFFNESS * (x[1] - x[0]) ** 2
    return [
        Verdict("work less dissipation, over work", abs(work - rubbed - lost - float(annulus)) / work, 0.0, 1e-7,
                source="energy; quadrature of 200 Gauss points, the partial slip's share in closed form"),
        Verdict("least power of friction", least, -ROUNDING, math.inf, "mW", source="friction never drives"),
        Verdict("damped: force drop over the undamped", float(STIFFNESS * (x[1] - x[0])) / undamped, 0.3, 1.0,
                source="damping takes energy from the swing"),
    ]  # fmt: skip


def _limit() -> list[Verdict]:
    grid = np.linspace(0.0, 10.0, 5001)
    load = np.interp(grid, [0.0, 2.0, 8.0, 10.0], [0.0, 0.0, 5.0, 1.0])
    radius = np.cbrt(load)
    over, released, negative = 0.0, 0.0, 0.0
    for speed, damping in ((1.0, 0.05), (20.0, 0.1), (200.0, 0.3)):
        found = Dragged(
            Drive(speed, 1.0, 9.0, STATIC, KINETIC, 5.0, Mode(2 * math.pi * 300.0, damping), grid, load, 2.0 * radius)
        )
        t = np.linspace(0.0, 10.0, 40001)
        seen = found(t)
        limit = STATIC * np.interp(t, grid, load)
        over = max(over, float((seen.force_n - limit).max()))
        released = max(released, float(np.abs(seen.force_n[t < 1.0]).max()))
        negative = max(negative, float(-np.diff(seen.slip_mm).min()))
    # Stiffness is straight between nodes where the load's cube root is not: 2e-5 of 4 N covers it.
    return [
        Verdict("force above mu_s N", over, 0.0, 1e-4, "N", source="friction's limit; nodes of 2 ms"),
        Verdict("force before the motion", released, 0.0, 0.0, "N", source="nothing moves"),
        Verdict("slip backwards", negative, 0.0, 1e-12, "mm", source="the surface never lags behind the skin"),
    ]


def _bristle() -> list[Verdict]:
    limit = np.full(3, 0.3)
    fine = bristle(np.array([0.0, 0.01, 0.02]), 4.0, limit, 0.05)[-1]
    coarse = bristle(np.array([0.0, 0.02]), 4.0, limit[:2], 0.05)[-1]
    steady = bristle(np.array([0.0, 1e3]), 4.0, limit[:2], 0.0)[-1]
    still = bristle(np.array([0.0, 5.0]), 0.0, limit[:2], 0.05)[-1]
    t = np.linspace(0.0, 0.3, 1000)
    path = bristle(t, -7.0, np.full(1000, 0.3), 0.2)
    # F v less the change of stored energy k z^2/2: k z (v - dz/dt) = k |v| z^2/g.
    power = path * -7.0 - np.gradient(0.5 * path**2, t)
    law = [coefficient(v, STATIC, KINETIC, 5.0) for v in (0.0, 5.0, 1e6)]
    expected: FloatArray = np.array([STATIC, KINETIC + (STATIC - KINETIC) / math.e, KINETIC])
    return [
        Verdict("one step of 2 dt less two of dt", abs(fine - coarse), 0.0, 1e-15, "mm", source="exactness"),
        Verdict("after a step of 1000 s", steady, 0.3 - 1e-15, 0.3, "mm", source="steady sliding is g"),
        Verdict("at rest", still, 0.05, 0.05, "mm", source="v = 0 leaves z"),
        Verdict("least dissipated power", float(power.min()), -1e-4, math.inf,
                source="passivity; differences over 0.3 ms"),
        Verdict("friction against speed", float(np.abs(np.array(law) - expected).max()), 0.0, 1e-15, source="Tustin"),
    ]  # fmt: skip


def _mode() -> list[Verdict]:
    mode = Mode(2.0 * math.pi * 330.0, 0.1)
    generator = np.random.default_rng(1)
    coarse = np.cumsum(generator.uniform(1e-5, 3e-3, 200))
    push = generator.standard_normal(200)
    fine = np.sort(np.concatenate([coarse, 0.3 * coarse[1:] + 0.7 * coarse[:-1]]))
    once, often = shaken(coarse, push, mode), shaken(fine, np.interp(fine, coarse, push), mode)
    same = float(np.abs(once - often[np.searchsorted(fine, coarse)]).max())
    u, v = swing(mode, np.full(400, 1.0), np.zeros(400), np.linspace(0.0, 0.02, 400))
    energy = 0.5 * v**2 + 0.5 * mode.omega**2 * u**2
    periods: FloatArray = 2.0 * math.pi / mode.swing * np.arange(6.0)
    u, v = swing(mode, np.ones(6), np.zeros(6), periods)
    faded = (0.5 * v**2 + 0.5 * mode.omega**2 * u**2) / (0.5 * mode.omega**2) / np.exp(-2.0 * mode.decay * periods)
    t = np.arange(40000) / 40000.0
    answer = shaken(t, np.sin(mode.omega * t), mode)[20000:]
    gain = float(np.sqrt(2.0 * np.mean(answer[: 330 * 60] ** 2)))
    return [
        Verdict("one long step less two short ones", same, 0.0, 1e-9, source="exactness for any step; rounding"),
        Verdict("largest rise of its energy", float(np.diff(energy).max() / energy[0]), -math.inf, 0.0,
                source="passivity"),
        Verdict("energy after full swings", float(np.abs(faded - 1.0).max()), 0.0, ROUNDING, source="exp(-2 z w t)"),
        Verdict("resonance x 2 z", gain * 0.2, 0.995, 1.005, source="1/(2 z) at w; 121 samples a period"),
    ]  # fmt: skip
