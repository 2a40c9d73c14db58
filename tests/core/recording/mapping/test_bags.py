"""MCAP bags, written by the library itself."""

import json
from contextlib import contextmanager

import numpy as np
import pytest

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.importing import import_tables
from tactbench.core.recording.reader import open_recording

from .made import write_mapping

mcap_writer = pytest.importorskip("mcap.writer", reason="the extra mcap is not installed")
ros2_writer = pytest.importorskip("mcap_ros2.writer", reason="the extra mcap is not installed")

START = 1_700_000_000 * 10**9
HEADER = """================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
TAXELS = f"std_msgs/Header header\nfloat32[] data\nstring object\n{HEADER}"
VECTOR = f"{HEADER.splitlines()[0]}\nMSG: force_msgs/Vector\nfloat64 z\n"
FORCE = f"std_msgs/Header header\nforce_msgs/Vector force\n{HEADER}{VECTOR}"


def stamped(t_ns):
    return {"stamp": {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}, "frame_id": "pad"}


def ros_bag(path, rows=200):
    """Taxels at 100 Hz whose stamps are 5 ms older than their log time, force at 1 kHz; chunks of some 4 kB."""
    with path.open("wb") as opened:
        writer = ros2_writer.Writer(opened, chunk_size=4096)
        taxels = writer.register_msgdef("pad_msgs/msg/Taxels", TAXELS)
        force = writer.register_msgdef("force_msgs/msg/Force", FORCE)
        for row in range(rows):
            t_ns = START + row * 10**7
            message = {"header": stamped(t_ns), "data": [row, row + 0.5, -row], "object": f"ball{row // 100}"}
            writer.write_message("/taxels", taxels, message, log_time=t_ns + 5 * 10**6)
            for part in range(10):
                later = t_ns + part * 10**6
                message = {"header": stamped(later), "force": {"z": row + 0.1 * part}}
                writer.write_message("/force", force, message, log_time=later + 1)
        writer.finish()
    return path


BAG = """
tables:
  taxels:
    files: "*.mcap"
    read: {format: mcap, topic: /taxels}
    time: {column: header.stamp, unit: ns, epoch: unix}
  force:
    files: "*.mcap"
    read: {format: mcap, topic: /force}
    time: {column: log_time, unit: ns, epoch: unix}
join: {by: clock}
streams:
  taxels:
    table: taxels
    dtype: float32
    channels: [{columns: data.0..2, name: "{column}", kind: taxel, unit: count}]
    annotations: {object: {column: object}}
  force:
    table: force
    of: reference
    channels: [{columns: force.z, name: fz, kind: force, unit: N, sentinels: []}]
"""


def imported(folder, **changes):
    report = import_tables(write_mapping(folder / "bag.yaml", BAG, **changes), root=None, out=folder / "out")
    with open_recording(report.recordings[0].path) as recording:
        return {name: recording.read(name) for name in recording.stream_names}


def test_topics_become_streams_with_clocks_of_their_own(tmp_path):
    ros_bag(tmp_path / "press.mcap")
    streams = imported(tmp_path)
    taxels, force = streams["taxels"], streams["force"]
    row = np.arange(200)
    assert np.array_equal(taxels.data, np.stack([row, row + 0.5, -row], axis=1))
    assert np.array_equal(taxels.t_ns, START + row * 10**7), "by the stamp of the header"
    assert taxels.annotations["object"].tolist() == ["ball0"] * 100 + ["ball1"] * 100
    assert np.array_equal(force.t_ns, START + np.arange(2000) * 10**6 + 1), "by the log time"
    assert force.data[:, 0] == pytest.approx(np.repeat(row, 10) + 0.1 * np.tile(np.arange(10), 200), abs=1e-12)


@contextmanager
def plain_bag(folder):
    with (folder / "press.mcap").open("wb") as opened:
        writer = mcap_writer.Writer(opened)
        writer.start()
        yield writer
        writer.finish()


def test_json_messages(tmp_path):
    with plain_bag(tmp_path) as writer:
        taxels, force = (writer.register_channel(topic, "json", 0) for topic in ("/taxels", "/force"))
        for row in range(20):
            t_ns = START + row * 10**7
            stamp = {"sec": t_ns // 10**9, "nsec": t_ns % 10**9}
            press = {"header": {"stamp": stamp}, "data": [row, 1, np.nan if row == 3 else 2], "object": 1}
            for channel, message in ((taxels, press), (force, {"force": {"z": row}, "t": row / 8})):
                writer.add_message(channel, t_ns, json.dumps(message).encode(), t_ns)
    time = {"column": "t", "unit": "s", "epoch": "start", "offset_s": START / 1e9}
    streams = imported(tmp_path, tables__force__time=time)
    assert np.isnan(streams["taxels"].data[3, 2])
    assert np.array_equal(streams["taxels"].t_ns, START + np.arange(20) * 10**7)
    assert np.array_equal(streams["force"].t_ns, START + np.arange(20) * 125_000_000)


def test_a_damaged_bag_is_refused_and_nothing_is_left(tmp_path):
    path = ros_bag(tmp_path / "press.mcap")
    whole = path.read_bytes()
    middle = len(whole) // 2
    for damaged in (whole[:middle], whole[:-1], whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]):
        path.write_bytes(damaged)
        with pytest.raises(MappingError, match=r"press\.mcap") as found:
            imported(tmp_path)
        assert "mcap recover" in found.value.hint
        assert not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"tables__force__read__topic": "/forces"}, "'/forces'"),
        ({"streams__taxels__channels__0__columns": "data.3"}, r"'data\.3'"),
        ({"tables__taxels__time__unit": "ms"}, "unit: ns"),
    ],
)
def test_what_a_bag_does_not_have_is_named(tmp_path, changes, says):
    ros_bag(tmp_path / "press.mcap", rows=3)
    with pytest.raises(MappingError, match=says):
        imported(tmp_path, **changes)


def test_another_encoding_is_named(tmp_path):
    with plain_bag(tmp_path) as writer:
        channel = writer.register_channel("/taxels", "protobuf", writer.register_schema("pad.Taxels", "protobuf", b""))
        writer.add_message(channel, START, b"\x08\x01", START)
    with pytest.raises(MappingError, match="protobuf"):
        imported(tmp_path)
