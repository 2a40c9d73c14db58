"""Everything with memory against closed forms: lags, drift, the heated core, low-passes, the force loop's limit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray, ForceLoop, assumed
from tactbench.plugin.devices import LoopModel
from tactbench.plugin.simulation import Check, Verdict
from tactbench.rigs.twin.effects.heated_core import HeatedCore
from tactbench.rigs.twin.effects.memory import lag, time_constant_s, wandering

_ROUNDING = 1e-12
"""Bound on relative errors of exact filters: some thousand operations, each off by 1e-16."""
_EXACT = "closed form; rounding of some thousand operations"
_ERRORS = 4.0
"""Standard errors allowed to a statistic: one in 16 000 is further off by chance, and the draws are fixed."""


def checks() -> Sequence[Check]:
    """Return the checks of group ``memory``."""
    return [
        Check("lag-step", "memory", "standard linear solid: its strain under a step of stress, at any steps", _solid),
        Check("lag-ramp", "memory", "a Prony term behind a ramp: t - tau (1 - exp(-t/tau))", _ramp),
        Check("lag-curve", "memory", "a Prony term behind a curved load: the error falls with dt^2", _curve),
        Check("drift-moments", "memory", "Ornstein-Uhlenbeck drift: mean, variance, correlation, means over T", _drift),
        Check("heat-step", "memory", "heated core touched all at once: closed form and balance of energy", _heat),
        Check("heat-order", "memory", "heated core under a growing contact: the error falls with dt^2", _heat_order),
        Check("low-pass", "memory", "low-pass at its cut-off: 1/sqrt 2 of a sine, an eighth of a turn late", _low_pass),
        Check("force-loop-limit", "memory", "force loop on a spring: where it swings up, against eigenvalues", _limit),
    ]


def _solid() -> list[Verdict]:
    """``e(t) = s (1/E0 + (1 - exp(-t/tau))/E1)`` after a step of stress s."""
    stress, first, second, tau = 0.3, 0.8, 2.5, 7.0
    steps = np.random.default_rng(1).choice([1e-3, 0.1, 3.0, 40.0], 200)
    # A repeated time stamp makes the step: stress jumps while no time passes.
    t_s = np.concatenate([[0.0, 0.0], np.cumsum(steps)])
    load = np.full(t_s.size, stress)
    load[0] = 0.0
    found = load / first + lag(t_s, load, tau) / second
    expected = stress * (1 / first - np.expm1(-t_s / tau) / second)
    worst = float(np.abs(found / expected - 1)[1:].max())
    long = lag(np.array([0.0, 0.0, 2.6]), np.array([0.0, 1.0, 1.0]), tau)[-1]
    short = lag(np.array([0.0, 0.0, 1.3, 2.6]), np.array([0.0, 1.0, 1.0, 1.0]), tau)[-1]
    far = lag(np.array([0.0, 0.0, 1e3 * tau]), np.array([0.0, 1.0, 1.0]), tau)[-1]
    return [
        Verdict("strain, relative error", worst, 0.0, _ROUNDING, source=_EXACT),
        Verdict("one step against two halves", abs(float(long - short)), 0.0, _ROUNDING, source="semigroup"),
        Verdict("a step of 1000 tau, from equilibrium", abs(float(far) - 1.0), 0.0, _ROUNDING, source=_EXACT),
    ]


def _ramp() -> list[Verdict]:
    verdicts = []
    for steps_per_tau in (1000.0, 1.0, 0.01):
        tau, rate = 3.0, 0.4
        t_s: FloatArray = np.arange(200, dtype=np.float64) * (tau / steps_per_tau)
        expected = rate * (t_s + tau * np.expm1(-t_s / tau))
        error = float(np.abs(lag(t_s, rate * t_s, tau) - expected).max() / expected.max())
        verdicts.append(Verdict(f"{steps_per_tau:g} steps per tau", error, 0.0, _ROUNDING, source=_EXACT))
    return verdicts


def _order(errors: Sequence[float]) -> float:
    """Return the order seen between the two finest of halved steps."""
    return math.log2(errors[-2] / errors[-1])


def _curve() -> list[Verdict]:
    """Straight pieces under ``sin(w t)``: the lag in its steady state is ``sin(w t - phi)/sqrt(1 + (w tau)^2)``."""
    omega, tau, errors = 1.0, 2.0, []
    for n in (200, 400, 800):
        t_s = np.linspace(0, 60, n + 1)
        found = lag(t_s, np.sin(omega * t_s), tau)
        x = omega * tau
        expected = (np.sin(omega * t_s) - x * np.cos(omega * t_s) + x * np.exp(-t_s / tau)) / (1 + x * x)
        errors.append(float(np.abs(found - expected).max()))
    return [
        Verdict("observed order", _order(errors), 1.9, 2.1, source="interpolation by straight pieces is of order 2"),
    ]


def _drift() -> list[Verdict]:
    spread, tau, paths = 2.0, 10.0, 4000
    t_s: FloatArray = np.cumsum(np.tile([0.5, 1.5], 150), dtype=np.float64)
    drawn = wandering(t_s, spread, tau, paths, np.random.default_rng(5)) / spread
    error = 1 / math.sqrt(paths)
    span = t_s[-1] - t_s[0]
    times = tau / span
    # Exact for the trapezoid's weights, so that no discretisation is left in the bound.
    weights = np.gradient(t_s)
    weights[[0, -1]] = 0.5 * np.diff(t_s)[[0, -1]]
    weights /= weights.sum()
    apart = np.abs(t_s[:, None] - t_s[None, :])
    expected = float(weights @ np.exp(-apart / tau) @ weights)
    continuous = 2 * times * (1 + times * math.expm1(-1 / times))
    means = float((weights @ drawn).var())
    found = float((drawn[20] * drawn[30]).mean())
    rho = math.exp(-(t_s[30] - t_s[20]) / tau)
    wide = _ERRORS * math.sqrt(2) * error
    law = f"{_ERRORS:g} standard errors of {paths} paths"
    return [
        Verdict("mean of the first sample", float(drawn[0].mean()), -_ERRORS * error, _ERRORS * error, source=law),
        Verdict("mean of the last sample", float(drawn[-1].mean()), -_ERRORS * error, _ERRORS * error, source=law),
        Verdict("variance of the first sample", float(drawn[0].var()), 1 - wide, 1 + wide, source=law),
        Verdict("variance of the last sample", float(drawn[-1].var()), 1 - wide, 1 + wide, source=law),
        Verdict(
            "correlation after one tau",
            found - rho,
            -_ERRORS * math.sqrt(1 + rho**2) * error,
            _ERRORS * math.sqrt(1 + rho**2) * error,
            source=f"exp(-dt/tau); {law}",
        ),
        Verdict("variance of a mean over 30 tau", means / expected, 1 - wide, 1 + wide, source=law),
        Verdict(
            "its expectation, sampled against 2 (tau/T) (1 - (tau/T)(1 - exp(-T/tau)))",
            expected / continuous,
            0.99,
            1.01,
            source="steps of up to 0.15 tau: the trapezoid errs by dt^2/(12 tau^2) of the peak",
        ),
    ]


_CORE = HeatedCore(room_c=23.0, power_w=0.25, resistance_k_per_w=136.0, capacity_j_per_k=3.7)


def _heat() -> list[Verdict]:
    through, indenter_c, start_c = 4e-3, 5.0, 57.0
    steps = np.random.default_rng(2).choice([1e-2, 1.0, 60.0, 900.0], 300)
    t_s = np.concatenate([[0.0], np.cumsum(steps)])
    found = _CORE.carried(t_s, np.full(t_s.size, through), indenter_c, start_c)
    loss = 1 / _CORE.resistance_k_per_w + through
    goal = (_CORE.power_w + _CORE.room_c / _CORE.resistance_k_per_w + through * indenter_c) / loss
    tau = _CORE.capacity_j_per_k / loss
    expected = goal + (start_c - goal) * np.exp(-t_s / tau)
    # The first law over ten minutes, the temperature's integral taken from its samples alone.
    fine = np.linspace(0.0, 600.0, 4001)
    cooled = _CORE.carried(fine, np.full(fine.size, through), indenter_c, start_c)
    simpson = np.tile([4.0, 2.0], 2000)[:-1]
    area = float(cooled[0] + simpson @ cooled[1:-1] + cooled[-1]) * (fine[1] - fine[0]) / 3.0
    span = 600.0
    from_room = (_CORE.room_c * span - area) / _CORE.resistance_k_per_w
    given = _CORE.power_w * span + from_room + through * (indenter_c * span - area)
    kept = _CORE.capacity_j_per_k * (cooled[-1] - start_c)
    throughput = _CORE.power_w * span
    still = _CORE.carried(np.zeros(5), np.full(5, through), indenter_c, start_c)
    return [
        Verdict("temperature", float(np.abs(found - expected).max()), 0.0, 1e-10, "K", _EXACT),
        Verdict(
            "energy given less kept, over the heater's",
            abs(given - kept) / throughput,
            0.0,
            1e-11,
            source="first law; Simpson's rule at 1/1500 tau errs by 1e-14, sums of 4001 by rounding",
        ),
        Verdict("no time, no change", float(np.abs(still - start_c).max()), 0.0, 0.0, "K", "dt = 0"),
    ]


def _heat_order() -> list[Verdict]:
    """Hold a contact that grows like a straight line against its solution as an integral, taken by Gauss's rule."""
    rate, indenter_c, start_c, end_s = 2e-4, 5.0, 57.0, 60.0
    points, weights = np.polynomial.legendre.leggauss(60)
    s = 0.5 * end_s * (points + 1)

    def decay(t: FloatArray | float) -> FloatArray:
        return np.exp(-(np.asarray(t) / _CORE.resistance_k_per_w + 0.5 * rate * np.asarray(t) ** 2) / 3.7)

    source = (_CORE.power_w + _CORE.room_c / _CORE.resistance_k_per_w + rate * s * indenter_c) / 3.7
    true = float(decay(end_s) * (start_c + 0.5 * end_s * np.sum(weights * source / decay(s))))
    errors = []
    for n in (15, 30, 60):
        t_s = np.linspace(0, end_s, n + 1)
        errors.append(abs(float(_CORE.carried(t_s, rate * t_s, indenter_c, start_c)[-1]) - true))
    return [
        Verdict("observed order", _order(errors), 1.9, 2.1, source="the mean conductance of a step is of order 2"),
        Verdict("error at steps of a second", errors[-1], 0.0, 1e-3, "K", "a tenth of TDC's count"),
    ]


