from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.rigs.twin.contact.tangential import shear_modulus_mpa
from tactbench.rigs.twin.effects.stick_slip import STICK, Dragged, Drive, Mode, is_caught, slip_s, swing
from tests.oracles.layers import bonded_layer


def _drive(load, seconds=4.0, nodes=801, **more):
    grid = np.linspace(0.0, seconds, nodes)
    load_n = np.interp(grid, np.linspace(0.0, seconds, len(load)), load)
    return Drive(**{
        "speed_mm_s": 10.0, "start_s": 0.5, "end_s": math.inf, "static": 0.8, "kinetic": 0.6, "stribeck_mm_s": 5.0,
        "mode": Mode(2000.0, 0.1), "t_s": grid, "load_n": load_n, "stiffness": 2.0 * np.cbrt(load_n), **more,
    })  # fmt: skip


loads = st.lists(st.floats(0.0, 8.0), min_size=2, max_size=4)
stribeck_speeds = st.one_of(st.just(0.0), st.floats(0.1, 50.0))


@given(loads, st.floats(0.05, 500.0), st.floats(0.0, 0.9), st.floats(0.0, 0.8), stribeck_speeds, st.floats(0.3, 5))
@example([1.0, 0.0, 0.0], 348.0, 0.0, 0.0, 0.0, 0.3125)
@example([1.0, 0.0, 1.0, 0.0], 1.0, 0.5, 0.75, 0.0, 1.0)
@example([0.0, 1.0], 23.0, 0.5, 5e-324, 0.0, 1.0)
@example([1.0, 0.0], 1.0, 0.0, 0.8, 0.0, 0.5)
@settings(max_examples=40)
def test_whatever_moves_the_laws_of_friction_hold(load, speed, damping, kinetic, stribeck, end):
    drive = _drive(load, 1.0, speed_mm_s=speed, end_s=end, kinetic=kinetic, stribeck_mm_s=stribeck,
                   start_s=0.2, mode=Mode(2000.0, damping))  # fmt: skip
    t = np.linspace(0.0, 1.0, 3001)
    seen = Dragged(drive)(t)
    limit = drive.static * np.interp(t, drive.t_s, drive.load_n)
    # Load and stiffness are straight between nodes 5 ms apart, where one is the other's cube: 1e-3 of the load.
    assert np.all(seen.force_n <= limit + 1e-3 * max(load) + 1e-9)
    # Surface and skin never pass each other, and the skin is never pushed against the way it is dragged for good.
    # (A slip that is never caught is followed to a thousandth of its swing, then the skin is taken to be steady.)
    assert np.all(np.diff(seen.slip_mm) >= -1e-9 - 1e-3 * seen.displacement_mm.max())
    assert np.all(seen.slip_mm_s >= -1e-9)
    assert np.all((seen.stick_ratio >= 0) & (seen.stick_ratio <= 1))
    assert not np.any(seen.slipping & (seen.stick_ratio > 0))
    assert not np.any(seen.force_n[t < 0.2])
    for values in seen:
        assert np.all(np.isfinite(values))


def test_a_faster_drive_ends_stick_slip():
    # Sliding is stable from 26 mm/s on (N |mu'(V)| < c); stick-slip that lives already dies once w u, here 200 mm/s
    # less what damping takes, is below the drive.
    slow, fast = (Dragged(_drive([1.0, 1.0], speed_mm_s=v)) for v in (5.0, 200.0))
    assert slow.let_go_s.size > 50
    assert fast.let_go_s.size == 1
    assert Dragged(_drive([1.0, 1.0], kinetic=0.8)).let_go_s.size <= 1, "equal coefficients never stick and slip"
    steady = fast(np.array([3.0]))
    expected = 0.6 + 0.2 * math.exp(-200.0 / 5.0)
    assert steady.force_n[0] == pytest.approx(expected, rel=1e-9)
    assert steady.slip_mm_s[0] == 200.0


def test_a_slide_that_begins_in_the_air_takes_hold_with_the_load():
    dragged = Dragged(_drive([0.0, 0.0, 2.0]))
    before, after = dragged(np.array([1.0, 1.9])), dragged(np.linspace(3.0, 4.0, 400))
    assert np.all(before.force_n == 0)
    assert np.all(before.stick_ratio == 0)
    assert after.force_n.max() > 1.0
    assert dragged.let_go_s.size > 20


def test_after_the_motion_the_force_stays_until_the_load_lets_it_go():
    dragged = Dragged(_drive([2.0, 2.0, 2.0, 0.0], 6.0, end_s=3.0, speed_mm_s=1.0))
    held = dragged(np.array([3.1, 3.9]))
    assert held.force_n[0] == pytest.approx(held.force_n[1], rel=1e-12)
    late = np.linspace(4.0, 6.0, 300)
    seen = dragged(late)
    load = np.interp(late, dragged.drive.t_s, dragged.drive.load_n)
    assert np.all(seen.force_n <= 0.8 * load + 1e-3)
    assert seen.force_n[-1] == 0


