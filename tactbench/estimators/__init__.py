"""The estimators tactbench brings: descriptors here, code in the modules they name."""

TACTBENCH_API = 1
