"""Tactbench: benchmark tactile sensors, and show what each score costs in time."""

__version__ = "0.1.0"
