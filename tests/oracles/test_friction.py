"""What happens along the skin against closed forms and integration: partial slip, stick-slip, the bristle, the mode."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.rigs.twin.contact.tangential import share_of_force, sliding_stiffness, stick_ratio
from tactbench.rigs.twin.effects.stick_slip import (
    STICK,
    Dragged,
    Drive,
    Mode,
    bristle,
    coefficient,
    shaken,
    slip_s,
    swing,
)

STATIC, KINETIC, LOAD_N, STIFFNESS, OMEGA = 0.8, 0.5, 2.0, 3.0, 2.0 * math.pi * 300.0


def drive(speed_mm_s: float, damping: float, seconds: float) -> Drive:
    grid = np.linspace(0.0, seconds, 101)
    return Drive(
        speed_mm_s=speed_mm_s, start_s=0.0, end_s=math.inf, static=STATIC, kinetic=KINETIC, stribeck_mm_s=0.0,
        mode=Mode(OMEGA, damping), t_s=grid, load_n=np.full(grid.size, LOAD_N), stiffness=np.full(grid.size, STIFFNESS),
    )  # fmt: skip


def period_s(speed_mm_s: float) -> float:
    """Return the period of undamped stick-slip under two-coefficient friction."""
    u = (STATIC - KINETIC) * LOAD_N / STIFFNESS
    return 2.0 * u / speed_mm_s + 2.0 / OMEGA * (math.pi - math.atan(OMEGA * u / speed_mm_s))


RADIUS, SHEAR, LIMIT = 1.7, 0.4, 1.3
"""a [mm], G* [MPa], mu P [N] of a partial slip."""


def test_partial_slip_is_what_its_tractions_add_up_to():
    """``mu (p(r; a) - c/a p(r; c))``; by Cerruti a traction q(r) moves the middle by ``int q dr / (2 G*)``."""
    share = np.linspace(0.05, 0.95, 10)
    stuck = RADIUS * stick_ratio(share)
    # r = a sin(u): the square root's end does no harm to the midpoint rule.
    u = (np.arange(20000) + 0.5) / 20000 * math.pi / 2.0
    force, moved = np.zeros(10), np.zeros(10)
    for n, c in enumerate(stuck):
        for edge, sign in ((RADIUS, 1), (c, -1)):
            r, dr = edge * np.sin(u), edge * np.cos(u) * (u[1] - u[0])
            traction = sign * 3.0 * LIMIT / (2.0 * math.pi * RADIUS**2) * (edge / RADIUS) * np.cos(u)
            force[n] += np.sum(2.0 * math.pi * r * traction * dr)
            moved[n] += np.sum(traction * dr) / (2.0 * SHEAR)
    stiffness = float(sliding_stiffness(np.array([RADIUS]), SHEAR)[0])
    # Johnson 7.39-7.42; the midpoint rule on 20000 points errs by 1e-9.
    np.testing.assert_allclose(force / LIMIT, share_of_force(share), atol=1e-8)
    np.testing.assert_allclose(moved * stiffness / LIMIT, share, atol=1e-8)
    np.testing.assert_allclose(stuck / RADIUS, np.cbrt(1.0 - share_of_force(share)), atol=1e-9)
    # 8 a G* without slip over 16 a G*/3 in it.
    assert share_of_force(np.array([1e-7]))[0] / 1e-7 == pytest.approx(1.5, abs=1e-6)


@pytest.mark.parametrize("speed", [0.01, 5.0, 60.0])
def test_stick_slip_has_the_period_and_the_drop_of_two_coefficients(speed):
    found = Dragged(drive(speed, 0.0, 40.0 * period_s(speed)))
    # Instants to 1e-11 of the run.
    np.testing.assert_allclose(np.diff(found.let_go_s), period_s(speed), rtol=1e-7)
    let_go, caught = (found(t).displacement_mm for t in (found.let_go_s[1:9], found._begin[found._kind == STICK][2:10]))
    # 2 (mu_s - mu_k) N, at any speed without damping.
    np.testing.assert_allclose(let_go - caught, 2.0 * (STATIC - KINETIC) * LOAD_N / STIFFNESS, rtol=1e-7)


@pytest.mark.parametrize(
    ("damping", "u", "speed"), [(0.0, 0.2, 5.0), (0.05, 0.2, 30.0), (0.2, 0.1, 10.0), (0.1, 0.01, 0.5)]
)
def test_a_damped_slip_ends_where_runge_and_kutta_find_it(damping, u, speed):
    mode, lasting = Mode(OMEGA, damping), slip_s(Mode(OMEGA, damping), u, speed)
    state, dt = np.array([u, speed]), lasting / 20000
    step = np.array([[0.0, 1.0], [-(OMEGA**2), -2.0 * damping * OMEGA]]) * dt
    # Fourth order, 20000 steps: error below 1e-10.
    once = np.eye(2) + step @ (np.eye(2) + step @ (np.eye(2) + step @ (np.eye(2) + step / 4) / 3) / 2)
    state = np.linalg.matrix_power(once, 20000) @ state
    assert state[1] == pytest.approx(speed, abs=1e-9 * OMEGA * u)
    closed, _ = swing(mode, np.array([u]), np.array([speed]), np.array([lasting]))
    assert state[0] == pytest.approx(closed[0], abs=1e-9 * u)


def test_the_bristle():
    limit = np.full(3, 0.3)
    fine = bristle(np.array([0.0, 0.01, 0.02]), 4.0, limit, 0.05)[-1]
    assert bristle(np.array([0.0, 0.02]), 4.0, limit[:2], 0.05)[-1] == pytest.approx(fine, abs=1e-15)
    assert bristle(np.array([0.0, 1e3]), 4.0, limit[:2], 0.0)[-1] == pytest.approx(0.3, abs=1e-15)
    assert bristle(np.array([0.0, 5.0]), 0.0, limit[:2], 0.05)[-1] == 0.05
    t = np.linspace(0.0, 0.3, 1000)
    path = bristle(t, -7.0, np.full(1000, 0.3), 0.2)
    # F v less the change of stored energy k z²/2 is k |v| z²/g; differences over 0.3 ms.
    assert (path * -7.0 - np.gradient(0.5 * path**2, t)).min() >= -1e-4
    law = coefficient(np.array([0.0, 5.0, 1e6]), STATIC, KINETIC, 5.0)
    assert law == pytest.approx([STATIC, KINETIC + (STATIC - KINETIC) / math.e, KINETIC], abs=1e-15)


def test_the_skins_mode():
    mode, rng = Mode(2.0 * math.pi * 330.0, 0.1), np.random.default_rng(1)
    coarse, push = np.cumsum(rng.uniform(1e-5, 3e-3, 200)), rng.standard_normal(200)
    fine = np.sort(np.concatenate([coarse, 0.3 * coarse[1:] + 0.7 * coarse[:-1]]))
    often = shaken(fine, np.interp(fine, coarse, push), mode)[np.searchsorted(fine, coarse)]
    np.testing.assert_allclose(shaken(coarse, push, mode), often, atol=1e-9)  # exact for any step; rounding
    u, v = swing(mode, np.full(400, 1.0), np.zeros(400), np.linspace(0.0, 0.02, 400))
    assert np.all(np.diff(v**2 + mode.omega**2 * u**2) <= 0)
    periods = 2.0 * math.pi / mode.swing * np.arange(6.0)
    u, v = swing(mode, np.ones(6), np.zeros(6), periods)
    np.testing.assert_allclose(v**2 / mode.omega**2 + u**2, np.exp(-2.0 * mode.decay * periods), rtol=1e-9)
    t = np.arange(40000) / 40000.0
    answer = shaken(t, np.sin(mode.omega * t), mode)[20000:][: 330 * 60]
    # 1/(2 z) at resonance; 121 samples a period.
    assert np.sqrt(2.0 * np.mean(answer**2)) * 0.2 == pytest.approx(1.0, abs=0.005)
