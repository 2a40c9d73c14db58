"""Hard times for the filters with memory: long steps, repeated time stamps, clocks with a huge offset."""

import math

import numpy as np

from tactbench.rigs.twin.effects.memory import lag, wandering


def _times(case, tau, *, longest=1e4, repeated=0.2):
    """Draw ascending times whose steps are 1e-6 to `longest` time constants, some of them zero."""
    n = int(case.rng.integers(1, 200))
    steps = tau * 10 ** case.rng.uniform(-6, math.log10(longest), n)
    steps[case.rng.random(n) < repeated] = 0.0
    case.says(samples=n, tau_s=tau, longest_step_s=float(steps.max()))
    return np.asarray(np.cumsum(steps), dtype=np.float64)


def lag_over_any_steps(case):
    """Lag exactly over steps from 1e-6 to 1e12 time constants, and never outside the load's range.

    The reference goes one sample after the other in extended precision, from the solution for a straight load.
    """
    tau = case.decades(1e-6, 1e6)
    t_s = _times(case, tau, longest=10 ** case.uniform(1, 12))
    load = case.rng.uniform(0, 5, t_s.size)
    repeated = np.flatnonzero(np.diff(t_s) == 0) + 1
    for place in repeated:
        load[place] = load[place - 1]
    found = lag(t_s, load, tau)
    case.holds(np.isfinite(found).all(), "a lag is not finite")
    case.holds(found.min() >= load.min() - 1e-12 and found.max() <= load.max() + 1e-12, "a lag leaves its load's range")
    wanted = [np.longdouble(load[0])]
    for n in range(1, t_s.size):
        e = np.longdouble(t_s[n] - t_s[n - 1]) / np.longdouble(tau)
        late = -np.expm1(-e)
        # Below 1e-4 the textbook form loses digits even here.
        straight = e / 2 - e**2 / 6 + e**3 / 24 if e < 1e-4 else 1 - late / e
        wanted.append(wanted[-1] + late * (load[n - 1] - wanted[-1]) + (load[n] - load[n - 1]) * straight)
    apart = float(np.abs(found - np.array(wanted, dtype=np.longdouble)).max())
    # 1 - late/e in doubles at e = 1e-4: 1e-16 / 1e-4, times the load.
    case.holds(apart <= 1e-11, f"a lag is off by {apart:g} of 5 N")


def repeated_times(case):
    """Change nothing at a repeated time stamp: not the lag, not the drift, and not a sample after it.

    The doubling recurrence adds the same terms in another order: equal to rounding.
    """
    tau = case.decades(1e-3, 1e3)
    t_s = _times(case, tau, repeated=0.0)
    load = case.rng.uniform(0, 5, t_s.size)
    times = case.rng.integers(1, 4, t_s.size)
    first = np.cumsum(times) - times
    plain, repeated = lag(t_s, load, tau), lag(np.repeat(t_s, times), np.repeat(load, times), tau)
    case.holds(
        np.allclose(repeated, np.repeat(plain, times), rtol=0, atol=1e-12), "a repeated time stamp moves the lag"
    )
    paths = wandering(np.repeat(t_s, times), 1.0, tau, 3, case.rng)
    case.holds(
        np.allclose(paths, np.repeat(paths[first], times, axis=0), rtol=0, atol=1e-12),
        "a repeated time stamp moves the drift",
    )


def no_time_constant(case):
    """Refuse a time constant of zero, below zero or no number."""
    case.right = "refusal"
    lag(np.arange(3.0), np.ones(3), (0.0, -case.decades(1e-6, 1e6), math.nan, math.inf)[case.rng.integers(4)])


def clocks_far_from_zero(case):
    """Lag alike whether times count from 1970 or from the first sample, as far as the clock resolves."""
    tau = case.decades(0.1, 100.0)
    t_s = np.cumsum(case.rng.uniform(0.001, 0.1, 100))
    load = case.rng.uniform(0, 5, t_s.size)
    offset = case.decades(1e6, 2e9)
    case.says(tau_s=tau, offset_s=offset)
    apart = float(np.abs(lag(t_s + offset, load, tau) - lag(t_s, load, tau)).max())
    # Each of 100 steps is off by the clock's resolution at most; an error of a step moves the lag by load / tau.
    case.holds(apart <= 100 * 5 * np.spacing(offset) / tau + 1e-12, f"the lag moves by {apart:g} of 5 N")


def drift_over_any_steps(case):
    """Keep the drift's variance and its correlation ``exp(-dt/tau)`` at any step.

    Bounds are six standard errors of 20 000 pairs: one case in 1e9 fails by chance.
    """
    tau, e, spread = case.decades(1e-3, 1e6), case.decades(1e-4, 1e6), case.decades(1e-3, 1e3)
    case.says(tau_s=tau, dt_in_tau=e, spread=spread)
    paths = wandering(np.array([0.0, e * tau]), spread, tau, 20_000, case.rng) / spread
    case.holds(np.isfinite(paths).all(), "a drift is not finite")
    bound = 6 / math.sqrt(20_000)
    for sample in paths:
        case.holds(abs(sample.mean()) <= bound, f"mean {sample.mean():g} of one deviation")
        case.holds(abs(sample.var() - 1) <= math.sqrt(2) * bound, f"variance {sample.var():g}, not 1")
    # A product of two normals of correlation rho has variance 1 + rho².
    found, rho = float((paths[0] * paths[1]).mean()), math.exp(-e)
    case.holds(abs(found - rho) <= math.sqrt(1 + rho**2) * bound, f"correlation {found:g}, not {rho:g}")
    # The step itself: what a path that mistakes small steps for none would get wrong.
    moved, wanted = float(((paths[1] - paths[0]) ** 2).mean()), -2 * math.expm1(-e)
    case.holds(abs(moved / wanted - 1) <= math.sqrt(2) * bound, f"mean square step {moved:g}, not {wanted:g}")


FAMILIES = (
    lag_over_any_steps, repeated_times, no_time_constant, clocks_far_from_zero, drift_over_any_steps,
)  # fmt: skip
