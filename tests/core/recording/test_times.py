"""Raw times are kept as they came, and the stored times are exactly what the lines make of them."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactbench.core.recording.clock_fit import host_times
from tactbench.core.recording.reader import open_recording
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.recording import StreamClock
from tests.core.recording.conftest import about

START = 1_700_000_000_000_000_000


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**32), st.integers(1, 50), st.integers(0, 4000), st.sampled_from([None, "host"]))
def test_stored_times_are_exactly_recomputed_or_as_they_came_where_the_device_is_no_clock(
    tmp_path, seed, blocks, lost, source
):
    """Taxels over 40 s, two with each stamp of the device, whose counter may begin again."""
    rng = np.random.default_rng(seed)
    device = np.arange(4000, dtype=np.int64) // 2 * 20_000_000 + int(rng.integers(1, 2**40))
    host = device + START + (device - device[0]) * 37 // 1_000_000 + rng.exponential(500_000, 4000).astype(int)
    device[lost:] -= device[lost] if 0 < lost < 4000 else 0
    clocks = {"taxels": StreamClock(source=source)} if source else {}
    (tmp_path / "x.h5").unlink(missing_ok=True)
    with RecordingWriter(tmp_path / "x.h5", about(clocks=clocks)) as writer:
        for rows in np.array_split(np.arange(4000), blocks):
            writer.append(Block("taxels", host[rows], np.full((len(rows), 3), 9), device_ns=device[rows]))
    with open_recording(tmp_path / "x.h5") as recording:
        recording.verify()
        read, found = recording.read("taxels"), recording.meta.clocks
    assert np.array_equal(read.device_ns, device)
    if source:
        assert (found, read.host_ns) == (clocks, None)
        assert np.array_equal(read.t_ns, host)
    else:
        assert np.array_equal(read.host_ns, host)
        assert np.array_equal(read.t_ns, host_times(found["taxels"].segments, read.device_ns))
        assert found["taxels"].breaks == (0 < lost < 4000)
