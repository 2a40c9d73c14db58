"""A recording on one clock: what belongs together, what is missing, what it is called."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.samples import Quality
from tactbench.plugin import Block, ChannelSpec, StreamSpec

from .made import evaluated, force_task, ramp, record, sensor_of, sessions, write

MS = 1_000_000


def two_streams(path, taxels, vibration, force, unit="N"):
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
    return write(path, sensor, *blocks, reference=(reference,))


def test_features_of_several_streams_stand_on_the_clock_of_the_first(tmp_path):
    slow = np.arange(0.0, 100.0, 10.0)
    fast = np.arange(0.0, 100.0, 0.5)
    path = two_streams(tmp_path / "a.h5", (slow, slow), (fast, fast), (slow, slow))
    data = load_dataset(force_task(features=("taxel", "ac_pressure")), [path])
    assert data.features == ("t0", "v0")
    np.testing.assert_array_equal(data.tables[0].X, np.column_stack([slow, slow]))


def test_a_stream_the_sensor_lacks_is_a_reason_and_never_ignored(tmp_path):
    with pytest.raises(NotApplicable, match="needs a vibration stream; made has none"):
        load_dataset(force_task(features=("taxel", "ac_pressure")), sessions(tmp_path))


def test_the_force_is_the_nearest_sample_in_the_unit_of_the_task(tmp_path):
    slow = np.arange(0.0, 100.0, 10.0)
    late = slow + 3.0
    path = two_streams(tmp_path / "a.h5", (slow, slow), (slow, slow), (late, 1000.0 * late), unit="mN")
    (table,) = load_dataset(force_task(), [path]).tables
    np.testing.assert_allclose(table.y, late, rtol=1e-12)
    path = two_streams(tmp_path / "b.h5", (slow, slow), (slow, slow), (slow, slow), unit="count")
    with pytest.raises(DataError, match="'fz' is recorded in 'count', which is no 'N'"):
        load_dataset(force_task(), [path])


def test_without_a_clock_rows_belong_together_only_if_they_are_equally_many(tmp_path):
    X, force = ramp(0, n=50)
    (table,) = load_dataset(force_task(), [record(tmp_path / "a.h5", X, force, t_ns=None)]).tables
    np.testing.assert_array_equal(table.y, force)
    np.testing.assert_array_equal(table.time_s, np.arange(50))


def test_an_answer_from_the_time_alone_needs_a_clock(tmp_path):
    timed, untimed = (sessions(tmp_path / name, "ab", t_ns=t_ns) for name, t_ns in (("t", "regular"), ("u", None)))
    assert evaluated(force_task(), timed, "time-index", split="session").score < 1e-9
    assert evaluated(force_task(), untimed, split="session").score > 0
    with pytest.raises(NotApplicable, match="time-index looks at the time alone, which not all"):
        evaluated(force_task(), untimed, "time-index", split="session")


def test_flagged_samples_are_kept_and_counted(tmp_path):
    quality = np.zeros((50, 3), dtype=np.uint8)
    quality[3:10, 0], quality[20, 1] = Quality.SATURATED, Quality.SUSPECT
    data = load_dataset(force_task(), sessions(tmp_path, "a", 50, quality=quality))
    assert (data.counts["saturated samples kept"], data.counts["suspect samples kept"]) == (7, 1)
    assert len(data.tables[0].row) == 50


def test_time_that_does_not_run_forward_is_refused(tmp_path):
    t = np.arange(0.0, 100.0, 10.0)
    for name, slow, reference, says in (("a", np.full(10, 30.0), t, "stands still"), ("b", t, t[::-1], "backwards 9")):
        path = two_streams(tmp_path / f"{name}.h5", (slow, t), (slow, t), (reference, t))
        with pytest.raises(DataError, match=says):
            load_dataset(force_task(), [path])


def test_several_sensors_and_copies_are_refused_by_name(tmp_path):
    (path,) = sessions(tmp_path, "a", n=50)
    other = record(tmp_path / "b.h5", *ramp(1, n=50), called="raw")
    with pytest.raises(DataError, match="'a' of made and 'b' of raw"):
        load_dataset(force_task(), [path, other])
    (tmp_path / "again").mkdir()
    copy = Path(shutil.copy(path, tmp_path / "again"))
    with pytest.raises(DataError, match="'a' is given twice"):
        load_dataset(force_task(), [path, copy])
