"""Where a force loop no longer settles, by theory and by stepping it, without and with a filter on its force.

    python benchmarks/force_loop_limit.py [FIGURE]

Stepped is the rig's own controller (`ForceController`) on a spring, with the motor's lag and the delay of its line; by
theory are the eigenvalues of one step. The figure of docs/hardware.md is made of it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tactbench.plugin import ForceLoop, assumed
from tactbench.rigs.parallel_manipulator.force_law import ForceLaw
from tactbench.rigs.parallel_manipulator.loop_stability import LinearLoop, largest_gain_factor, pressed_spring

STIFFNESS_N_MM = 20.0
"""About what both sensors have at 5 N on the twin."""
RESET_S = 0.15
"""kp/ki of the PI law, as the twin's default loop has it."""
NOISE_N = 0.6875
"""Of the force sensor in the paper's scenes."""
RATES_HZ = (20.0, 50.0, 100.0, 200.0, 500.0)
CUTOFFS_HZ = (None, 5.0, 1.0)
COLOURS = {None: "tab:red", 5.0: "tab:blue", 1.0: "tab:green"}


def quantity(value: float, unit: str):
    """Return a number of this script."""
    return assumed(value, unit, "to compute with")


def loop(rate_hz: float, cutoff_hz: float | None, gain: float, law: str = "I"):
    """Return a loop: of increments, with K [mm/(N s)], or PI, with kp [mm/N]; a delay of one period."""
    return ForceLoop(
        proportional=quantity(gain if law == "PI" else 0.0, "mm/N"),
        integral=quantity(gain / RESET_S if law == "PI" else gain, "mm/N/s"),
        cutoff=None if cutoff_hz is None else quantity(cutoff_hz, "Hz"),
        rate=quantity(rate_hz, "Hz"),
        delay=quantity(1 / rate_hz, "s"),
        motor_lag=quantity(10.0, "ms"),
        resolution=quantity(0.0, "N"),
    )


def stepped(of: ForceLoop, seconds: float, noise_n: float = 0.0, setpoint_n: float = 1.0, seed: int = 1) -> np.ndarray:
    """Return (n,) true forces [N] of the controller on the spring, from a step of 1 N or with a noisy sensor."""
    law = ForceLaw(
        loop=of,
        speed=quantity(1e6, "mm/s"),  # without limits: the linear loop
        windup_time=quantity(1e3, "s"),
        travel=(quantity(-1e6, "mm"), quantity(1e6, "mm")),
    )
    steps = round(seconds / LinearLoop.of(of).period_s)
    noise = noise_n * np.random.default_rng(seed).standard_normal(steps)
    depth = pressed_spring(law, 1e3 * STIFFNESS_N_MM, np.full(steps, setpoint_n), noise)
    return 1e3 * STIFFNESS_N_MM * depth


def grows(of: ForceLoop) -> bool:
    """Return whether a step swings up."""
    steps = 1500
    error = np.abs(stepped(of, steps * LinearLoop.of(of).period_s) - 1.0)
    # A swing that has grown a thousandfold has come to the ends of the travel.
    return bool(error.max() > 1e3 or error[-steps // 3 :].max() > error[steps // 3 : 2 * steps // 3].max())


def found_limit(rate_hz: float, cutoff_hz: float | None, law: str, by_theory: float) -> float:
    """Return the largest gain that settles when stepped, halved between 0.7 and 1.4 of theory."""
    low, high = 0.7 * by_theory, 1.4 * by_theory
    assert not grows(loop(rate_hz, cutoff_hz, low, law))
    assert grows(loop(rate_hz, cutoff_hz, high, law))
    while high / low > 1.002:
        middle = np.sqrt(low * high)
        low, high = (low, middle) if grows(loop(rate_hz, cutoff_hz, middle, law)) else (middle, high)
    return float(np.sqrt(low * high))


def named(cutoff_hz: float | None) -> str:
    """Return a filter's name."""
    return "no filter" if cutoff_hz is None else f"filter {cutoff_hz:g} Hz"


def draw_limits(axes, law: str, unit: str) -> float:
    """Draw and print a law's limits; return the largest difference between theory and stepping."""
    worst = 0.0
    for cutoff in CUTOFFS_HZ:
        theory = [largest_gain_factor(loop(rate, cutoff, 1.0, law), 1e3 * STIFFNESS_N_MM) for rate in RATES_HZ]
        found = [found_limit(rate, cutoff, law, gain) for rate, gain in zip(RATES_HZ, theory, strict=True)]
        axes.loglog(RATES_HZ, theory, "-", color=COLOURS[cutoff], label=f"{named(cutoff)}, theory")
        axes.loglog(RATES_HZ, found, "o", color=COLOURS[cutoff], mfc="none", label=f"{named(cutoff)}, stepped")
        for rate, one, other in zip(RATES_HZ, theory, found, strict=True):
            worst = max(worst, abs(other / one - 1))
            print(f"{law:>2}, {named(cutoff):>11}, {rate:3.0f} Hz: theory {one:7.4f}, stepped {other:7.4f} {unit}")
    axes.set_xticks(RATES_HZ, [f"{rate:g}" for rate in RATES_HZ])
    axes.minorticks_off()
    axes.set(xlabel="control rate, Hz", ylabel=f"largest gain that settles, {unit}")
    axes.legend(fontsize=7)
    return worst


def main() -> None:
    """Print the limits and draw the figure."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (proportional, increments, swings) = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    worst = max(draw_limits(proportional, "PI", "mm/N"), draw_limits(increments, "I", "mm/(N s)"))
    print(f"largest difference: {100 * worst:.2f} %")
    proportional.set(title=f"PI, ki = kp/{RESET_S:g} s")
    closed = [2 * np.sin(np.pi / 6) * rate / STIFFNESS_N_MM for rate in RATES_HZ]
    increments.loglog(RATES_HZ, closed, ":", color="0.4", label="no filter, no lag: k K T = 1", lw=3)
    increments.legend(fontsize=7)
    increments.set_xticks(RATES_HZ, [f"{rate:g}" for rate in RATES_HZ])
    increments.minorticks_off()
    increments.set(title="increments, K")

    limit = largest_gain_factor(loop(50.0, None, 1.0, "PI"), 1e3 * STIFFNESS_N_MM)
    for part, cutoff, colour in ((1.05, None, "tab:red"), (0.95, None, "tab:orange"), (1.05, 1.0, "tab:green")):
        force = stepped(loop(50.0, cutoff, part * limit, "PI"), 1.6)
        label = f"{part:g} of the limit without filter; {named(cutoff)}"
        swings.plot(np.arange(force.size) / 50.0, force, color=colour, lw=0.8, label=label)
    swings.set(xlabel="s", ylabel="force, N", ylim=(-4, 9), title="PI, 50 Hz, a step of 1 N")
    swings.legend(fontsize=7, loc="upper left")
    for law, gain in (("PI", 0.5 * limit), ("I", 0.5)):
        for cutoff in CUTOFFS_HZ:
            moved = float(np.std(stepped(loop(50.0, cutoff, gain, law), 200.0, NOISE_N)[2500:]))
            print(f"{law:>2}, {named(cutoff):>11}: {NOISE_N} N of noise move the true force by {moved:.3f} N rms")

    about = f"Force loops on {STIFFNESS_N_MM:g} N/mm, motor lag 10 ms, delay of one period"
    figure.suptitle(about, fontsize=10)
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images/force-loop-limit.png")
    figure.savefig(out, dpi=110)
    print(out)


if __name__ == "__main__":
    main()
