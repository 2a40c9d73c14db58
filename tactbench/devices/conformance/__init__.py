"""Checks of device drivers, on emulators and on real devices."""

from tactbench.devices.conformance import driver, positioner, real  # noqa: F401  (their checks, in this order)
