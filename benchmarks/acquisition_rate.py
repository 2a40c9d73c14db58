"""Devices at full rate, read at once and written to a recording in real time: no row may be lost on the way.

Two loads of synthetic devices: ``biotac`` (22 channels at 100 Hz and one at 2200 Hz in a batch every 10 ms, force with
6 channels at 1 kHz, one row a datagram) and ``wide`` (64 channels of int16 at 5 kHz in datagrams of 10 rows, the same
force). Another process sends them over UDP on loopback, with counters of 16 bits and device times; this one reads them
as ``Reading`` does and writes what it yields, which is what a rig of devices does. With ``--rig-file`` the devices of
that file are read instead; those that it says are emulated run in a thread of this process.

Printed: rows received, written, dropped, missing by the devices' counters; how full the queues got; this process' share
of one core while recording, its memory, and how long the file took to complete. ``--stall`` lets the writer stand
still for so long, once, after a third of the time: up to the queues' 5 s nothing may be lost, beyond that what is lost
is counted and marked. The finished file is opened and its numbers are compared. Exit code 1: rows were lost
(without ``--stall``), or the counts contradict the file.

Usage: python benchmarks/acquisition_rate.py [--load wide|biotac] [--seconds 60] [--stall 0] [--on DIR]
       python benchmarks/acquisition_rate.py --rig-file FILE --sensor biotac [--seconds 60] [--on DIR]
"""

from __future__ import annotations

import argparse
import os
import resource
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.yaml_file import load_yaml
from tactbench.plugin import Block, ChannelSpec, Quality, SensorSpec, Source, StreamSpec, load_registry
from tactbench.plugin.devices import Clock, Driver, LinkTimeout, Reading, RigFile, Unwrap, open_link

HEAD = struct.Struct("<IQ")
"""Number of the first row, modulo 2^16; its time on the device's clock, nanoseconds."""
BITS = 16
FIRST = (1 << BITS) - 1000
"""Number of the first row of all: the counters wrap soon."""
START, STOP = b"start", b"stop"
TICK_S = 0.001


class Device(NamedTuple):
    """One synthetic device with one stream."""

    name: str
    rate_hz: float
    channels: int
    dtype: str
    rows: int
    """In a datagram."""


FORCE = Device("force_torque", 1000.0, 6, "float64", 1)
LOADS = {
    "biotac": (Device("electrodes", 100.0, 22, "uint16", 1), Device("vibration", 2200.0, 1, "uint16", 22), FORCE),
    "wide": (Device("taxels", 5000.0, 64, "int16", 10), FORCE),
}


def stream_of(device: Device) -> StreamSpec:
    """Return what a device says of its stream."""
    kind = "force" if device is FORCE else "taxel"
    channels = tuple(
        ChannelSpec(name=f"{device.name}{k}", kind=kind, unit="N" if device is FORCE else "count")
        for k in range(device.channels)
    )
    return StreamSpec(name=device.name, rate_hz=device.rate_hz, dtype=device.dtype, channels=channels)


def send(load: str) -> None:
    """Be the devices: print a port each, send from the start on until the stop, then print how many rows went out."""
    devices = LOADS[load]
    rng = np.random.default_rng(1)
    sockets = []
    for _ in devices:
        end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        end.bind(("127.0.0.1", 0))
        print(end.getsockname()[1], flush=True)
        sockets.append(end)
    # A second of noise of a few counts, sent again and again: its bytes do not matter, that they compress badly does.
    noise = [
        rng.integers(1000, 1100, (round(device.rate_hz), device.channels)).astype(device.dtype) for device in devices
    ]
    peers: list[object] = [None] * len(devices)
    began = [0.0] * len(devices)
    sent = [0] * len(devices)
    running = [True] * len(devices)
    while any(running):
        for k, (device, end) in enumerate(zip(devices, sockets, strict=True)):
            if select.select([end], [], [], 0)[0]:
                word, peers[k] = end.recvfrom(16)
                began[k] = time.monotonic() if word == START else began[k]
                running[k] = word != STOP
            if peers[k] is None or not running[k]:
                continue
            due = int((time.monotonic() - began[k]) * device.rate_hz)
            while sent[k] + device.rows <= due:
                place = sent[k] % len(noise[k])
                head = HEAD.pack((FIRST + sent[k]) % (1 << BITS), round(1e9 * sent[k] / device.rate_hz))
                end.sendto(head + noise[k][place : place + device.rows].tobytes(), peers[k])
                sent[k] += device.rows
        time.sleep(TICK_S - time.monotonic() % TICK_S)
    for device, rows in zip(devices, sent, strict=True):
        print(device.name, rows, flush=True)


