"""How fast recordings are appended to, beside plain h5py, and what completing a long one takes.

Appending: blocks of 64 channels int16 at 5 kHz with `t_ns`, `sequence` and `device_ns`, and a block of 6 channels
float64 with `t_ns` after each (the force: as many rows as 1 kHz has in that time, at least one). Plain h5py is four
datasets a taxel block and two a force block, resized and written, chunks of 4096 rows, no compression, flushed after
every second of samples; the journal hands every block to the operating system at once. Rounds of both alternate;
medians of the rounds.

Completing: the journal of `--seconds` of such samples turned into the HDF5 file (gzip, digest, clock fit, rename), in a
process of its own, with its peak of memory. The taxels are a slow press of 2000 counts with noise of `--noise` counts,
for what compresses costs less.

Usage: python benchmarks/recording_writer.py [--rounds 5] [--seconds 600] [--noise 3] [--only append|complete]
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from tactbench.core.recording.reader import open_recording
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Block
from tactbench.core.spec.quantity import Source
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, StreamSpec

RATE_HZ, FORCE_HZ, CHANNELS, FORCES = 5000, 1000, 64, 6
GOAL = 0.8


def meta() -> RecordingMeta:
    """Return a meta of 64 taxels and 6 forces and torques."""
    taxels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(CHANNELS))
    forces = tuple(ChannelSpec(name=name, kind="force", unit="N") for name in ("fx", "fy", "fz", "a", "b", "c"))
    sensor = SensorSpec(
        name="pad", title="a pad", principle="none", principle_source=Source(tag="assumed", reference="a benchmark"),
        streams=(StreamSpec(name="taxels", dtype="int16", channels=taxels),),
    )  # fmt: skip
    return RecordingMeta(
        name="bench", rig="bench", sensor=sensor, clock="host", reference=(StreamSpec(name="force", channels=forces),)
    )


def samples(rows: int, blocks: int, noise: float) -> Iterator[Block]:
    """Yield blocks of taxels and of force, as they come from devices."""
    rng = np.random.default_rng(1)
    force_rows = max(1, rows * FORCE_HZ // RATE_HZ)
    gains = rng.uniform(0.2, 1.0, CHANNELS)
    for number in range(blocks):
        n = np.arange(number * rows, (number + 1) * rows, dtype=np.int64)
        device = n * (10**9 // RATE_HZ)
        host = device + 10**15 + rng.exponential(500_000, rows).astype(np.int64)
        press = 1000 * (1 - np.cos(n * (2 * np.pi / RATE_HZ / 20)))
        data = np.rint(press[:, None] * gains + rng.normal(0, noise, (rows, CHANNELS))).astype(np.int16)
        yield Block("taxels", np.maximum.accumulate(host), data, sequence=n, device_ns=device)
        yield Block(
            "force", device[:1] + np.arange(force_rows) * 10**6 + 10**15, rng.normal(0, 1, (force_rows, FORCES))
        )


def columns(block: Block) -> dict[str, np.ndarray]:
    """Return what there is of a block."""
    every = {"data": block.data, "t_ns": block.t_ns, "sequence": block.sequence, "device_ns": block.device_ns}
    return {name: values for name, values in every.items() if values is not None}


def plain_seconds(blocks: list[Block], rows: int, path: Path) -> float:
    """Return the seconds that plain h5py takes."""
    with h5py.File(path, "w") as file:
        datasets: dict[tuple[str, str], h5py.Dataset] = {}
        for block in blocks[:2]:
            for name, values in columns(block).items():
                rest = values.shape[1:]
                datasets[block.stream, name] = file.create_dataset(
                    f"{block.stream}/{name}", (0, *rest), values.dtype, maxshape=(None, *rest), chunks=(4096, *rest)
                )
        done = {"taxels": 0, "force": 0}
        flushed = 0
        began = time.perf_counter()
        for block in blocks:
            start = done[block.stream]
            stop = done[block.stream] = start + len(block.data)
            for name, values in columns(block).items():
                dataset = datasets[block.stream, name]
                dataset.resize(stop, axis=0)
                dataset[start:stop] = values
            if done["taxels"] - flushed >= RATE_HZ:
                file.flush()
                flushed = done["taxels"]
        file.flush()
        return time.perf_counter() - began


def journal_seconds(blocks: list[Block], path: Path) -> float:
    """Return the seconds that appending takes, without completing."""
    try:
        with RecordingWriter(path, meta()) as writer:
            began = time.perf_counter()
            for block in blocks:
                writer.append(block)
            spent = time.perf_counter() - began
            raise KeyboardInterrupt  # completing is measured apart
    except KeyboardInterrupt:
        return spent


def append(rounds: int, folder: Path) -> bool:
    """Print the table; False if a ratio is below the goal."""
    print(f"appending, medians of {rounds} rounds of 4 s of samples (10 rows) or 10 s:")
    print(f"{'rows a block':>12}{'us a block':>12}{'MB/s':>8}{'x real time':>13}{'h5py us':>10}{'MB/s':>8}{'ratio':>8}")
    good = True
    for rows in (10, 100, 1000):
        blocks = list(samples(rows, (4 if rows == 10 else 10) * RATE_HZ // rows, 3.0))
        size = sum(values.nbytes for block in blocks for values in columns(block).values())
        seconds = len(blocks) // 2 * rows / RATE_HZ
        ours, plain = [], []
        for _ in range(rounds):
            ours.append(journal_seconds(blocks, folder / "ours.h5"))
            plain.append(plain_seconds(blocks, rows, folder / "plain.h5"))
        mine, theirs = statistics.median(ours), statistics.median(plain)
        print(f"{rows:>12}{mine / len(blocks) * 2e6:>12.0f}{size / mine / 1e6:>8.0f}{seconds / mine:>13.0f}"
              f"{theirs / len(blocks) * 2e6:>10.0f}{size / theirs / 1e6:>8.0f}{theirs / mine:>8.2f}")  # fmt: skip
        good = good and theirs / mine >= GOAL
    return good


def complete(seconds: float, noise: float, path: Path) -> None:
    """Write and complete one recording in this process; print what it took as JSON."""
    rows = 500
    with RecordingWriter(path, meta()) as writer:
        for block in samples(rows, round(seconds * RATE_HZ / rows), noise):
            writer.append(block)
        journal = path.with_name(path.name + ".partial").stat().st_size
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        began, began_cpu = time.perf_counter(), time.process_time()
    spent, spent_cpu = time.perf_counter() - began, time.process_time() - began_cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with open_recording(path) as recording:
        lines = len(recording.meta.clocks["taxels"].segments)
    print(json.dumps({"journal": journal, "file": path.stat().st_size, "s": spent, "cpu": spent_cpu,
                      "before": before * 1024, "peak": peak * 1024, "lines": lines}))  # fmt: skip


def main() -> int:
    """Print both tables; 1 if appending is slower than 0.8 of plain h5py."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--noise", type=float, default=3)
    parser.add_argument("--only", choices=("append", "complete"))
    parser.add_argument("--complete", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.complete:
        complete(asked.seconds, asked.noise, asked.complete)
        return 0
    good = True
    with tempfile.TemporaryDirectory(dir=".") as made:
        if asked.only != "complete":
            good = append(asked.rounds, Path(made))
        if asked.only != "append":
            ran = subprocess.run(
                [sys.executable, __file__, "--complete", str(Path(made) / "long.h5"), "--seconds", str(asked.seconds),
                 "--noise", str(asked.noise)], stdout=subprocess.PIPE, check=True,
            )  # fmt: skip
            took = json.loads(ran.stdout)
            print(f"completing {asked.seconds:g} s, noise {asked.noise:g} counts: "
                  f"journal {took['journal'] / 1e6:.0f} MB, file {took['file'] / 1e6:.0f} MB, {took['s']:.1f} s "
                  f"({took['cpu']:.1f} s of the processor), "
                  f"peak {took['peak'] / 1e6:.0f} MB of memory ({took['before'] / 1e6:.0f} MB before), "
                  f"{took['lines']} clock lines")  # fmt: skip
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
