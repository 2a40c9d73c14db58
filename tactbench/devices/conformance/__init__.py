"""Checks of drivers, on emulators and on real lines."""

from tactbench.devices.conformance import driver, positioner, real  # noqa: F401  (their checks, in this order)
