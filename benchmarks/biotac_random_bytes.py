"""Random bytes against the BioTac's codec, frames and emulator, and what a word costs.

Nothing may raise; a word passes as a datum only if it is one; after the bytes one frame is whole again. The last two
lines are seconds of computing for a second of the sensor's 4400 words, emulator and frames together, and frames alone.

Usage: python benchmarks/biotac_random_bytes.py [BYTES] [SEED]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tactbench.plugin import DataError
from tactbench.sensors.biotac.codec import decoded, encoded, property_text
from tactbench.sensors.biotac.emulator import Emulator
from tactbench.sensors.biotac.frames import FrameBatches
from tactbench.sensors.biotac.text_log import read_log


def chunks(data: bytes, rng: np.random.Generator) -> list[bytes]:
    """Cut `data` into pieces of 0 to 5 bytes."""
    cuts = np.cumsum(rng.integers(0, 6, size=len(data) // 2))
    cuts = cuts[cuts < len(data)].tolist()
    return [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]


def whole_frame(batches: FrameBatches) -> bool:
    """Take one more frame and return whether all of it came."""
    batches.blocks()
    first, steps = batches.next()
    batches.take(first, [encoded(1000 + k // 2) for k in range(len(steps))], t_ns=0)
    slow, fast = batches.blocks()
    return not slow.quality.any() and not fast.quality.any() and slow.data[0, 1] == 1002


def main(count: int, seed: int) -> None:
    """Print what `count` random bytes came to; raises where something does not hold."""
    rng = np.random.default_rng(seed)
    data = rng.bytes(count)
    words = passed = 0
    for n in range(0, count - 1, 2):
        word = data[n : n + 2]
        reply = decoded(word)
        words += 1
        if reply.fault is None:
            passed += 1
            assert encoded(reply.value) == word
    print(f"codec: {words} words, {passed} of them data, each its own encoding")

    batches, parts = FrameBatches(speed_hz=4_400_000), chunks(data, rng)
    for n in range(0, len(parts) - 87, 88):
        batches.take(batches.next()[0], parts[n : n + 88], t_ns=0)
    rows = sum(len(block.data) for block in batches.blocks())
    assert whole_frame(batches)
    print(f"frames: {len(parts)} replies of 0 to 5 bytes, {rows} rows; the next frame is whole")

    sensor, now_s = Emulator(), 0.0
    for part in parts:
        now_s += float(rng.choice([5e-6, 60e-6]))
        assert len(sensor.exchange(1, part, now_s)) == len(part)
    sensor.exchange(1, b"\x80\x00", now_s + 1.0)
    assert sensor.exchange(1, b"\x00\x00", now_s + 1.001) == encoded(2043)
    print(f"emulator: {len(parts)} periods of the select; the next exchange is whole")

    names = ("flex version", "software version", "serial number")
    shown = sum(property_text(name, data[n : n + 100]) is not None for n in range(0, count, 100) for name in names)
    print(f"properties: {len(names) * -(-count // 100)} read, {shown} of them texts")

    with tempfile.NamedTemporaryFile() as file:
        file.write(data)
        file.flush()
        try:
            log = read_log(Path(file.name), {})
            print(f"text log: {dict(log.counts)}, {len(log.blocks)} blocks")
        except DataError as error:
            print(f"text log: {error}")

    sensor, batches = Emulator(), FrameBatches(speed_hz=4_400_000)
    for name, alone in (("emulator and frames", False), ("frames alone", True)):
        begin = time.perf_counter()
        for n in range(100):
            first, steps = batches.next()
            replies = [b"\x6d\x58"] * len(steps)
            if not alone:
                times = [1e-2 * n + 1e-4 * k for k in range(len(steps))]
                replies = [sensor.exchange(1, step.data, t_s) for step, t_s in zip(steps, times, strict=True)]
            batches.take(first, replies, t_ns=0, device_ns=0)
            batches.blocks()
        print(f"{name}: {time.perf_counter() - begin:.3f} s for 4400 words")


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    main(*(given + [100_000, 1][len(given) :]))
