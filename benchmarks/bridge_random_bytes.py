"""Random bytes against the SPI bridge's frame decoder and emulator.

Nothing may raise; after each piece, a zero byte and a frame, that frame is whole. A random stretch passes as a frame
with a probability of about 2**-48 (CRC of 32 bits, length of 16).

Usage: python benchmarks/bridge_random_bytes.py [BYTES] [SEED]
"""

from __future__ import annotations

import sys
import time

import numpy as np

from tactbench.links.bridge_emulator import BridgeEmulator
from tactbench.links.spi_link import Frame, FrameDecoder, Kind, encode_frame

PIECE = 1000


def main(count: int, seed: int) -> None:
    """Print what `count` random bytes came to; raises where something does not hold."""
    rng = np.random.default_rng(seed)
    decoder, emulator = FrameDecoder(), BridgeEmulator(lambda select, data, now_s: data)
    passed = 0
    hello = b"\0" + encode_frame(Frame(Kind.HELLO, 1))
    begin = time.perf_counter()
    for _ in range(count // PIECE):
        data = rng.bytes(PIECE)
        found = decoder.feed(data + hello)
        assert found[-1] == Frame(Kind.HELLO, 1)
        passed += len(found) - 1
        answer = FrameDecoder().feed(b"".join(piece for _, piece in emulator.feed(data + hello, 0.0)))
        assert answer[-1].kind == Kind.HELLO.reply
    print(
        f"{count // PIECE * PIECE} random bytes: {passed} stretches passed as frames, "
        f"each frame sent between them read; {time.perf_counter() - begin:.1f} s"
    )


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    main(*(given + [100_000, 1][len(given) :]))
