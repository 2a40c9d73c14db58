"""Random bytes against the codecs and emulators of the linear motor and the force-torque sensor, and what they cost.

Nothing may raise but the named errors; after every kilobyte of noise one frame is lost at most. The last lines are
seconds of computing for a second of each emulator.

Usage: python benchmarks/rig_random_bytes.py [BYTES] [SEED]
"""

from __future__ import annotations

import sys
import time

import numpy as np

from tactbench.plugin.devices import EmulatorSettings
from tactbench.rigs.parallel_manipulator.motor.codec import CommandReader, Kind, Line, LineReader
from tactbench.rigs.parallel_manipulator.motor.emulator import MotorEmulator
from tactbench.rigs.parallel_manipulator.net_ft.driver import (
    Command,
    decode_records,
    encode_record,
    encode_request,
)
from tactbench.rigs.parallel_manipulator.net_ft.emulator import RdtEmulator

CHUNK = 1000
COUNTS = {"counts_per_newton": 1e6, "counts_per_newton_metre": 1e6}
TEXT = np.frombuffer(b"0123456789-+ \r\n\r\nOKpvrfhPSLAMVREND", dtype=np.uint8)


def noises(count: int, rng: np.random.Generator) -> list[bytes]:
    """Return `count` bytes in pieces of a kilobyte, by turns of all bytes and of those that lines are made of."""
    pieces = []
    for n, start in enumerate(range(0, count, CHUNK)):
        size = min(CHUNK, count - start)
        pieces.append(rng.bytes(size) if n % 2 else rng.choice(TEXT, size).tobytes())
    return pieces


def main(count: int, seed: int) -> None:
    """Print what `count` random bytes came to; raises where something does not hold."""
    rng = np.random.default_rng(seed)
    pieces = noises(count, rng)

    reader, drive, commands = LineReader(), CommandReader(), 0
    for piece in pieces:
        reader.feed(piece)
        commands += len(drive.feed(piece))
        assert reader.feed(b"\r\n98956\r\n")[-1] == Line(Kind.VALUE, "98956")
        assert drive.feed(b"\rLA1000\r")[-1].argument == 1000
    print(f"motor, codec: {commands} commands")

    motor, now_s = MotorEmulator(EmulatorSettings(lambda _t: {}, rng)), 0.0
    for piece in pieces[: len(pieces) // 20 + 1]:
        motor.feed(piece, now_s)
        now_s += 1.1
    print(f"motor, emulator: {now_s:.0f} s of line")

    box, whole, rejected = RdtEmulator(EmulatorSettings(lambda _t: {}, rng, COUNTS)), 0, 0
    for piece in pieces:
        cuts = np.sort(rng.integers(0, len(piece) + 1, size=27)).tolist()
        for start, end in zip([0, *cuts, 0], [*cuts, len(piece), 36], strict=True):
            box.feed(piece[start:end], 0.0)
            try:
                whole += len(decode_records(piece[start:end]))
            except ValueError:
                rejected += 1
        assert decode_records(encode_record(5, 0, 0, (0,) * 6))["rdt_sequence"] == 5
    print(f"force-torque, codec: {whole} records, {rejected} datagrams rejected")

    for name, load in (("free", 0.0), ("pressing", 5000.0)):
        motor = MotorEmulator(EmulatorSettings(lambda _t: {}, rng))
        motor.press_against(lambda x, k=load: k * max(x, 0.0))
        motor.feed(b"EN\rLA300\rM\r", 0.0)
        begin = time.perf_counter()
        for n in range(1000):
            motor.feed(b"POS\r" if n % 20 == 0 else b"", 1e-3 * n)
        print(f"motor, {name}: {time.perf_counter() - begin:.3f} s for 1 s at a tick of 1 ms, polled at 1 kHz")
    for rate_hz in (1000.0, 7000.0):
        box = RdtEmulator(EmulatorSettings(lambda _t: {}, rng, COUNTS | {"rate_hz": rate_hz}))
        box.feed(encode_request(Command.START_REALTIME), 0.0)
        begin = time.perf_counter()
        sent = box.poll(1.0)
        decode_records(b"".join(datagram for _, datagram in sent))
        print(f"force-torque, {rate_hz:.0f} Hz: {time.perf_counter() - begin:.3f} s for {len(sent)} records")


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    main(*(given + [100_000, 1][len(given) :]))
