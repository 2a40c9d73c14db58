"""All checks there are, by kind of plugin, and how many a plugin must at least have run."""

from __future__ import annotations

from collections.abc import Mapping

from tactbench.core.conformance import (
    common,
    device,
    driver,
    effect,
    estimator,
    indenter_and_profile,
    invasive,
    press,
    recorded,
    sensor_spec,
    task,
    transducer,
)
from tactbench.core.conformance.check import KINDS, Check, Kind, Mode, check
from tactbench.core.conformance.subject import Subject

CHECKS: tuple[Check, ...] = (
    *common.CHECKS, *sensor_spec.CHECKS, *transducer.CHECKS, *press.CHECKS, *driver.CHECKS, *device.CHECKS,
    *task.CHECKS, *estimator.CHECKS, *effect.CHECKS, *indenter_and_profile.CHECKS, *recorded.CHECKS, *invasive.CHECKS,
)  # fmt: skip
"""In the order in which they run: a check stands behind those that it needs."""

FLOORS: Mapping[Kind, int] = {
    "sensor": 11,
    "rig": 6,
    "device": 5,
    "task": 13,
    "estimator": 14,
    "effect": 12,
    "indenter": 13,
    "profile": 10,
}
"""Passive checks that every plugin of a kind can run, whatever it leaves out: fewer, and nothing was proved."""


@check(*KINDS)
def expected_failures_are_checks(subject: Subject) -> None:
    """A list of expected failures grows old: a name that is no check excuses nothing.

    Correct the names in EXPECTED_FAILURES of the plugin's module, or take them off.
    """


@check(*KINDS)
def enough_checks_ran(subject: Subject) -> None:
    """A plugin that skips most of its checks has proved nothing, however green it looks.

    Install what it needs, and give it what the skipped checks ask for.
    """


OF_THE_LIST = (expected_failures_are_checks, enough_checks_ran)
"""About the run of the others: they stand at its end."""


def checks_of(kind: Kind, *modes: Mode) -> tuple[Check, ...]:
    """Return the checks of a kind of plugin in some modes, in their order."""
    return tuple(one for one in CHECKS if kind in one.kinds and one.mode in modes)
