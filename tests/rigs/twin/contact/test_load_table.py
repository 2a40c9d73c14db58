from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import load_object
from tactbench.rigs.twin.contact.load_table import Interpolant, build_table
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.shell import with_core
from tactbench.rigs.twin.geometry import Contact, gap_mm
from tests.hard.families.contact import press_of

FLAT = math.inf


def _press(spec, radius, x, s=0.0):
    return press_of(spec.skin, Contact(radius, x, s))


def _prototype(prototype, radius):
    below, skin = prototype("biotac", core=False)
    contact = Contact(radius, -5.0, 0.0)
    gap = gap_mm(below.grid, contact, skin.sheet)
    return Press(below, gap, contact, core=lambda made: with_core(made, skin))


def _table(spec, radius, x, s=0.0, largest=5.0):
    press = _press(spec, radius, x, s)
    names = [channel.name for channel in spec.channels("taxel")]
    read = load_object(f"tactbench.sensors.{spec.name}.transduction:build")(spec, press.medium.grid, names)
    return build_table(press, read, largest_n=largest, tolerance=np.full(len(names), 0.45)), read


@pytest.mark.parametrize(
    ("name", "radius", "x", "s"), [("icub", 5.0, -0.3, 0.1), ("icub", FLAT, -0.3, -0.2), ("biotac", 10.0, -4.9, 0.07)]
)
def test_the_reported_bound_holds_at_random_loads(specs, name, radius, x, s):
    table, read = _table(specs[name], radius, x, s)
    direct = _press(specs[name], radius, x, s)
    loads = np.random.default_rng(7).uniform(0, 5, 12)
    worst = max(float(np.abs(read(direct(load)) - table(np.array([load]))[0]).max()) for load in loads)
    # The bound itself is the tolerance; it must say something: a few counts beside responses of 30 to 300.
    assert worst <= table.error.max()
    assert table.error.max() < 0.05 * np.ptp(table.readings, axis=0).max()
    assert table.loads_n.size <= 14
    assert table.residual < 1e-6


# First load at which the film closes, x0 = -5, from an independent implementation: printed with two decimals, and
# the bracket is 0.01 N wide.
@pytest.mark.parametrize(("radius", "load"), [(5.0, 0.96), (10.0, 1.15), (40.0, 3.44), (FLAT, None)])
def test_touch_down_is_bracketed(prototype, radius, load):
    press = _prototype(prototype, radius)
    table = build_table(press, lambda state: np.array([state.depth_mm]), largest_n=5.0, tolerance=np.array([1e-3]))
    if load is None:
        assert table.touch_down_n is None
        assert not press.touched_core
        return
    low, high = table.touch_down_n
    assert high - low <= 0.01
    assert press.closing_at(low) <= 0 < press.closing_at(high)
    # Half of the last decimal, and one bracket.
    assert low - 0.01 - 0.005 <= load <= high + 0.01 + 0.005
    assert press.touched_core


def test_rest_is_exact_tiny_loads_are_continuous_and_loads_beyond_are_held(specs):
    table, read = _table(specs["icub"], 10.0, -0.3, largest=2.0)
    np.testing.assert_array_equal(table(np.array([3.0])), table(np.array([2.0])))
    rest = read(_press(specs["icub"], 10.0, -0.3)(0.0))
    np.testing.assert_array_equal(table(np.array([0.0]))[0], rest)
    # A nanonewton moves no reading by more than a nanonewton's worth of the steepest slope (1e4 counts/N).
    np.testing.assert_allclose(table(np.array([1e-9]))[0], rest, atol=1e-5)


@given(st.lists(st.floats(0.05, 1.0), min_size=1, max_size=12), st.data())
def test_monotone_nodes_give_a_monotone_interpolant(steps, data):
    x = np.concatenate([[0.0], np.cumsum(steps)])
    rises = data.draw(st.lists(st.floats(0, 10), min_size=len(steps), max_size=len(steps)))
    y = np.concatenate([[0.0], np.cumsum(rises)])[:, None]
    curve = Interpolant(x.tolist(), y)
    fine = curve(np.linspace(0, x[-1], 400))[:, 0]
    np.testing.assert_allclose(curve(x), y, atol=1e-10)
    # Rounding of cubics of size up to 120 with slopes over 0.05.
    assert np.diff(fine).min() >= -1e-9 * (1 + y[-1, 0])


def test_no_cubic_crosses_a_break():
    x = np.linspace(0, 2, 9)
    y = np.where(x < 1, x, 1 + 10 * (x - 1))[:, None]
    fine = np.linspace(0, 2, 101)
    exact = np.where(fine < 1, fine, 1 + 10 * (fine - 1))
    broken, whole = (np.abs(Interpolant(x.tolist(), y, one)(fine)[:, 0] - exact) for one in ((0.75, 1.0), None))
    np.testing.assert_allclose(broken[fine <= 1], 0, atol=1e-12)
    assert whole[fine <= 1].max() > 0.05
    assert broken.max() < 0.05  # above, the cubics are of another variable


@given(
    st.lists(st.floats(0.05, 1.0), min_size=3, max_size=9),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.3]) | st.floats(0, 1),
    st.just(1.0) | st.floats(0, 1),
    st.booleans(),
)
def test_no_slope_is_steeper_than_the_steepest_and_one_comes_near(gaps, seed, one, other, touches):
    loads = np.concatenate([[0.0], np.cumsum(gaps)])
    values = np.random.default_rng(seed).standard_normal((loads.size, 3)).cumsum(axis=0)
    curve = Interpolant(loads.tolist(), values, tuple(loads[1:3]) if touches else None)
    low, high = sorted((one * loads[-1], other * loads[-1]))
    bound = curve.steepest(low, high)
    if high - low < 1e-3:
        assert np.all(np.isfinite(bound))
        return
    at = np.linspace(low, high, 4001)
    seen = np.abs(np.diff(curve(at), axis=0)).max(axis=0) / (at[1] - at[0])
    # Rounding of the values over the step between two loads.
    assert np.all(seen <= bound + 1e-13 * np.abs(values).max() / (at[1] - at[0]))
    if low == 0.0 and high == loads[-1]:
        # Within an interval of up to 1 N the power's factor changes by at most 2.14 to 1.
        assert np.all(bound <= 2.2 * seen + 1e-9)
