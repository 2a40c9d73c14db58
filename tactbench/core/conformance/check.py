"""What a check is, what it looks at, and what can come of it; and the checks of every plugin."""

from __future__ import annotations

import inspect
import io
import os
import random
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.metadata import EntryPoint
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, NamedTuple, NoReturn, get_args

import numpy as np

from tactbench.core.errors import NotApplicable, PluginError, error_text
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.interfaces import Operator
from tactbench.core.plugins.registry import Registry, ask_plugin, load_object

Kind = Literal["sensor", "rig", "device", "task", "estimator", "effect", "indenter", "profile", "dataset"]
EVERY_KIND: tuple[Kind, ...] = get_args(Kind)
KINDS = EVERY_KIND[:-1]
"""Of what hooks give; a data set is a file."""
Mode = Literal["passive", "invasive", "recording"]
"""`passive`: nothing is opened and nothing moves. `invasive`: a line is opened, something is pressed. `recording`: only
a recording is read."""
CODE = (
    "transducer", "driver", "emulator", "log_reader", "features_by", "where", "called_for", "verification",
    "work_precision", "likeness", "file", "check", "emulators",
)  # fmt: skip
"""Fields of descriptors that name code."""


HEAVY = frozenset({
    "can", "cv2", "dask", "distributed", "h5py", "jax", "matplotlib", "numba", "pandas", "pyarrow", "rclpy", "rich",
    "scipy", "serial", "sklearn", "spidev", "tensorflow", "torch", "transformers",
})  # fmt: skip
"""Packages that take tenths of a second to import, or that need not be installed where plugins are listed."""


IMPORT_S, THREAD_S = 1.0, 1.0  # a plugin's import may take so long [s of a processor], and a thread to end


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
    """What came of a check."""

    check: str
    status: Literal["passed", "failed", "skipped"]
    where: str = ""
    """The field or line at fault."""
    text: str = ""
    """What is wrong, or why it was skipped."""
    advice: str = ""
    """What to do; empty where the plugin's code raised: `where` and `text` then say all that is known."""
    seconds: float | None = None
    """How long it took; None: it was stopped, or not tried."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A plugin's sensor, rig, device … under check, and what else is installed."""

    kind: Kind
    name: str
    module: str
    """The plugin's, as its entry point names it; of a data set the mapping file."""
    distribution: str
    registry: Registry
    recording: Path | None = None
    """What is read in the mode `recording`."""
    rig_file: Path | None = None
    """What is opened in the mode `invasive`."""
    operator: Operator | None = None
    """Who stands at the rig in the mode `invasive`."""
    root: Path | None = None
    """A folder that holds the files of a data set."""

    @cached_property
    def descriptor(self) -> Any:
        """What the plugin's hook gives in this very process; CheckFailed if it does not."""
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

    def names_code(self, field: str) -> str | None:
        """Return ``module:callable`` of a field; None: it names none."""
        found = getattr(self.descriptor, field, getattr(self.spec, field, None))
        return found if isinstance(found, str) else None

    def code(self, field: str) -> Any:
        """Return what a field of the descriptor names, imported."""
        return load_object(self.names_code(field) or "")


@dataclass(frozen=True)
class Check:
    """One thing that is checked of a plugin."""

    name: str
    """Lower case with hyphens; unique among the checks of a kind."""
    kinds: tuple[Kind, ...]
    mode: Mode
    why: str
    """Why it exists, in one sentence."""
    cure: str
    """What to do when it fails, in one sentence."""
    needs: tuple[str, ...]
    """Checks that must have passed; otherwise it is skipped."""
    run: Callable[[Subject], None]
    """Raises CheckFailed, or CheckSkipped."""


CHECKS: list[Check] = []
"""All of them, in the order in which they run: a check stands behind those that it needs."""


def check(*kinds: Kind, needs: str = "", mode: Mode = "passive") -> Callable[[Callable[[Subject], None]], Check]:
    """Make a check of a function: its name is the check's, its docstring says why it exists, and then what to do.

    `needs` are names of checks.
    """

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
        line = line_in(subject.package, error.__traceback__)
        raise CheckFailed(f"{field} ({line})" if line else field, error_text(error)) from error


def line_in(package: str, trace: TracebackType | None) -> str:
    """Return ``file, line N`` of the innermost frame in a package; "" if none is in it."""
    found = ""
    while trace is not None:
        if trace.tb_frame.f_globals.get("__name__", "").partition(".")[0] == package:
            file = trace.tb_frame.f_code.co_filename.replace("\\", "/").split("/")
            found = f"{'/'.join(file[-2:])}, line {trace.tb_lineno}"
        trace = trace.tb_next
    return found


@check(*KINDS)
def code_names_resolve(subject: Subject) -> None:
    """Code is named by text and imported when it is needed, so that a slip of the pen shows in the middle of a run.

    Correct the ``module:attribute`` in the descriptor, or the module itself where its import fails.
    """
    named = [field for field in CODE if subject.names_code(field)]
    if not named:
        skip("its descriptor names no code")
    for field in named:
        with code_of(field, subject):
            subject.code(field)


def _shared() -> dict[str, Any]:
    """Return what all code of a process shares."""
    return {
        "the seed of numpy's global generator": np.random.get_state(legacy=False)["state"]["key"].tobytes(),  # noqa: NPY002
        "the seed of Python's global generator": random.getstate()[1][:-1],
        "how numpy treats floating-point errors": np.geterr(),
        "the current folder": Path.cwd(),
    }


@contextmanager
def unchanged(subject: Subject) -> Iterator[None]:
    """Fail where a plugin's code changes what it shares with all others, prints, or lets a thread of a driver run on.

    A generator that is drawn from keeps its words of state for 624 draws from position 0: libraries draw some.
    """
    state = np.random.get_state(legacy=False)  # noqa: NPY002
    state["state"]["pos"] = 0
    np.random.set_state(state)  # noqa: NPY002
    version, (*own, _), following = random.getstate()
    random.setstate((version, (*own, 0), following))
    before, threads = _shared(), set(threading.enumerate())
    with redirect_stdout(io.StringIO()) as printed, np.errstate():
        yield
        changed = [name for name, state in _shared().items() if state != before[name]]
    if changed:
        fail(subject.package, f"its code changes {changed[0]}: draw from a generator of your own, and set nothing")
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
    took, *modules = _imported_with(subject.module)
    heavy = sorted(HEAVY.intersection(modules))
    if heavy:
        fail(subject.module, f"its import also imports {', '.join(heavy)}")
    if float(took) > IMPORT_S:
        fail(subject.module, f"its import takes {float(took):.2g} s of a processor, and every command waits for it")


@lru_cache(maxsize=64)
def _imported_with(module: str) -> list[str]:
    """Return how long the import of a module takes [s of a processor], and the modules of an interpreter with it.

    What tactbench itself imports is neither counted nor heavy.
    """
    path = os.pathsep.join(part for part in sys.path if part)
    code = f"import sys, time, tactbench.plugin.devices; a = time.process_time(); import {module}; "
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", f"{code}print(time.process_time() - a, *sys.modules)"],
        env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        fail(module, f"it cannot be imported in a fresh interpreter: {done.stderr.strip().rpartition(chr(10))[2]}")
    return done.stdout.split()
