from __future__ import annotations

import numpy as np
import pytest

from tactbench.plugin.devices import LoopModel
from tactbench.rigs.twin.effects import heated_core
from tactbench.rigs.twin.effects import memory as filters
from tactbench.rigs.twin.verification import memory

CHECKS = {check.name: check for check in memory.checks()}


@pytest.mark.parametrize("name", CHECKS)
def test_the_twin_holds(name):
    verdicts = CHECKS[name].run()
    assert verdicts
    assert [verdict.name for verdict in verdicts if not verdict.met] == []


def _late(t_s, load, tau_s):
    """The input held at the new sample, instead of straight: of order one."""
    decay = np.exp(-np.diff(t_s, prepend=t_s[:1]) / tau_s)
    drive = (1 - decay) * load
    drive[0] = load[0]
    return filters.recurrence(decay, drive)


def _explicit(t_s, spread, tau_s, channels, generator):
    """Euler's step, whose variance depends on dt."""
    dt = np.diff(t_s, prepend=t_s[:1])
    drive = generator.standard_normal((t_s.size, channels)) * (spread * np.sqrt(2 * dt / tau_s))[:, None]
    drive[0] = spread * generator.standard_normal(channels)
    return filters.recurrence(np.maximum(1 - dt / tau_s, 0) * 0.9, drive)


def _euler(self, t_s, conductance, indenter_c, start_c):
    found = [start_c]
    for dt, through in zip(np.diff(t_s), conductance[:-1], strict=True):
        flow = self.power_w + (self.room_c - found[-1]) / self.resistance_k_per_w + through * (indenter_c - found[-1])
        found.append(found[-1] + float(np.clip(dt * flow / self.capacity_j_per_k, -1e3, 1e3)))
    return np.array(found)


@pytest.mark.parametrize(
    ("where", "what", "broken", "caught"),
    [
        (memory, "lag", _late, {"lag-ramp", "lag-curve", "low-pass"}),
        (memory, "wandering", _explicit, {"drift-moments"}),
        (heated_core.HeatedCore, "carried", _euler, {"heat-step", "heat-order"}),
        (LoopModel, "growth", lambda self, k: 0.15 * k, {"force-loop-limit"}),
    ],
)
def test_and_would_not_if_it_were_broken(where, what, broken, caught, monkeypatch):
    monkeypatch.setattr(where, what, broken)
    for name in caught:
        assert not all(verdict.met for verdict in CHECKS[name].run()), name
