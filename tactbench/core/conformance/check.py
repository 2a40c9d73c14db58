"""Checks, their subjects and outcomes, and the checks of every plugin."""

from __future__ import annotations

import inspect
import io
import os
import re
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, Literal, NamedTuple, NoReturn, get_args
from unittest.mock import patch

import numpy as np

from tactbench.core.errors import NotApplicable, PluginError, error_text
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import Registry, ask_plugin, line_in, load_object

Kind = Literal["sensor", "rig", "device", "task", "estimator", "effect", "indenter", "profile", "dataset"]
EVERY_KIND: tuple[Kind, ...] = get_args(Kind)
KINDS = EVERY_KIND[:-1]
"""Kinds of descriptors; a data set is a file."""
Mode = Literal["passive", "invasive", "recording"]
"""`passive`: nothing is opened and nothing moves. `invasive`: a line is opened, something is pressed. `recording`: only
a recording is read."""
HEAVY = frozenset({
    "can", "cv2", "dask", "distributed", "h5py", "jax", "matplotlib", "numba", "pandas", "pyarrow", "rclpy", "rich",
    "scipy", "serial", "sklearn", "spidev", "tensorflow", "torch", "transformers",
})  # fmt: skip
"""Packages that take tenths of a second to import, or that need not be installed where plugins are listed."""


THREAD_S = 1.0  # time for a thread to end


class CheckFailed(AssertionError):  # noqa: N818  (a result, as its sibling)
    """A plugin fails a check.

    Parameters
    ----------
    where
        The field, argument or line at fault: ``spec.streams[taxels].channels[t3].position_m``.
    text
        What was found and what was expected, in one sentence.
    """

    def __init__(self, where: str, text: str) -> None:
        super().__init__(f"{where}: {text}")
        self.where = where
        self.text = text


class CheckSkipped(Exception):  # noqa: N818  (a result, not a failure)
    """A plugin lacks what a check is about, and may: the message says what."""


class CheckOutcome(NamedTuple):
    """Outcome of a check."""

    check: str
    status: Literal["passed", "failed", "skipped"]
    where: str = ""
    """The field or line at fault."""
    text: str = ""
    """The mistake, or the reason for which it was skipped."""
    advice: str = ""
    """Advice; empty where the plugin's code raised, since `where` and `text` are then all that is known."""
    seconds: float | None = None
    """Duration; None for a check that was stopped or not tried."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A plugin's sensor, rig, device … under check, with the registry of all plugins."""

    kind: Kind
    name: str
    module: str
    """Module of the plugin's entry point, or the mapping file of a data set."""
    distribution: str
    registry: Registry
    recording: Path | None = None
    """Recording that is read in the mode `recording`."""
    rig_file: Path | None = None
    """Rig file of the devices that are opened in the mode `invasive`."""
    operator: Operator | None = None
    """Operator of the rig in the mode `invasive`."""
    root: Path | None = None
    """A folder that holds the files of a data set."""

    @cached_property
    def descriptor(self) -> Any:
        """Descriptor that the plugin's hook gives in this process; CheckFailed if it does not."""
        try:
            offered = ask_plugin(EntryPoint("checked", self.module, hookspecs.GROUP))[f"{self.kind}s"]
            return next(one for one in offered if one.name == self.name)
        except (PluginError, KeyError, StopIteration) as error:
            raise CheckFailed(self.module, f"its hook does not give {self.name!r} again: {error}") from error

    @property
    def spec(self) -> Any:
        """The spec of a sensor or task; of others the descriptor."""
        return getattr(self.descriptor, "spec", self.descriptor)

    @property
    def package(self) -> str:
        """The top of the plugin's module names."""
        return self.module.partition(".")[0]

    def code(self, field: str) -> Any:
        """Return the object that a field of the descriptor or the spec names, imported."""
        return load_object(getattr(self.descriptor, field, None) or getattr(self.spec, field))


@dataclass(frozen=True)
class Check:
    """A check of some kinds of plugins."""

    name: str
    """Lower case with hyphens; unique among the checks of a kind."""
    kinds: tuple[Kind, ...]
    mode: Mode
    why: str
    """The mistake that it finds, in one sentence."""
    cure: str
    """Advice when it fails, in one sentence."""
    needs: tuple[str, ...]
    """Names of checks that must have passed; otherwise it is skipped."""
    run: Callable[[Subject], None]
    """Raises CheckFailed, or CheckSkipped."""


