"""All checks there are, by kind of plugin, and how many a plugin must at least have run."""

from __future__ import annotations

from collections.abc import Mapping

from tactbench.core.conformance import (
    common,
    driver,
    effect,
    estimator,
    press,
    recorded,
    sensor_spec,
    task,
    transducer,
)
from tactbench.core.conformance.check import Check, Kind, Mode

CHECKS: tuple[Check, ...] = (
    *common.CHECKS, *sensor_spec.CHECKS, *transducer.CHECKS, *press.CHECKS, *driver.CHECKS, *task.CHECKS,
    *estimator.CHECKS, *effect.CHECKS, *recorded.CHECKS,
)  # fmt: skip
"""In the order in which they run: a check stands behind those that it needs."""

FLOORS: Mapping[Kind, int] = {"sensor": 11, "rig": 6, "task": 13, "estimator": 14, "effect": 12}
"""Passive checks that every plugin of a kind can run, whatever it leaves out: fewer, and nothing was proved."""

ENOUGH = "enough-checks-ran"
"""Name of what is red where fewer ran."""


def checks_of(kind: Kind, *modes: Mode) -> tuple[Check, ...]:
    """Return the checks of a kind of plugin in some modes, in their order."""
    return tuple(one for one in CHECKS if kind in one.kinds and one.mode in modes)
