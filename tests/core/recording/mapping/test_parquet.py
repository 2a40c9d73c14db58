"""Parquet files, written by pyarrow itself."""

import numpy as np
import pytest

from tactbench.core.errors import MappingError

from .made import read

pa = pytest.importorskip("pyarrow", reason="the extra parquet is not installed")
pq = pytest.importorskip("pyarrow.parquet", reason="the extra parquet is not installed")

EPISODES = """
tables:
  frames:
    files: "data/chunk-*/*.parquet"
    read: {format: parquet}
    time: {column: timestamp, unit: s, epoch: start}
split_by: {episode: episode_index}
recording: {name: "episode-{episode}", session: "{episode}"}
streams:
  taxels:
    table: frames
    dtype: float32
    channels: [{columns: observation.state.0..3, name: "s{place}", over: {place: 0..3}, kind: taxel, unit: count}]
    annotations: {task: {column: task}}
  force:
    table: frames
    of: reference
    channels: [{columns: force, name: fz, kind: force, unit: N, sentinels: []}]
"""


def episodes(tables, *, state=None, **columns):
    """Write three episodes of four rows as LeRobot does: all in one file, lists of float32, times in float32."""
    n = 12
    state = np.arange(4 * n, dtype=np.float32).reshape(n, 4).tolist() if state is None else state
    table = {
        "observation.state": pa.array(state, pa.list_(pa.float32())),
        "timestamp": pa.array(np.tile(np.arange(4, dtype=np.float32) / 50, 3)),
        "episode_index": np.repeat(np.arange(3), 4), "frame_index": np.tile(np.arange(4), 3),
        "task": ["press"] * n, "force": pa.array([None, *np.linspace(0.1, 3, n - 1)]),
    } | columns  # fmt: skip
    path = tables.data / "data" / "chunk-000" / "file-000.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.table(table), path)


def test_episodes_of_one_file(tables):
    episodes(tables)
    report = tables.run(EPISODES)
    assert [made.meta.name for made in report.recordings] == ["episode-0", "episode-1", "episode-2"]
    assert (report.missing, report.unused[0].endswith(": frame_index")) == ({"fz": 1}, True)
    _, streams = read(report, 1)
    assert np.array_equal(streams["taxels"].data, np.arange(16, 32, dtype=np.float32).reshape(4, 4))
    assert streams["taxels"].annotations["task"].tolist() == ["press"] * 4
    # A float32 of .02 s is some nanoseconds off, and stays as it is.
    assert streams["taxels"].t_ns.tolist() == [round(float(np.float32(row) / np.float32(50)) * 1e9) for row in range(4)]


def test_stamps_are_dates(tables):
    stamps = np.datetime64("2024-07-01T10:00:00.000000001") + np.arange(12) * np.timedelta64(10, "ms")
    unix = {"tables__frames__time__epoch": "unix", "split_by": {}, "recording": {"name": "{file}", "session": "1"}}
    episodes(tables, timestamp=pa.array(stamps).cast(pa.timestamp("ns", tz="UTC")))
    assert read(tables.run(EPISODES, **unix))[1]["taxels"].t_ns[0] == 1719828000 * 10**9 + 1
    episodes(tables, timestamp=pa.array(stamps))
    tables.out = tables.data / "out"
    with pytest.raises(MappingError, match="zone: UTC"):
        tables.run(EPISODES, **unix)


@pytest.mark.parametrize(
    ("state", "change", "says"),
    [
        ([[1, 2, 3, 4]] * 11 + [[1, 2, 3]], {}, "'observation.state'"),
        ([[1, 2, 3]] * 12, {}, "'observation.state.3'"),
        (None, {"streams__force__channels__0__columns": "forces"}, "'forces'"),
        (None, {"streams__force__channels__0__columns": "task"}, "'task'"),
    ],
)
def test_what_a_file_does_not_have_is_named(tables, state, change, says):
    episodes(tables, state=state)
    tables.refused("file-000.parquet", says, text=EPISODES, **change)
