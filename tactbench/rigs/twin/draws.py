"""Random draws that depend on names, never on the order in which things happen."""

from __future__ import annotations

import hashlib

import numpy as np


def generator(seed: int, *scope: str) -> np.random.Generator:
    """Return the generator of one scope, for example ``(sensor, "unit", "gain")``.

    The scope's text is hashed (BLAKE2), so that the same seed and names give the same draws in every process and on
    every machine, and a new effect does not shift the draws of the others.
    """
    digest = hashlib.blake2b("\x1f".join(scope).encode(), digest_size=16).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
    # A negative seed is as good as any: SeedSequence wants its words unsigned.
    return np.random.default_rng(np.random.SeedSequence([seed % 2**64, *words]))
