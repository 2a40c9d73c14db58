"""The checks that a plugin must pass: ``tactbench check`` runs them, :mod:`tactbench.testing` hands them out."""
