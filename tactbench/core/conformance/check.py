"""Definition of checks, of the plugins they check and of outcomes, and the checks that apply to every plugin."""

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
from functools import cache, cached_property
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, Literal, NamedTuple, NoReturn, get_args
from unittest.mock import patch

import numpy as np

from tactbench.core.errors import NotApplicable, PluginError, error_text
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.registry import Registry, ask_plugin, line_in, load_object

Kind = Literal["sensor", "rig", "device", "task", "estimator", "effect", "indenter", "profile", "dataset"]
EVERY_KIND: tuple[Kind, ...] = get_args(Kind)
KINDS = EVERY_KIND[:-1]
"""Kinds of descriptors that can be checked, and `dataset` for a mapping file."""
HEAVY = frozenset({
    "can", "cv2", "dask", "distributed", "h5py", "jax", "matplotlib", "numba", "pandas", "pyarrow", "rclpy", "rich",
    "scipy", "serial", "sklearn", "spidev", "tensorflow", "torch", "transformers",
})  # fmt: skip
"""Packages that take tenths of a second to import, or that may be absent where plugins are listed."""
THREAD_S = 1.0  # time for a thread to end


class CheckFailed(AssertionError):  # noqa: N818  (a result, as its sibling)
    """Raised when a plugin fails a check.

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
    """Raised when a plugin lacks, legitimately, the subject of a check; the message names what is absent."""


class CheckOutcome(NamedTuple):
    """Outcome of one check of one plugin."""

    check: str
    status: Literal["passed", "failed", "skipped"]
    where: str = ""
    """Field or line at fault."""
    text: str = ""
    """The mistake that was found, or the reason for skipping the check."""
    advice: str = ""
    """Advice for a failure; empty if the plugin's code raised an error, as only `where` and `text` are then known."""
    seconds: float | None = None
    """Duration of the check [s]; None: it was stopped or not tried."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A plugin's sensor, rig, device … to be checked, with the registry of all plugins."""

    kind: Kind
    name: str
    module: str
    """Module of the plugin's entry point, or the mapping file of a data set."""
    distribution: str
    registry: Registry
    recording: Path | None = None
    """Recording of the sensor to be read."""
    root: Path | None = None
    """Folder that contains the files of a data set."""

    @cached_property
    def descriptor(self) -> Any:
        """Descriptor from the plugin's hook, read anew in this process; raises CheckFailed if it is absent."""
        try:
            offered = ask_plugin(EntryPoint("checked", self.module, hookspecs.GROUP))[f"{self.kind}s"]
            return next(one for one in offered if one.name == self.name)
        except (PluginError, KeyError, StopIteration) as error:
            raise CheckFailed(self.module, f"the hook does not give {self.name!r} again: {error}") from error

    @property
    def spec(self) -> Any:
        """The specification of a sensor or task; for other kinds the descriptor."""
        return getattr(self.descriptor, "spec", self.descriptor)

    @property
    def package(self) -> str:
        """First part of the name of the plugin's module."""
        return self.module.partition(".")[0]

    def code(self, field: str) -> Any:
        """Import and return the object to which a field of the descriptor or the spec refers."""
        return load_object(getattr(self.descriptor, field, None) or getattr(self.spec, field))


@dataclass(frozen=True)
class Check:
    """A check that applies to some kinds of plugins."""

    name: str
    """Name of the check in lower case with hyphens; unique among the checks of a kind."""
    kinds: tuple[Kind, ...]
    why: str
    """The mistake that the check finds, in one sentence."""
    cure: str
    """Advice for plugins that fail the check, in one sentence."""
    needs: tuple[str, ...]
    """Names of checks that must pass first; otherwise this check is skipped."""
    run: Callable[[Subject], None]
    """Function that carries out the check; raises CheckFailed or CheckSkipped."""


CHECKS: list[Check] = []
"""All checks in the order in which they run, each check after those that it needs."""