class SyntheticDriver(Driver):
    """Reads one synthetic device: all datagrams that are there, as one block."""

    def __init__(self, device: Device, port: int) -> None:
        self._device = device
        self._link = open_link(f"udp://127.0.0.1:{port}")
        self._unwrap = Unwrap(BITS)
        self._datagrams = 0

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """Its one stream."""
        return (stream_of(self._device),)

    @property
    def counts(self) -> Mapping[str, int]:
        """How many datagrams came."""
        return {"datagrams": self._datagrams}

    def identify(self) -> Mapping[str, str]:
        """Return its name."""
        return {"model": self._device.name}

    def start(self) -> None:
        """Let it send."""
        self._link.send(START)

    def read(self, timeout_s: float) -> list[Block]:
        """Return what has come."""
        came = []
        try:
            came.append(self._link.receive(timeout_s))
            while True:
                came.append(self._link.receive(0.0))
        except LinkTimeout:
            if not came:
                return []
        self._datagrams += len(came)
        rows = self._device.rows
        heads = np.array([HEAD.unpack_from(received.data) for received in came])
        data = np.frombuffer(b"".join(received.data[HEAD.size :] for received in came), self._device.dtype)
        times = np.repeat([received.t_ns for received in came], rows)
        after = np.tile(np.arange(rows), len(came))
        counts = np.repeat(heads[:, 0], rows) + after
        device_ns = np.repeat(heads[:, 1].astype(np.int64), rows) + np.rint(1e9 * after / self._device.rate_hz)
        return [
            Block(
                self._device.name,
                times,
                data.reshape(-1, self._device.channels),
                sequence=self._unwrap(counts),
                device_ns=device_ns.astype(np.int64),
            )
        ]

    def stop(self) -> None:
        """Let it send no more."""
        self._link.send(STOP)

    def close(self) -> None:
        """Close the link."""
        self._link.close()


@contextmanager
def synthetic(load: str) -> Iterator[tuple[dict[str, Driver], subprocess.Popen[str]]]:
    """Yield the drivers of a load, and the process that is its devices."""
    sender = subprocess.Popen(
        [sys.executable, __file__, "--send", load], stdout=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL
    )
    with ExitStack() as opened:
        opened.callback(sender.wait)
        opened.callback(sender.terminate)
        assert sender.stdout is not None
        drivers: dict[str, Driver] = {}
        for device in LOADS[load]:
            drivers[device.name] = opened.enter_context(SyntheticDriver(device, int(sender.stdout.readline())))
        yield drivers, sender


@contextmanager
def of_rig_file(path: Path, sensor: str) -> Iterator[tuple[dict[str, Driver], Clock]]:
    """Yield the drivers of a rig file's sensor and force sensor, and their clock; emulated ones are at rest."""
    from tactbench.devices.emulation.real_time import RealTimeDevices
    from tactbench.devices.rig_devices import drivers_of, emulators_of

    file = load_yaml(path, RigFile)
    registry = load_registry()
    devices = emulators_of(file, registry, sensor, lambda t_s: {})
    with RealTimeDevices(devices) as emulated, ExitStack() as opened:
        openers = {name: partial(open_link, emulated.addresses[name], emulated.clock) for name in devices}
        drivers = drivers_of(file, registry, sensor, openers, emulated.clock)
        for driver in drivers.values():
            opened.enter_context(driver)
        yield drivers, emulated.clock


def memory_mb(what: str) -> float:
    """Return a line of this process' status, megabytes: VmRSS is now, VmHWM was the most."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{what}:"):
            return int(line.split()[1]) / 1000
    raise SystemExit(f"the system does not say {what}")


def cpu_s() -> float:
    """Return the processor time of this process so far, seconds."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def record(
    drivers: dict[str, Driver], clock: Clock, path: Path, seconds: float, stall_s: float
) -> tuple[Reading, float]:
    """Record for `seconds`; print what it took; return the reading and the seconds until the file was complete."""
    streams = [spec for driver in drivers.values() for spec in driver.streams]
    meta = RecordingMeta(
        name="rate",
        sensor=SensorSpec(
            name="synthetic",
            title="devices at full rate",
            principle="none",
            principle_source=Source(tag="assumed", reference="made up for this benchmark"),
            streams=tuple(spec for spec in streams if spec.name != FORCE.name),
        ),
        reference=tuple(spec for spec in streams if spec.name == FORCE.name),
        rig="bench",
        clock="host",
    )
    with RecordingWriter(path, meta) as writer:
        blocks = longest = 0
        before = memory_mb("VmRSS")
        Path("/proc/self/clear_refs").write_text("5")  # VmHWM begins at VmRSS again
        with Reading(drivers, clock=clock) as reading:
            at_first, cpu_at_first = time.monotonic(), cpu_s()
            after_stall = 0.0
            for block in reading.blocks(seconds):
                since = time.monotonic() - at_first
                if stall_s and not after_stall and since > seconds / 3:
                    time.sleep(stall_s)
                    after_stall = memory_mb("VmRSS")
                writer.append(block)
                blocks += 1
                longest = max(longest, len(block.data))
            took, used = time.monotonic() - at_first, cpu_s() - cpu_at_first
        peak = memory_mb("VmHWM")
        print(f"recorded for {took:.2f} s, {used:.2f} s of CPU: {100 * used / took:.1f} % of one core")
        print(f"{blocks} blocks appended, the longest of {longest} rows")
        stalled = f", {after_stall:.1f} MB after the writer stood for {stall_s:g} s" if stall_s else ""
        print(f"memory {before:.1f} MB before{stalled}, at most {peak:.1f} MB: {peak - before:+.1f} MB")
        began = time.monotonic()
    return reading, time.monotonic() - began


