"""How often the interval of a score holds the score over many boards: simulated arrays, scored as recordings.

Each board is a campaign: sessions of presses on three taxels whose offset differs from session to session. The truth is
the root of the mean square of the scores of all boards, which so many of them know to about 1 %.

Usage: python benchmarks/board_coverage.py [--boards 200] [--sessions 8] [--spread 0.5] [--seed 1]
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from sklearn.linear_model import LinearRegression

import tactbench

ROWS = 60
"""Of a session, 10 ms apart."""
GAIN = np.array([1.0, 2.0, 3.0])
NOISE = 0.2


def board(rng: np.random.Generator, sessions: int, spread: float) -> list[tactbench.recordings.Recording]:
    """Return the recordings of one board; `spread` is the deviation of the offsets."""
    force = rng.uniform(0, 5, sessions * ROWS)
    offset = rng.normal(0, spread, (sessions, len(GAIN))).repeat(ROWS, axis=0)
    readings = force[:, None] * GAIN + offset + rng.normal(0, NOISE, (len(force), len(GAIN)))
    clock, session = np.tile(np.arange(ROWS) * 0.01, sessions), np.arange(sessions).repeat(ROWS)
    return tactbench.from_arrays(readings, force, time_s=clock, groups=session, task="force", sensor="board")


def main() -> None:
    """Score all boards, and print the coverage."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--boards", type=int, default=200)
    parser.add_argument("--sessions", type=int, default=8)
    parser.add_argument("--spread", type=float, default=0.5)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng, began = np.random.default_rng(asked.seed), time.perf_counter()
    boards = (board(rng, asked.sessions, asked.spread) for _ in range(asked.boards))
    found = [tactbench.evaluate(LinearRegression(), "force", one) for one in boards]
    score, low, high = np.array([(one.score, *one.interval) for one in found]).T
    truth = np.sqrt(np.mean(score**2))
    held = (low <= truth) & (truth <= high)
    print(f"{asked.boards} boards in {time.perf_counter() - began:.0f} s")
    print(f"RMSE {truth:.3f} N, deviation from board to board {score.std():.3f} N")
    print(
        f"intervals: {held.mean():.1%} hold it, {np.mean(high < truth):.1%} are below, {np.mean(low > truth):.1%} above"
    )


if __name__ == "__main__":
    main()
