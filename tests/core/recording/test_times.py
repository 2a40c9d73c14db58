"""Raw times are kept as they came, and the stored times are exactly what the lines make of them."""

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactbench.core.errors import FormatError
from tactbench.core.recording.clock_fit import HostTimes
from tactbench.core.recording.health import examine
from tactbench.core.recording.reader import open_recording
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.recording import StreamClock, StreamCounts

START = 1_700_000_000_000_000_000


def record(path, meta, device, host, blocks=7):
    """Write taxels with a device clock, in `blocks` blocks."""
    with RecordingWriter(path, meta) as writer:
        for rows in np.array_split(np.arange(len(device)), blocks):
            data = np.full((len(rows), 3), 9, dtype=np.uint16)
            writer.append(Block("taxels", host[rows], data, device_ns=device[rows]))
    return path


def clocked(seed, rows=4000):
    rng = np.random.default_rng(seed)
    device = np.arange(rows, dtype=np.int64) * 10_000_000 + int(rng.integers(0, 2**40))
    true = device + START + np.rint((device - device[0]) * 37e-6).astype(np.int64)
    return device, true, true + rng.exponential(500_000, rows).astype(np.int64)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**32), st.integers(1, 50), st.integers(0, 4000))
def test_stored_times_are_exactly_recomputed(tmp_path_factory, make_meta, seed, blocks, lost):
    """Over 40 s, with a counter that begins again at some row."""
    device, _, host = clocked(seed)
    device[lost:] -= device[lost] if lost < 4000 else 0
    folder = tmp_path_factory.mktemp("times")
    path = record(folder / "x.h5", make_meta(), device, host, blocks)
    with open_recording(path) as recording:
        recording.verify()
        read, clock = recording.read("taxels"), recording.meta.clocks["taxels"]
    assert np.array_equal(read.device_ns, device)
    assert np.array_equal(read.host_ns, host)
    assert np.array_equal(read.t_ns, HostTimes(clock)(read.device_ns))
    assert clock.breaks == (0 < lost < 4000)


def test_stored_times_are_the_hosts_within_the_bound(tmp_path, make_meta):
    device, true, host = clocked(1)
    with open_recording(record(tmp_path / "x.h5", make_meta(), device, host)) as recording:
        read, clock = recording.read("taxels"), recording.meta.clocks["taxels"]
    assert clock.method == "hull-1way"
    assert [round(one.drift * 1e6) for one in clock.segments] == [37, 37]  # 37 ppm; 40 s are two stretches
    assert np.abs(read.t_ns - true).max() <= max(one.bound_ns for one in clock.segments)
    assert np.abs(host - true).max() > 3_000_000


@pytest.mark.parametrize(
    "fields",
    [{"clocks": {"taxels": StreamClock(source="host")}}, {"clocks": {"taxels": StreamClock(source="simulated")}}],
)
def test_where_the_device_is_not_the_clock_times_are_as_they_came(tmp_path, make_meta, fields):
    device, _, host = clocked(2)
    with open_recording(record(tmp_path / "x.h5", make_meta(**fields), device, host)) as recording:
        read = recording.read("taxels")
        assert recording.meta.clocks == fields.get("clocks", {})
    assert np.array_equal(read.t_ns, host)
    assert np.array_equal(read.device_ns, device)
    assert read.host_ns is None


@pytest.mark.parametrize("name", ["host_ns", "device_ns"])
def test_a_file_without_its_raw_times_is_refused(tmp_path, make_meta, name):
    path = record(tmp_path / "x.h5", make_meta(), *clocked(3)[::2])
    with h5py.File(path, "a") as file:
        del file[f"streams/taxels/{name}"]
    with open_recording(path) as recording, pytest.raises(FormatError, match="do not go with"):
        recording.read("taxels")


def test_lost_rows_are_told(tmp_path, make_meta):
    counts = StreamCounts(received=4010, written=4000, dropped=7, duplicates=2, gaps=5)
    path = record(tmp_path / "x.h5", make_meta(streams={"taxels": counts}), *clocked(3)[::2])
    with open_recording(path) as recording:
        found = {finding.check: finding for finding in examine(recording)}
    assert found["lost"].severity == "warning"
    assert found["lost"].message == "taxels lost rows: 5 never came, 7 were dropped because writing was behind"
    assert found["repeated"].message == "taxels: 2 rows came twice or late, and were kept out"
    assert found["unaccounted"].count == 1  # 4010 received, 4009 of them written, dropped or kept out