CHECKS: list[Check] = []
"""All checks in the order in which they run, each after those that it needs."""


def check(*kinds: Kind, needs: str = "", mode: Mode = "passive") -> Callable[[Callable[[Subject], None]], Check]:
    """Make a check of a function, by its name; its docstring has `why` and, as a second paragraph, `cure`."""

    def made(run: Callable[[Subject], None]) -> Check:
        why, _, cure = inspect.cleandoc(run.__doc__ or "").partition("\n\n")
        why, cure = (" ".join(text.split()) for text in (why, cure))
        name, needed = run.__name__.replace("_", "-"), tuple(needs.split())
        CHECKS.append(Check(name, kinds, mode, why, cure, needed, run))
        return CHECKS[-1]

    return made


def fail(where: str, text: str) -> NoReturn:
    """Raise CheckFailed."""
    raise CheckFailed(where, text)


def skip(text: str) -> NoReturn:
    """Raise CheckSkipped."""
    raise CheckSkipped(text)


@contextmanager
def code_of(field: str, subject: Subject) -> Iterator[None]:
    """Turn whatever the plugin's code raises into a failure that names the field, the line and what was raised."""
    try:
        yield
    except (CheckFailed, CheckSkipped):
        raise
    except NotApplicable as reason:
        raise CheckSkipped(f"it says: {reason.message}") from reason
    except (Exception, SystemExit) as error:
        line = line_in(subject.package, "".join(traceback.format_exception(error)))
        raise CheckFailed(f"{field}{line}", error_text(error)) from error


@check(*KINDS)
def code_names_resolve(subject: Subject) -> None:
    """Code is named by text and imported when it is needed, so that a slip of the pen shows in the middle of a run.

    Correct the ``module:attribute`` in the descriptor, or the module itself where its import fails.
    """
    fields = [*subject.descriptor, *subject.spec]
    named = [name for name, value in fields if isinstance(value, str) and re.fullmatch(r"[\w.]+:[\w.]+", value)]
    if not named:
        skip("its descriptor names no code")
    for field in named:
        with code_of(field, subject):
            subject.code(field)


def _seeded(*_: Any) -> NoReturn:
    raise PluginError("It seeds a global generator.", hint="Draw from a generator of your own.")


@contextmanager
def unchanged(subject: Subject) -> Iterator[None]:
    """Fail where a plugin's code changes what it shares with all others, prints, or leaves a thread of a driver."""
    before, threads = (np.geterr(), Path.cwd()), set(threading.enumerate())
    with (
        patch("numpy.random.seed", _seeded), patch("random.seed", _seeded),
        redirect_stdout(io.StringIO()) as printed, np.errstate(),
    ):  # fmt: skip
        yield
        if (np.geterr(), Path.cwd()) != before:
            fail(subject.package, "its code changes numpy's treatment of errors, or the current folder")
    if printed.getvalue():
        fail(subject.package, f"its code prints {printed.getvalue()[:40]!r}: results of commands go to stdout")
    for thread in set(threading.enumerate()) - threads if subject.kind in ("sensor", "device") else ():
        thread.join(THREAD_S)
        if thread.is_alive():
            fail(subject.package, f"the thread {thread.name} runs on: end it in close()")


@check(*KINDS)
def import_is_light(subject: Subject) -> None:
    """The module of an entry point is imported by every command, also by one that only lists names.

    Move imports of large packages into the module that the descriptor names, or into functions; compute and read
    nothing there.
    """
    heavy = sorted(HEAVY.intersection(_imported_with(subject.module)))
    if heavy:
        fail(subject.module, f"its import also imports {', '.join(heavy)}")


@lru_cache(maxsize=64)
def _imported_with(module: str) -> list[str]:
    """Return the modules of a fresh interpreter that has imported a module, without those of tactbench's own door."""
    path = os.pathsep.join(part for part in sys.path if part)
    code = f"import sys, tactbench.plugin.devices; a = {{*sys.modules}}; import {module}; print(*{{*sys.modules}} - a)"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        fail(module, f"it cannot be imported in a fresh interpreter: {done.stderr.strip().rpartition(chr(10))[2]}")
    return done.stdout.split()