def compared(reading: Reading, path: Path) -> list[str]:
    """Print what became of the rows; return what contradicts: counts each other, or the file."""
    import h5py

    wrong = []
    print(f"{'stream':14} {'received':>10} {'written':>10} {'dropped':>8} {'dupl.':>6} {'late':>5} {'gaps':>6}")
    with h5py.File(path) as file:
        for name, counts in reading.stream_counts.items():
            print(f"{name:14} {counts.received:10} {counts.written:10} {counts.dropped:8} {counts.duplicates:6} "
                  f"{counts.late:5} {counts.gaps:6}")  # fmt: skip
            if counts.received != counts.written + counts.dropped + counts.duplicates + counts.late:
                wrong.append(f"{name}: received is not written + dropped + duplicates + late")
            group = file["streams"][name]
            if len(group["data"]) != counts.written:
                wrong.append(f"{name}: the file has {len(group['data'])} rows")
            if "sequence" in group:
                steps = np.diff(group["sequence"][:])
                absent = int((steps - 1).sum())
                lost = counts.gaps + counts.dropped - counts.late
                if absent != lost:
                    wrong.append(f"{name}: {absent} rows are absent between the file's first and last, {lost} counted")
                marks = group["quality"][:] if "quality" in group else np.zeros(group["data"].shape, np.uint8)
                marked = (marks & Quality.GAP).any(axis=1)[1:]
                if not np.array_equal(marked, steps > 1):
                    wrong.append(f"{name}: rows marked with a gap are not those after one")
    for name, count in reading.counts.items():
        print(f"{name}: {count}")
    return wrong


def main() -> None:
    """Record, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--load", choices=LOADS, default="wide")
    parser.add_argument("--rig-file", type=Path)
    parser.add_argument("--sensor", default="biotac")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--stall", type=float, default=0.0)
    parser.add_argument("--on", help="folder on the disk to write to")
    parser.add_argument("--send", choices=LOADS, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.send:
        send(given.send)
        return
    load = os.getloadavg()[0]
    with ExitStack() as opened:
        path = Path(opened.enter_context(tempfile.TemporaryDirectory(dir=given.on))) / "rate.h5"
        sender, clock = None, time.monotonic_ns
        if given.rig_file:
            drivers, clock = opened.enter_context(of_rig_file(given.rig_file, given.sensor))
        else:
            drivers, sender = opened.enter_context(synthetic(given.load))
        print(f"{given.rig_file or given.load}, {given.seconds:g} s, {os.cpu_count()} cores, "
              f"load before {load:.2f}")  # fmt: skip
        reading, completing_s = record(drivers, clock, path, given.seconds, given.stall)
        print(f"load after {os.getloadavg()[0]:.2f}")
        print(f"file complete after {completing_s:.2f} s more, {path.stat().st_size / 1e6:.1f} MB, "
              f"at most {memory_mb('VmHWM'):.1f} MB of memory")  # fmt: skip
        wrong = compared(reading, path)
        if sender is not None and sender.stdout is not None:
            for line in sender.stdout:
                print("sent until they were stopped:", line.strip())
    if reading.ended:
        wrong.append(reading.ended)
    lost = sum(counts.dropped + counts.gaps for counts in reading.stream_counts.values())
    print("\n".join(wrong) if wrong else "counts and file agree")
    print(f"{lost} rows lost")
    raise SystemExit(bool(wrong) or (bool(lost) and not given.stall))


if __name__ == "__main__":
    main()