@given(st.floats(0.0, 0.95), st.floats(1e-4, 1.0), st.floats(1e-3, 500.0))
def test_a_slip_ends_at_the_surfaces_speed_for_the_first_time(damping, u, speed):
    mode = Mode(2000.0, damping)
    lasting = slip_s(mode, u, speed)
    assert math.isfinite(lasting) == bool(is_caught(mode, np.array([u]), speed)[0])
    if math.isfinite(lasting):
        _, velocity = swing(mode, np.full(200, u), np.full(200, speed), np.linspace(0, lasting, 202)[1:-1])
        scale = mode.omega * u + speed
        assert velocity.max() < speed + 1e-9 * scale
        _, at_end = swing(mode, np.array([u]), np.array([speed]), np.array([lasting]))
        assert at_end[0] == pytest.approx(speed, abs=1e-9 * scale)


def test_a_mode_that_cannot_swing_is_refused():
    with pytest.raises(RigError, match="cannot oscillate"):
        Mode(2000.0, 1.0)


def test_every_medium_has_a_shear_modulus(specs):
    assert shear_modulus_mpa(specs["biotac"].skin) == pytest.approx(0.8 / 2.96 / 1.52)
    assert shear_modulus_mpa(specs["icub"].skin) == specs["icub"].skin.shear.to("MPa") / 2
    assert shear_modulus_mpa(bonded_layer(0.3)) == pytest.approx(1.0 / 2.6 / 1.7)


@pytest.mark.parametrize(("speed", "damping", "stribeck"), [(2.0, 0.05, 0.0), (10.0, 0.1, 5.0), (30.0, 0.02, 50.0)])
def test_the_work_of_the_drive_is_stored_or_dissipated(speed, damping, stribeck):
    """Over a hundred phases from the grip on: work = spring + rubbed + damper + the annulus of partial slip.

    At the instants between phases skin and surface have one speed: the kinetic energy stays what the grip gave.
    """
    mode = Mode(2000.0, damping)
    dragged = Dragged(_drive([1.0, 1.0], seconds=8.0, speed_mm_s=speed, mode=mode, stribeck_mm_s=stribeck))
    stiffness = float(dragged.drive.stiffness[0])
    damper = 2.0 * damping / mode.omega * stiffness
    caught_s = dragged._begin[dragged._kind == STICK]
    instants = np.sort(np.concatenate([caught_s, dragged.let_go_s]))[:101]
    assert instants.size == 101
    nodes, weights = np.polynomial.legendre.leggauss(60)
    work = dissipated = 0.0
    largest = worst = 0.0
    for begin, until in itertools.pairwise(instants):
        # Gauss points never ask at the instant itself, which belongs to the next phase.
        seen = dragged(begin + (until - begin) * 0.5 * (nodes + 1.0))
        dt = 0.5 * (until - begin) * weights
        velocity = speed - seen.slip_mm_s
        work += float(np.sum(seen.force_n * speed * dt))
        dissipated += float(np.sum((seen.force_n * seen.slip_mm_s + damper * velocity**2) * dt))
        at_begin, at_end = dragged(np.array([begin, until])).displacement_mm
        if begin in caught_s:
            # Mindlin's annulus: 0.6 k dx^2 of work on the way to full slip, of which the spring keeps 0.5.
            dissipated += 0.1 * stiffness * (at_end - at_begin) ** 2
        worst = max(worst, abs(work - dissipated - 0.5 * stiffness * at_end**2))
        largest = max(largest, work)
    # 60 Gauss points on (1 - s)^(3/2), whose second derivative is infinite at its end: 1e-10 of the work.
    assert worst < 1e-9 * largest
    assert dissipated > 0.5 * work


@pytest.mark.parametrize("speed", [0.1, 20.0])
def test_a_grid_of_loads_a_thousand_times_as_coarse_blows_nothing_up(speed):
    t, load = np.linspace(0.0, 60.0, 60_001), [1.0, 1.0, 1.75, 2.5, 3.25, 4.0, 4.0]
    limit = 0.8 * np.interp(t, np.linspace(0.0, 60.0, 7), load)
    fine, coarse = (Dragged(_drive(load, 60.0, nodes, speed_mm_s=speed, start_s=10.0))(t) for nodes in (30_001, 31))
    # A stiffness that is straight over 2 s while the load grows by 0.15 N: (0.15/1)^2/9 of the limit.
    for seen, close in ((fine, 1e-4), (coarse, 0.0025 * limit.max())):
        assert all(np.isfinite(values).all() for values in seen)
        assert (seen.force_n - limit).max() < close
    # Phases of single slips drift apart; what was slipped in all does not: the skin follows by less than a millimetre.
    assert np.abs(coarse.slip_mm - fine.slip_mm).max() < 2 * fine.displacement_mm.max()