def _low_pass() -> list[Verdict]:
    cutoff = 2.0
    tau = time_constant_s(cutoff)
    t_s = np.linspace(0, 6, 60_001)
    found = lag(t_s, np.sin(2 * math.pi * cutoff * t_s), tau)[30_000:]
    t = t_s[30_000:]
    wave = np.stack([np.sin(2 * math.pi * cutoff * t), np.cos(2 * math.pi * cutoff * t)], axis=1)
    (inside, beside), *_ = np.linalg.lstsq(wave, found, rcond=None)
    constant = float(lag(t_s, np.full(t_s.size, 2.5), tau)[-1])
    size, late = float(np.hypot(inside, beside)), float(-np.arctan2(beside, inside) / math.pi)
    law = "1/(1 + i f/f_c) at f = f_c; straight pieces of 1e-4 s cost (w dt)^2/12 = 1e-7"
    return [
        Verdict("gain times sqrt 2", size * math.sqrt(2), 1 - 1e-6, 1 + 1e-6, source=law),
        Verdict("delay in half turns", late, 0.25 - 1e-6, 0.25 + 1e-6, source=law),
        Verdict("a constant, over itself", constant / 2.5, 1 - _ROUNDING, 1 + _ROUNDING, source="gain 1; rounding"),
    ]


