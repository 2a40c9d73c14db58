"""How well a device's clock is put on the host's, over seeded runs of simulated clocks.

A device samples at a constant rate of its own clock; the host's clock runs faster by up to 100 ppm and may wander; each
sample comes after a delay of one of four kinds, whose least value (0.2 ms, which cannot be seen one way) is taken off:

uniform     0 to 2 ms
exponential 0.5 ms on average
burst       0.1 ms on average, and every 2 s on average a stall of 20 to 200 ms, after which all comes at once
gamma       0.5 ms times gamma(2): few delays near the least one

Every figure is of the times of all samples, as a recording stores them. `one line` fits one line to the whole record
instead of one to each 30 s. Least squares stands beside. SIM.

Usage: python studies/clock_fit.py [--runs 250] [--quick]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from tactbench.core.recording.clock_fit import STRETCH_NS, fit, host_times

Times = npt.NDArray[np.int64]
Delays = Callable[[np.random.Generator, npt.NDArray[np.float64]], npt.NDArray[np.float64]]


def uniform(rng: np.random.Generator, t_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return delays in seconds, as the others do."""
    return rng.uniform(0, 2e-3, len(t_s))


def exponential(rng: np.random.Generator, t_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return delays in seconds."""
    return rng.exponential(0.5e-3, len(t_s))


def burst(rng: np.random.Generator, t_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return delays in seconds: what comes during a stall comes at its end."""
    delays = rng.exponential(0.1e-3, len(t_s))
    for start in np.cumsum(rng.exponential(2.0, int(t_s[-1]))):
        end = start + rng.uniform(20e-3, 200e-3)
        delays = np.where((t_s >= start) & (t_s < end), np.maximum(delays, end - t_s), delays)
    return delays


def gamma(rng: np.random.Generator, t_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return delays in seconds."""
    return 0.5e-3 * rng.gamma(2.0, size=len(t_s))


DELAYS: dict[str, Delays] = {"uniform": uniform, "exponential": exponential, "burst": burst, "gamma": gamma}


def clocks(
    rng: np.random.Generator, seconds: float, rate_hz: float, wander_ppm: float, period_s: float
) -> tuple[Times, Times]:
    """Return device's times and the host's true times of the same samples [ns]."""
    t_s = np.arange(round(seconds * rate_hz)) / rate_hz
    device = np.rint(t_s * 1e9).astype(np.int64) + int(rng.integers(0, 2**40))
    phase = rng.uniform(0, 2 * np.pi)
    turned = 2 * np.pi / period_s
    wander_s = wander_ppm * 1e-6 / turned * (np.cos(phase) - np.cos(phase + turned * t_s))
    ahead_s = rng.uniform(-1e-4, 1e-4) * t_s + wander_s
    return device, device + int(rng.integers(0, 2**60)) + np.rint(ahead_s * 1e9).astype(np.int64)


def one_run(
    rng: np.random.Generator,
    delays: Delays,
    seconds: float,
    rate_hz: float,
    wander_ppm: float,
    period_s: float,
    stretch_ns: int,
) -> tuple[float, float, float]:
    """Return the largest error, the largest bound and least squares' largest error, in microseconds."""  # fmt: skip
    device, true = clocks(rng, seconds, rate_hz, wander_ppm, period_s)
    t_s = (device - device[0]) * 1e-9
    came = true + np.rint(delays(rng, t_s) * 1e9).astype(np.int64)
    segments = fit(device, came, stretch_ns)
    given = host_times(segments, device)
    bounds = [segment.bound_ns for segment in segments if segment.bound_ns is not None]
    late_s = (came - true + (true - device) - (true[0] - device[0])) * 1e-9
    line = np.polynomial.Polynomial.fit(t_s, late_s, 1)(t_s)
    squares = float(np.abs(line - ((true - device) - (true[0] - device[0])) * 1e-9).max())
    return float(np.abs(given - true).max()) / 1e3, max(bounds) / 1e3, squares * 1e6


def row(
    name: str,
    seeds: range,
    seconds: float,
    rate_hz: float,
    *,
    wander_ppm: float = 0.0,
    period_s: float = 600.0,
    stretch_ns: int = STRETCH_NS,
) -> tuple[int, float]:
    """Print one line; return how many runs the bound missed, and the worst error in microseconds."""  # fmt: skip
    ran = np.array([
        one_run(np.random.default_rng([seed, int(seconds)]), DELAYS[name], seconds, rate_hz, wander_ppm, period_s,
                stretch_ns)
        for seed in seeds
    ])  # fmt: skip
    error, bound, squares = ran.T
    missed = int(np.count_nonzero(error > bound))
    print(f"{name:<12}{seconds:>6.0f}{rate_hz:>6.0f}{wander_ppm:>8.1f}{period_s:>8.0f}{stretch_ns * 1e-9:>9.0f}"
          f"{len(ran):>6}{missed:>8}{np.median(error):>9.2f}{error.max():>9.2f}{np.median(bound):>9.2f}"
          f"{bound.max():>9.2f}{np.median(squares):>9.0f}{squares.max():>9.0f}")  # fmt: skip
    return missed, float(error.max())


def main() -> int:
    """Print the tables; 1 if a bound was missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=250, help="runs of 60 s for each kind of delay")
    parser.add_argument("--quick", action="store_true", help="leave out the long records")
    asked = parser.parse_args()
    print(f"{'delays':<12}{'s':>6}{'Hz':>6}{'wander':>8}{'period':>8}{'stretch':>9}{'runs':>6}{'missed':>8}"
          f"{'error':>9}{'worst':>9}{'bound':>9}{'largest':>9}{'squares':>9}{'worst':>9}   [us; ppm, s]")  # fmt: skip
    missed = 0
    one_line = 10**15
    for stretch in (STRETCH_NS, one_line):
        for name in DELAYS:
            missed += row(name, range(asked.runs), 60, 100, stretch_ns=stretch)[0]
    if not asked.quick:
        few = range(max(4, asked.runs // 25))
        for name in DELAYS:
            missed += row(name, few, 60, 1000)[0]
            missed += row(name, few, 600, 100)[0]
        for ppm, period in ((1.0, 600.0), (2.0, 300.0), (0.5, 120.0)):
            missed += row("exponential", few, 600, 100, wander_ppm=ppm, period_s=period)[0]
            row("exponential", few, 600, 100, wander_ppm=ppm, period_s=period, stretch_ns=one_line)
    print(f"missed: {missed} (records with wander on one line not counted)")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