def check(*kinds: Kind, needs: str = "") -> Callable[[Callable[[Subject], None]], Check]:
    """Make a check from a function and its name; its docstring is `why` and, as a second paragraph, `cure`."""

    def made(run: Callable[[Subject], None]) -> Check:
        why, _, cure = inspect.cleandoc(run.__doc__ or "").partition("\n\n")
        why, cure = (" ".join(text.split()) for text in (why, cure))
        name, needed = run.__name__.replace("_", "-"), tuple(needs.split())
        CHECKS.append(Check(name, kinds, why, cure, needed, run))
        return CHECKS[-1]

    return made


def fail(where: str, text: str) -> NoReturn:
    """Raise CheckFailed with the field or line at fault and the mistake."""
    raise CheckFailed(where, text)


def skip(text: str) -> NoReturn:
    """Raise CheckSkipped with the reason for skipping."""
    raise CheckSkipped(text)


@contextmanager
def code_of(field: str, subject: Subject) -> Iterator[None]:
    """Convert any error from the plugin's code to a failure that names the field, the line and the error."""
    try:
        yield
    except (CheckFailed, CheckSkipped):
        raise
    except NotApplicable as reason:
        raise CheckSkipped(f"not applicable: {reason.message}") from reason
    except (Exception, SystemExit) as error:
        line = line_in(subject.package, "".join(traceback.format_exception(error)))
        raise CheckFailed(f"{field}{line}", error_text(error)) from error


@check(*KINDS)
def code_names_resolve(subject: Subject) -> None:
    """Import paths are text, used only when the code is needed, so that a misspelling shows in the middle of a run.

    Correct the ``module:attribute`` in the descriptor, or the module itself where its import fails.
    """
    fields = [*subject.descriptor, *subject.spec]
    named = [name for name, value in fields if isinstance(value, str) and re.fullmatch(r"[\w.]+:[\w.]+", value)]
    if not named:
        skip("the descriptor has no import path of code")
    for field in named:
        with code_of(field, subject):
            subject.code(field)


def _seeded(*_: Any) -> NoReturn:
    raise PluginError("A global random generator is seeded.", hint="Use a generator of your own.")


@contextmanager
def unchanged(subject: Subject) -> Iterator[None]:
    """Fail if a plugin's code changes global state, prints, or leaves a driver's thread running."""
    before, threads = (np.geterr(), Path.cwd()), set(threading.enumerate())
    with (
        patch("numpy.random.seed", _seeded), patch("random.seed", _seeded),
        redirect_stdout(io.StringIO()) as printed, np.errstate(),
    ):  # fmt: skip
        yield
        if (np.geterr(), Path.cwd()) != before:
            fail(subject.package, "the code changes numpy's treatment of errors, or the current folder")
    if printed.getvalue():
        fail(subject.package, f"the code prints {printed.getvalue()[:40]!r}: stdout is for results of commands")
    for thread in set(threading.enumerate()) - threads if subject.kind in ("sensor", "device") else ():
        thread.join(THREAD_S)
        if thread.is_alive():
            fail(subject.package, f"the thread {thread.name} runs on: end it in close()")


@check(*KINDS)
def import_is_light(subject: Subject) -> None:
    """Every command imports the modules of all entry points, including commands that only list names.

    Move imports of large packages into the module to which the descriptor refers, or into functions; compute and read
    nothing at import.
    """
    heavy = sorted(HEAVY.intersection(_imported_with(subject.module)))
    if heavy:
        fail(subject.module, f"importing this module also imports {', '.join(heavy)}")


@cache
def _imported_with(module: str) -> list[str]:
    """Return the modules that importing `module` loads in a new interpreter, without those of tactbench's own."""
    path = os.pathsep.join(part for part in sys.path if part)
    code = f"import sys, tactbench.plugin.devices; a = {{*sys.modules}}; import {module}; print(*{{*sys.modules}} - a)"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        fail(module, f"no new interpreter can import the module: {done.stderr.strip().rpartition(chr(10))[2]}")
    return done.stdout.split()
