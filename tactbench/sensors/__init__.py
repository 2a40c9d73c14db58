"""Tactile sensors that this package provides, each in a subpackage of its own."""
