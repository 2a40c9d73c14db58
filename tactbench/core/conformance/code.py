"""Checks of every plugin: its code can be found, its module is light, its numbers are numbers."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import lru_cache

from tactbench.core.conformance.check import CODE, KINDS, Subject, check, code_of, fail, skip

HEAVY = frozenset({
    "can", "cv2", "dask", "distributed", "h5py", "jax", "matplotlib", "numba", "pandas", "pyarrow", "rclpy", "rich",
    "scipy", "serial", "sklearn", "spidev", "tensorflow", "torch", "transformers",
})  # fmt: skip
"""Packages that take tenths of a second to import, or that need not be installed where plugins are listed."""


@check(*KINDS)
def code_names_resolve(subject: Subject) -> None:
    """Code is named by text and imported when it is needed, so that a slip of the pen shows in the middle of a run.

    Correct the ``module:attribute`` in the descriptor, or the module itself where its import fails.
    """
    named = {field: where for field in CODE if (where := subject.names_code(field))}
    if not named:
        skip("its descriptor names no code")
    for field, where in named.items():
        with code_of(field, subject):
            found = subject.code(field)
        if not callable(found):
            fail(field, f"{where} is a {type(found).__name__}, and something that can be called is needed")


@check(*KINDS)
def import_is_light(subject: Subject) -> None:
    """The module of an entry point is imported by every command, also by one that only lists names.

    Move imports of large packages into the module that the descriptor names, or into functions.
    """
    heavy = sorted(HEAVY.intersection(_imported_with(subject.module)))
    if heavy:
        fail(subject.module, f"its import also imports {', '.join(heavy)}")


@lru_cache(maxsize=64)
def _imported_with(module: str) -> list[str]:
    """Return the modules of a fresh interpreter with one; what tactbench itself imports is not heavy."""
    path = os.pathsep.join(part for part in sys.path if part)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", f"import sys, {module}; print(*sys.modules)"],
        env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        fail(module, f"it cannot be imported in a fresh interpreter: {done.stderr.strip().rpartition(chr(10))[2]}")
    return done.stdout.split()


@check(*KINDS)
def numbers_are_finite(subject: Subject) -> None:
    """NaN in a spec passes every comparison, and shows as a score of NaN.

    Leave the field out where nobody states the number.
    """
    found = re.search(r"name='([^']*)'[^()]*?(\w+)=(-?inf|nan)\b", repr(subject.descriptor))
    if found is not None:
        fail(f"{found[1]}.{found[2]}", f"it is {found[3]}")