def _limit() -> list[Verdict]:
    """Bisect the stiffness at which a simulated kick neither grows nor dies, and hold it against the eigenvalues'."""
    verdicts = []
    unlimited = {"speed": assumed(1e20, "mm/s", "none"), "acceleration": assumed(1e30, "mm/s/s", "none")}
    for name, cutoff in (("filtered", assumed(1.0, "Hz", "check")), ("unfiltered", None)):
        drive = ForceLoop(cutoff=cutoff, resolution=assumed(0.0, "N", "none"), **unlimited)
        loop = LoopModel.of(drive, "mm", period_s=0.012)
        limit = loop.largest_stiffness()
        low, high = 0.5 * limit, 2.0 * limit
        while high / low > 1.001:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if _swings(loop, middle) else (middle, high)
        verdicts.append(
            Verdict(
                f"{name}: swings up at, over the limit of {limit:.3g} N/mm",
                math.sqrt(low * high) / limit,
                0.99,
                1.01,
                source="eigenvalues on the unit circle; 4000 steps tell a growth of 1 % in stiffness from none",
            )
        )
    return verdicts


def _swings(loop: LoopModel, stiffness: float) -> bool:
    noise = np.zeros(4000)
    noise[0] = 1e-6 * stiffness
    depths = np.abs(loop.simulate(lambda depth: stiffness * depth, np.zeros(noise.size), noise))
    return bool(depths[-1000:].max() > depths[1000:2000].max())
