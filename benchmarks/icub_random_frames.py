"""Random frames into the iCub's decoder and its emulated boards: nothing may be raised, and both must recover.

One frame in two looks like skin data, one in four like a command; the rest is anything. After every thousand, a whole
sample must come out of the decoder unmarked by what went before, and a host's usual start must bring a board back.
Prints how many frames went in and what the decoder counted; exit status 1 at the first failure.

Usage: python benchmarks/icub_random_frames.py COUNT [--seed S]
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter

from tactbench.plugin.devices import CanFrame
from tactbench.sensors.icub.codec import (
    BoardSetup,
    SkinDecoder,
    Transmit,
    TriangleSetup,
    command_frame,
    read_command,
    read_version,
    skin_frames,
)
from tactbench.sensors.icub.emulator import Bus

PERIOD_S = 0.02
COMMANDS = (0x4D, 0x50, 0x07, 0x1C)


def anything(generator: random.Random, t_ns: int) -> CanFrame:
    """Return a frame that may be anything."""
    kind = generator.random()
    data = generator.randbytes(generator.randrange(9))
    if kind < 0.5:
        return CanFrame(0x400 | generator.randrange(256), bytes([generator.choice((0x40, 0xC0))]) + data, False, t_ns)
    if kind < 0.75:
        return CanFrame(0x20E, bytes([generator.choice(COMMANDS)]) + data[:7], False, t_ns)
    return CanFrame(generator.randrange(-1, 1 << 30), data, generator.random() < 0.5, t_ns)


def main() -> int:
    """Feed the frames; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    generator = random.Random(given.seed)
    decoder = SkinDecoder(PERIOD_S)
    bus = Bus(lambda now_s: {"T1": generator.choice((-1e9, 0.0, 243.0, 1e9))}, triangle=3)
    calm = Bus(lambda now_s: {f"T{number}": 77.0 for number in range(1, 13)}, triangle=3)
    t_ns, began = 0, time.perf_counter()
    for number in range(1, given.count + 1):
        t_ns += generator.randrange(1_000_000)
        frame = anything(generator, t_ns)
        decoder.feed(frame)
        read_command(frame)
        read_version(frame)
        if number % 20 == 0:  # a board at full rate sends much more than it is sent
            for board in (bus, calm):
                for _, sent in board.feed(frame, 1e-9 * t_ns):
                    decoder.feed(sent)
        if number % 1000:
            continue
        t_ns += 1_000_000_000
        head, tail = skin_frames(3, 7, [77] * 12, t_ns=t_ns)
        *_, sample = [*decoder.feed(head), *decoder.feed(tail)]
        for command in (Transmit(False), BoardSetup(), TriangleSetup(3, 3), Transmit(True)):
            calm.feed(command_frame(14, command), 1e-9 * t_ns)
        calm.poll(1e-9 * t_ns + 0.03)
        back = [sent.data for _, sent in calm.poll(1e-9 * t_ns + 0.05)]
        usual = [half.data for half in skin_frames(14, 3, [77] * 12)]
        if sample.taxels != bytes([77] * 12) or back[-2:] != usual:
            print(f"Not recovered after frame {number} of seed {given.seed}: {sample}, {back}", file=sys.stderr)
            return 1
    spent_s = time.perf_counter() - began
    print(f"{given.count} frames, {decoder.foreign} foreign, {spent_s:.1f} s, nothing raised, recovered every time")
    for name, number in sorted(sum(decoder.counts.values(), Counter()).items()):
        print(f"{name:25} {number}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
