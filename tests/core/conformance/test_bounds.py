"""What the checks compare, at the bounds: times, rates, limits, units, and the data that estimators and sensors get."""

from types import SimpleNamespace

import numpy as np
import pytest

from tactbench.core.conformance import sensor, streams, task
from tactbench.core.conformance.check import CheckFailed, CheckSkipped
from tactbench.core.conformance.estimator import question
from tactbench.core.conformance.recorded import fits
from tactbench.core.plugins.registry import installed
from tactbench.core.samples import Block, Quality, StreamData
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tactbench.core.spec.skin import FoamPad

FORCE = StreamSpec(name="scale", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
PAD = StreamSpec(name="pad", rate_hz=100.0, channels=(ChannelSpec(name="t1", kind="taxel", lower=-100, upper=100),))


def outcome(check, *given):
    """Return the field that a comparison finds at fault, or an empty text."""
    try:
        check(*given)
    except CheckFailed as failure:
        return failure.where
    return ""


def stream(t_s, data=None, spec=PAD, quality=None):
    t_ns = None if t_s is None else np.round(np.asarray(t_s) * 1e9).astype(np.int64)
    data = np.zeros((len(t_ns), 1)) if data is None else np.asarray(data, dtype=float)[:, None]
    return StreamData(spec, t_ns, data, quality)


@pytest.mark.parametrize(
    ("t_s", "at_fault"),
    [
        (np.arange(101) / 100, ""),
        (np.arange(101) / 103, ""),  # 2 %, and a row at either end
        (np.arange(101) / 105, "pad.rate_hz"),
        (np.arange(111) / 100, "pad.t_ns"),  # 1.1 s in place of 1.0
        (np.arange(101) * 1e-5, "pad.t_ns"),  # microseconds taken for nanoseconds
        ([0.0, 0.5, 0.4, 1.0], "pad.t_ns"),
        ([0.3], ""),
    ],
)
def test_times_ascend_in_nanoseconds_at_the_rate_for_as_long_as_was_recorded(t_s, at_fault):
    assert outcome(streams.times_are_right, "pad", stream(t_s), 1.0, 0.05) == at_fault


@pytest.mark.parametrize(("late_s", "at_fault"), [(0.99, ""), (-0.99, ""), (1.01, "pad.t_ns"), (-1.01, "pad.t_ns")])
def test_times_are_those_of_the_host(late_s, at_fault):
    ended_ns = round((1.0 - late_s) * 1e9)
    assert outcome(streams.times_are_right, "pad", stream(np.arange(101) / 100), 1.0, 0.05, ended_ns) == at_fault


@pytest.mark.parametrize(
    ("factor", "word"), [(102, "gram"), (120, "gram"), (830, "milli"), (-1, "sign"), (1.3, ""), (150, "")]
)
def test_a_wrong_factor_of_a_force_has_its_likely_cause(factor, word):
    assert word in streams.likely(factor)
    assert bool(word) == bool(streams.likely(factor))


@pytest.mark.parametrize(("found_n", "at_fault"), [(2.39, ""), (1.61, ""), (2.41, "force"), (1.59, "force")])
def test_the_force_of_a_press_is_held_within_a_fifth(found_n, at_fault):
    assert outcome(streams.force_is, "force", found_n, 2.0) == at_fault


def test_samples_of_bad_quality_are_left_out_and_others_are_finite_and_within_limits():
    marked = stream(np.arange(3), [1.0, np.nan, 101.0], quality=np.array([[0], [Quality.MISSING], [0]], np.uint8))
    assert np.array_equal(streams.good(marked)[:, 0], [1.0, np.nan, 101.0], equal_nan=True)
    assert outcome(streams.are_finite, "x", marked) == ""
    assert outcome(streams.are_finite, "x", stream(np.arange(2), [1.0, np.inf])) == "x: pad"
    (channel,) = PAD.channels
    assert outcome(streams.within_limits, "t1", channel, np.array([-100.0, np.nan, 100.0])) == ""
    for beyond in (-100.1, 100.1):
        assert outcome(streams.within_limits, "t1", channel, np.array([0.0, beyond])) == "t1"


def test_blocks_become_streams_and_those_of_no_stream_or_of_another_width_do_not():
    def joined(*blocks):
        return streams.joined("read", (PAD, FORCE), blocks)

    rows = np.arange(2) * 10_000_000
    made = joined(Block("pad", rows, np.ones((2, 1))), Block("pad", rows + 20_000_000, np.ones((2, 1))))
    assert (made["pad"].data.shape, made["scale"].data.shape) == ((4, 1), (0, 1))
    assert outcome(joined, Block("other", rows, np.ones((2, 1)))) == "read"
    assert outcome(joined, Block("pad", rows, np.ones((2, 2)))) == "read: pad"


def meta(**more):
    return SimpleNamespace(reference=(FORCE,), own_rates_hz={}, simulated=False, emulation=None, **more)


@pytest.mark.parametrize(
    ("peak_n", "rest", "sign", "at_fault"),
    [
        (100.0, 0, 1, ""),
        (100.5, 0, 1, "reference"),
        (1.0, 100, 1, ""),  # a quarter of the range above the largest reading
        (1.0, 101, 1, "[t1].rest"),
        (1.0, 0, -1, "[t1].sign"),
        (1.0, 0, 0, ""),
    ],
)
def test_a_recording_fits_what_the_spec_states(peak_n, rest, sign, at_fault):
    t_s = np.arange(100) / 100
    force_n = peak_n * (t_s >= 0.5)
    channel = ChannelSpec(
        name="t1", kind="taxel", lower=-100, upper=100, sign=sign, rest=assumed(rest, "count", "test")
    )
    spec = SimpleNamespace(streams=(PAD.model_copy(update={"channels": (channel,)}),))
    data = {"scale": stream(t_s, force_n, FORCE), "pad": stream(t_s, 50 * (force_n > 0) * np.linspace(0.9, 1, 100))}
    assert outcome(fits, meta(), data, spec).endswith(at_fault)
    assert bool(outcome(fits, meta(), data, spec)) == bool(at_fault)


@pytest.mark.parametrize("kind", ["regression", "classification", "events"])
def test_the_question_to_an_estimator_is_always_the_same(kind):
    X, y, new, truth = question(kind)
    assert (X.shape, new.shape) == ((400, 7), (40, 7))
    assert not any(one.flags.writeable for one in (X, y, new, truth))
    sums = {"regression": (2020.132607, 172.235807), "classification": (411, 32), "events": (198, 16)}[kind]
    assert [one.sum() for one in (X, y, new, truth)] == pytest.approx([2726.91097, sums[0], 263.286647, sums[1]])
    assert np.ptp(X[:, 3]) == 0, "a dead taxel"


@pytest.mark.parametrize("name", ["biotac", "icub", "ideal"])
def test_a_state_of_a_skin_holds_the_force_and_is_no_deeper_than_the_skin(name):
    subject = SimpleNamespace(spec=installed().sensors[name].spec)
    grid = sensor.skin_grid(subject.spec.skin.sheet)
    middle = float(grid.x_mm.mean()), 0.0
    for force_n in (0.0, 1.0, 2.0, 100.0):
        state = sensor._state(subject, force_n, middle)
        assert (state.pressure_mpa.sum() * np.prod(grid.cell_mm)) == pytest.approx(force_n, rel=0.05)
        rest = state.thickness_mm + state.deflection_mm
        assert (state.deflection_mm / rest).max() == pytest.approx(min(force_n / 3, 0.9), rel=0.05)
        assert state.depth_mm == state.deflection_mm.max()
        assert (state.contact_radius_mm > 0) == (force_n > 0)


ICUB = installed().sensors["icub"].spec
TAXELS = ICUB.streams[0]


def found_in(check, **changes):
    """Return the field that a check of a changed iCub fingertip finds at fault."""
    return outcome(check.run, SimpleNamespace(spec=ICUB.model_copy(update=changes))).rpartition(".")[2]


def taxels(channel=None, **changes):
    channels = tuple(one.model_copy(update=channel or {}) for one in TAXELS.channels)
    return (TAXELS.model_copy(update={"channels": channels, **changes}),)


@pytest.mark.parametrize(
    ("changes", "at_fault"),
    [
        ({}, ""),
        ({"streams": taxels(rate_hz=0.1)}, ""),
        ({"streams": taxels(rate_hz=0.09)}, "rate_hz"),
        ({"streams": taxels(rate_hz=1e6)}, ""),
        ({"streams": taxels(rate_hz=1e6 + 0.5)}, "rate_hz"),
        ({"streams": taxels(rate_hz=None), "link_delay": assumed(250, "ms", "")}, ""),
        ({"streams": taxels(rate_hz=None), "link_delay": assumed(251, "ms", "")}, "link_delay"),
        ({"streams": taxels(rate_hz=2.0), "link_delay": assumed(1, "s", "")}, ""),
        ({"streams": taxels(rate_hz=2.0), "link_delay": assumed(1.1, "s", "")}, "link_delay"),
        ({"link_delay": assumed(21, "us", "")}, ""),
        ({"link_delay": assumed(19, "us", "")}, "link_delay"),
        ({"link_delay": assumed(0, "us", "")}, ""),
        ({"streams": taxels({"upper": 256})}, "lower, upper"),
        ({"streams": taxels({"lower": -1})}, "lower, upper"),
        ({"streams": taxels({"rest": assumed(256, "count", "")})}, "rest"),
        ({"streams": taxels({"rest": None})}, ""),
    ],
)
def test_limits_rates_and_delays_of_a_spec(changes, at_fault):
    assert found_in(sensor.limits_are_in_order, **changes) == at_fault


@pytest.mark.parametrize(
    ("channel", "at_fault"),
    [
        ({}, ""),
        ({"normal": (0.0, 0.0, 1.0009)}, ""),
        ({"normal": (0.0, 0.0, 1.0011)}, "normal"),
        ({"position_m": (1.0, 0.0, 0.0)}, "position_m"),
        ({"position_m": TAXELS.channels[0].position_m}, "position_m"),  # all at one place
        ({"position_m": None}, "skipped"),
    ],
)
def test_places_of_a_spec(channel, at_fault):
    try:
        found = found_in(sensor.places_are_on_the_skin, streams=taxels(channel))
    except CheckSkipped:
        found = "skipped"
    assert found == at_fault


@pytest.mark.parametrize(
    ("young_mpa", "thick_mm", "at_fault"),
    [(101.0, 2, ""), (103.0, 2, "young, thickness"), (0.06, 2, ""), (0.05, 2, "young, thickness")],
)
def test_a_skin_yields_by_more_than_a_micrometre_and_less_than_its_thickness(young_mpa, thick_mm, at_fault):
    layer = FoamPad.model_construct(young=assumed(young_mpa, "MPa", ""), thickness=assumed(thick_mm, "mm", ""))
    assert found_in(sensor.skin_yields_as_skins_do, skin=layer) == at_fault


@pytest.mark.parametrize(
    ("name", "axes"), [("x1", "x"), ("t3_x", "x"), ("Bx", "x"), ("fz", "z"), ("taxel", ""), ("max", "")]
)
def test_axes_in_names_of_channels(name, axes):
    assert sensor.axes_named(name) == axes


@pytest.mark.parametrize(
    ("labels", "values", "together"),
    [([1, 2, 3], [5, 6, 9], True), ([1, 2, 3], [9, 6, 5], True), ([0, 0, 1], [1, 2, 3], True),
     ([1, 2, 3], [1, 3, 2], False), ([1, 1, 1], [1, 2, 3], False)],
)  # fmt: skip
def test_numbers_that_rise_or_fall_together(labels, values, together):
    assert task._go_together(labels, values) is together
