"""Module imported by the fork server, which loads libraries, estimators and simulated rigs once for all workers."""

import gc
import os
from contextlib import suppress
from importlib import import_module
from importlib.metadata import entry_points

from tactbench.core.thread_limit import keep_threads

keep_threads()
if hasattr(os, "setsid"):
    with suppress(OSError):
        os.setsid()  # Ctrl-C in a terminal then reaches only the run, which ends its workers

# A pipe that the run writes to ends with the run: workers print to logs of their own.
nowhere = os.open(os.devnull, os.O_WRONLY)
for stream in (1, 2):
    os.dup2(nowhere, stream)

LIBRARIES = ("h5py", "scipy.linalg", "scipy.signal", "scipy.special", "threadpoolctl")
for library in (*LIBRARIES, "tactbench.core.acquisition", "tactbench.core.evaluation.cell"):
    import_module(library)

from tactbench.core.matrix.solve import prepare  # noqa: E402
from tactbench.core.plugins.registry import load_object, load_registry  # noqa: E402

_ours = load_registry([point for point in entry_points(group="tactbench") if point.module.startswith("tactbench.")])
for estimator in _ours.estimators:
    for kind in estimator.kinds:
        prepare(estimator, kind)
for rig in _ours.rigs:
    if rig.simulated:
        load_object(rig.where)
gc.freeze()  # pages shared with workers are not written to by the garbage collector
