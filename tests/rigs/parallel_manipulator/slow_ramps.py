"""Oracle 10 through every byte: ramps of 5 N in 60 s on 20 N/mm, 20 mN of noise, k K = 10, a filter of 5 Hz, 100 Hz.

    python -m tests.rigs.parallel_manipulator.slow_ramps [PRESSES]

The loop keeps the force that it measures behind the wanted one by 6.1 mN, so the true force is off by that less the
mean of the noise it has measured. Of one press that is the mean of 5500 samples of 20 mN: its standard error is
0.27 mN, and a press whose loop is right is off by more than 0.5 mN one time in sixteen. Of eight it is 0.095 mN.
A press takes about a minute.
"""

import sys
import time

import numpy as np

from tactbench.rigs.parallel_manipulator.loop_stability import ramp_error_n
from tactbench.rigs.parallel_manipulator.settings import settings_of
from tests.rigs.parallel_manipulator.spring import file_of, on_spring, ramp

STIFFNESS_N_MM = 20.0
NOISE_N = 0.02
SETTLED_S = 5.0
LOOP = {
    "settings__force_loop__rate_hz": 100.0,
    "settings__force_loop__cutoff_hz": 5.0,
    "settings__force_loop__delay_ms": 10.0,
    "settings__force_loop__integral_mm_n_s": 10.0 / STIFFNESS_N_MM,
    "settings__limits__heartbeat_ms": 40.0,
    "settings__touch__settle_s": 0.3,
}


def ramp_of(seed, seconds=60.0, noise_n=NOISE_N):
    """Return by how much the recorded force is off on a ramp as steep as 5 N in 60 s, and the true one's rms [mN]."""
    scene = ramp(5.0 * seconds / 60.0, 0.5, 0.5 + seconds)
    found = on_spring(STIFFNESS_N_MM, scene, noise_n=noise_n, seed=seed, **LOOP)
    assert found.acquisition.ended == ""

    def off(t_s, force_n):
        on_ramp = t_s > 0.5 + SETTLED_S
        return 1e3 * (force_n - np.interp(t_s, *scene.profile.corners))[on_ramp]

    place_m = found.data["motor"][:, 0] - 1e-3 * found.acquisition.drawn["skin mm"]
    true = off(found.t_s["motor"], 1e3 * STIFFNESS_N_MM * place_m)
    return float(off(found.t_s["force_torque"], found.force_n).mean()), float(true.std())


def main(presses):
    """Print the table; return how many rows are not kept."""
    said = 1e3 * ramp_error_n(settings_of(file_of(**LOOP)).force_loop.loop(), 5.0 / 60.0, 1e3 * STIFFNESS_N_MM)
    found = []
    for seed in range(1, presses + 1):
        began_s = time.perf_counter()
        found.append(ramp_of(seed))
        print(f"seed {seed}: {found[-1]}, {time.perf_counter() - began_s:.0f} s", file=sys.stderr, flush=True)
    means, spreads = np.array(found).T
    error = 1e3 * NOISE_N / np.sqrt(100.0 * (60.0 - SETTLED_S))
    rows = [
        ("closed form of the error [mN]", "-6.1 +- 0.05", said, abs(said + 6.1) <= 0.05),
        (f"mean of {presses} presses [mN]", "-6.1 +- 0.5", means.mean(), abs(means.mean() + 6.1) <= 0.5),
        ("largest rms of the true force about its mean [mN]", "<= 10", spreads.max(), spreads.max() <= 10.0),
    ]
    print("| what | wanted | found | kept |\n|---|---|---|---|")
    for what, wanted, value, kept in rows:
        print(f"| {what} | {wanted} | {value:.3g} | {'yes' if kept else 'NO'} |")
    print(f"standard error of one press {error:.2f} mN, of {presses} {error / presses**0.5:.2f} mN; "
          f"standard deviation of the presses' means {means.std(ddof=1):.2f} mN")  # fmt: skip
    return sum(not row[-1] for row in rows)


if __name__ == "__main__":
    sys.exit(min(1, main(int(sys.argv[1]) if len(sys.argv) > 1 else 8)))
