"""A recording on one clock: what belongs together, what is missing, what it is called."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.plugin import Block, ChannelSpec, StreamSpec, Summary

from .made import evaluated, force_task, label_task, ramp, record, sensor, sensor_of, sessions, write

MS = 1_000_000


def two_streams(path, taxels, vibration, force, unit="N", **more):
    """A sensor with taxels at 100 Hz and vibration at its own times; the force on its own clock, not always there."""
    sensor = sensor_of(
        StreamSpec(name="slow", channels=(ChannelSpec(name="t0", kind="taxel"),)),
        StreamSpec(name="fast", channels=(ChannelSpec(name="v0", kind="ac_pressure"),)),
    )
    reference = StreamSpec(name="ft", channels=(ChannelSpec(name="fz", kind="force", unit=unit),))
    blocks = [
        Block(name, (t_ms * MS).astype(np.int64), values[:, None])
        for name, (t_ms, values) in (("slow", taxels), ("fast", vibration), ("ft", force))
    ]
    return write(path, sensor, *blocks, reference=(reference,), **more)


def test_features_of_several_streams_stand_on_the_clock_of_the_first(tmp_path):
    slow = np.arange(0.0, 100.0, 10.0)
    fast = np.arange(0.0, 100.0, 0.5)
    path = two_streams(tmp_path / "a.h5", (slow, slow), (fast, fast), (slow, slow))
    data = load_dataset(force_task(features=("taxel", "ac_pressure")), [path])
    assert data.features == ("t0", "v0")
    np.testing.assert_array_equal(data.tables[0].X, np.column_stack([slow, slow]))


def test_a_stream_the_sensor_lacks_is_a_reason_and_never_ignored(tmp_path):
    with pytest.raises(NotApplicable, match="vibration"):
        load_dataset(force_task(features=("taxel", "ac_pressure")), sessions(tmp_path))


def test_the_force_is_the_nearest_sample_in_the_unit_of_the_task(tmp_path):
    slow = np.arange(0.0, 100.0, 10.0)
    late = slow + 3.0
    path = two_streams(tmp_path / "a.h5", (slow, slow), (slow, slow), (late, 1000.0 * late), unit="mN")
    (table,) = load_dataset(force_task(), [path]).tables
    np.testing.assert_allclose(table.y, late, rtol=1e-12)
    path = two_streams(tmp_path / "b.h5", (slow, slow), (slow, slow), (slow, slow), unit="count")
    with pytest.raises(DataError, match=r"'fz'.*'count'.*'N'"):
        load_dataset(force_task(), [path])


@pytest.mark.parametrize(("names", "taken"), [(("fx", "fz"), 1), (("normal", "fz"), 0), (("shear", "f"), 1)])
def test_of_several_forces_the_normal_one_is_meant_and_others_have_to_be_named(tmp_path, names, taken):
    values = np.random.default_rng(0).normal(size=(20, 2))
    reference = StreamSpec(name="ft", channels=tuple(ChannelSpec(name=name, kind="force", unit="N") for name in names))
    t_ns = np.arange(20) * 10 * MS

    def made(name, reference):
        blocks = Block("taxels", t_ns, values), Block("ft", t_ns, values)
        return write(tmp_path / name, sensor(2), *blocks, reference=(reference,))

    (table,) = load_dataset(force_task(), [made("a.h5", reference)]).tables
    assert table.y.tolist() == values[:, taken].tolist()
    both = tuple(one.model_copy(update={"name": f"f{place}"}) for place, one in enumerate(reference.channels))
    with pytest.raises(DataError, match="f0, f1"):
        load_dataset(force_task(), [made("b.h5", reference.model_copy(update={"channels": both}))])


def test_without_a_clock_rows_belong_together_only_if_they_are_equally_many(tmp_path):
    X, force = ramp(0, n=50)
    (table,) = load_dataset(force_task(), [record(tmp_path / "a.h5", X, force, t_ns=None)]).tables
    np.testing.assert_array_equal(table.y, force)
    np.testing.assert_array_equal(table.time_s, np.arange(50))


def test_an_answer_from_the_time_alone_needs_a_clock(tmp_path):
    timed, untimed = (sessions(tmp_path / name, "ab", t_ns=t_ns) for name, t_ns in (("t", "regular"), ("u", None)))
    assert evaluated(force_task(), timed, "time-index", split="session").score < 1e-9
    assert evaluated(force_task(), untimed, split="session").score > 0
    with pytest.raises(NotApplicable, match="time-index"):
        evaluated(force_task(), untimed, "time-index", split="session")


WHOLE = label_task(answer_per="recording", splits=("shuffled",), summaries=(Summary(measure="mean"),))


@pytest.mark.parametrize(("n", "t_ns", "rate_hz"), [(1, "regular", None), (2, "regular", 100.0), (5, None, None)])
def test_the_rate_of_a_stream_is_that_of_its_clock(tmp_path, n, t_ns, rate_hz):
    path = record(tmp_path / "a.h5", np.ones((n, 2)), labels={"kind": "a"}, t_ns=t_ns)
    (readings,) = load_dataset(WHOLE, [path]).tables[0].readings
    assert readings.rate_hz == rate_hz


def test_samples_that_a_faster_stream_lacks_are_left_out_of_it_and_counted(tmp_path):
    slow, fast = np.arange(0.0, 100.0, 10.0), np.arange(0.0, 100.0, 0.5)
    values = np.where(np.arange(200) % 50 == 7, np.nan, fast)
    both = WHOLE.model_copy(update={"features": ("taxel", "ac_pressure")})
    lost = np.where(slow == 30, np.nan, slow)
    path = two_streams(tmp_path / "a.h5", (slow, lost), (fast, values), (slow, slow), labels={"kind": "a"})
    data = load_dataset(both, [path])
    assert {text.split()[2]: n for text, n in data.counts.items()} == {"fast": 4, "out": 1}
    assert [(len(one.data), round(one.rate_hz)) for one in data.tables[0].readings] == [(9, 100), (196, 2000)]


def test_time_that_does_not_run_forward_is_refused(tmp_path):
    t = np.arange(0.0, 100.0, 10.0)
    for name, slow, reference, says in (("a", np.full(10, 30.0), t, "stands still"), ("b", t, t[::-1], "backwards 9")):
        path = two_streams(tmp_path / f"{name}.h5", (slow, t), (slow, t), (reference, t))
        with pytest.raises(DataError, match=says):
            load_dataset(force_task(), [path])


def test_several_sensors_and_copies_are_refused_by_name(tmp_path):
    (path,) = sessions(tmp_path, "a", n=50)
    other = record(tmp_path / "b.h5", *ramp(1, n=50), called="raw")
    with pytest.raises(DataError, match=r"made.*raw"):
        load_dataset(force_task(), [path, other])
    (tmp_path / "again").mkdir()
    copy = Path(shutil.copy(path, tmp_path / "again"))
    with pytest.raises(DataError, match="given twice"):
        load_dataset(force_task(), [path, copy])


def gappy(n, at=100, by=50):
    """Times of a recording; that called 1 has a gap."""
    return (np.arange(200) + by * (n == 1) * (np.arange(200) >= at)) * 10 * MS


def whole(n):
    return ramp(n, n=200)


def less(n, rows):
    """A force without its first rows, in the recording called 1."""
    X, force = whole(n)
    force[: rows * (n == 1)] = np.nan
    return X, force


@pytest.mark.parametrize(
    ("made", "more", "numbers"),
    [
        (whole, {}, ""),
        (whole, {"t_ns": gappy}, "1/3/1/0.51"),  # in one recording of three, one gap of so many seconds
        (whole, {"t_ns": lambda n: gappy(1, 100, 50 + n)}, "3/3/0/1"),  # in all, such as 0, one gap
        (whole, {"t_ns": gappy, "simulated": lambda n: True}, ""),  # no clock can have failed
        (lambda n: (whole(n)[0] * [1, 1, n != 1], whole(n)[1]), {}, ""),  # nothing touched it
        (lambda n: less(n, 29), {}, ""),
        (lambda n: less(n, 30), {}, "5/600/30"),  # percent of the rows, and how many have no force
        (lambda n: less(n, 200), {}, "1/3/1"),  # one recording of three without any, called 1
    ],
)  # fmt: skip
def test_what_bears_on_a_score_stands_beside_it(tmp_path, made, more, numbers):
    paths = [
        record(tmp_path / f"{n}.h5", *made(n), session=f"{n}", **{key: of(n) for key, of in more.items()})
        for n in range(3)
    ]
    found = evaluated(force_task(), paths, split="session").findings
    assert len(found) == bool(numbers)
    assert all("/".join(re.findall(r"[0-9.]+", text)).startswith(numbers) for text in found)


@pytest.mark.parametrize("lost", [4, 5])
def test_of_many_recordings_that_are_left_out_the_first_are_named(tmp_path, lost):
    paths = [record(tmp_path / f"{n}.h5", *ramp(n, n=20)) for n in range(lost, 7)]
    paths += [record(tmp_path / f"{n}.h5", ramp(n, n=20)[0], np.full(20, np.nan)) for n in range(lost)]
    (found,) = load_dataset(force_task(), sorted(paths)).findings
    assert re.findall("[0-9]", found.rpartition(":")[2]) == list("0123")
    assert found.endswith("…") == (lost > 4)


def test_a_fault_of_a_channel_that_the_task_does_not_look_at_is_no_finding(tmp_path):
    t = np.arange(0.0, 1000.0, 10.0)
    late = np.where(t > 960, t + 400, t)
    for task, n in ((force_task(), 0), (force_task(features=("taxel", "ac_pressure")), 1)):
        path = two_streams(tmp_path / f"{n}.h5", (t, t), (late, t), (t, t))
        assert len(load_dataset(task, [path]).findings) == n


def test_a_recording_whose_clocks_never_meet_is_left_out_and_named(tmp_path):
    t = np.arange(0.0, 1000.0, 10.0)
    apart, good = (
        two_streams(tmp_path / f"{name}.h5", (t, t), (t, t), (t + by, t)) for name, by in (("a", 36e5), ("b", 0))
    )
    with pytest.raises(NotApplicable):
        load_dataset(force_task(), [apart])
    (found,) = load_dataset(force_task(), [apart, good]).findings
    assert found.endswith(": a")


@pytest.mark.parametrize(
    ("names", "n"),
    [
        (("Coke", "coke"), 1),
        (("a b", "ab"), 1),
        (("1 12", "11 2"), 0),
        (("Stra\u00dfe", "strasse "), 1),
        (("a", "b"), 0),
    ],
)
def test_labels_that_differ_by_case_or_spaces_are_named(tmp_path, names, n):
    paths = [record(tmp_path / f"{n}.h5", *ramp(n), labels={"kind": names[n % 2]}, session=f"{n}") for n in range(4)]
    by_class = evaluated(label_task(), paths, "majority", split="session").findings
    by_group = evaluated(force_task(splits=("kind",)), paths, split="kind").findings
    assert [len(by_class), len(by_group)] == [n, n]
    assert all(repr(name) in text for text in (*by_class, *by_group) for name in names)
