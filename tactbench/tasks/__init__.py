"""Benchmark tasks that this package provides, each with its target, scenes, metrics and splits."""
