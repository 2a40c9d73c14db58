"""Checks of device drivers on emulators."""

from tactbench.devices.conformance import driver, positioner  # noqa: F401  (their checks, in this order)
