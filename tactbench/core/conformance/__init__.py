"""Checks that a plugin must pass: ``tactbench check`` and :mod:`tactbench.testing` run them."""
