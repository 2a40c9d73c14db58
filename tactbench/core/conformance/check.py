"""What a check is, and what can come of one."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal, NamedTuple, NoReturn

from tactbench.core.errors import TactbenchError

Kind = Literal["sensor", "rig", "device", "task", "estimator", "effect", "indenter", "profile"]
KINDS: tuple[Kind, ...] = ("sensor", "rig", "device", "task", "estimator", "effect", "indenter", "profile")
Mode = Literal["passive", "invasive", "recording"]
"""`passive`: nothing is opened and nothing moves. `invasive`: a line is opened, something is pressed. `recording`: only
a recording is read."""
Level = Literal["bronze", "silver", "gold"]
LEVELS: tuple[Level, ...] = ("bronze", "silver", "gold")


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


@dataclass(frozen=True)
class Check:
    """One thing that is checked of a plugin."""

    name: str
    """Lower case with hyphens; unique among the checks of a kind."""
    kinds: tuple[Kind, ...]
    mode: Mode
    level: Level
    """The lowest level that cannot be had without it."""
    why: str
    """Why it exists, in one sentence."""
    cure: str
    """What to do when it fails, in one sentence."""
    needs: tuple[str, ...]
    """Checks that must have passed; otherwise it is skipped, with their reason."""
    may_skip: bool
    """Whether it is about an ability that a plugin need not have."""
    run: Callable[[Any], None]
    """Called with a Subject; raises CheckFailed, or CheckSkipped."""

    def __str__(self) -> str:
        return self.name


def check(
    *kinds: Kind,
    needs: tuple[str, ...] = (),
    level: Level = "bronze",
    mode: Mode = "passive",
    may_skip: bool = False,
) -> Callable[[Callable[[Any], None]], Check]:
    """Make a check of a function: its name is the check's, its docstring says why it exists, and then what to do."""

    def made(run: Callable[[Any], None]) -> Check:
        why, _, cure = inspect.cleandoc(run.__doc__ or "").partition("\n\n")
        name = run.__name__.strip("_").replace("_", "-")
        why, cure = (" ".join(text.split()) for text in (why, cure))
        return Check(name, kinds, mode, level, why, cure, needs, may_skip or bool(needs), run)

    return made


def fail(where: str, text: str) -> NoReturn:
    """Raise CheckFailed."""
    raise CheckFailed(where, text)


def skip(text: str) -> NoReturn:
    """Raise CheckSkipped."""
    raise CheckSkipped(text)


class CheckOutcome(NamedTuple):
    """What came of a check."""

    check: str
    status: Literal["passed", "failed", "skipped", "expected"]
    """`expected`: it failed, and is listed among the expected failures."""
    where: str = ""
    """The field or line at fault."""
    text: str = ""
    """What is wrong, or why it was skipped; of an expected failure, the reason that is listed."""


@contextmanager
def code_of(where: str, package: str) -> Iterator[None]:
    """Turn whatever the plugin's own code raises into a failure that names its line.

    Parameters
    ----------
    where
        The field that names the code.
    package
        The plugin's own.
    """
    try:
        yield
    except (CheckFailed, CheckSkipped):
        raise
    except (Exception, SystemExit) as error:
        line = line_in(package, error.__traceback__)
        text = str(error) if isinstance(error, TactbenchError) else f"{type(error).__name__}: {error}"
        raise CheckFailed(f"{where}{f' ({line})' if line else ''}", text.rstrip(": ")) from error


def line_in(package: str, trace: TracebackType | None) -> str:
    """Return ``file, line N`` of the innermost frame in a package; "" if none is in it."""
    found = ""
    while trace is not None:
        name = trace.tb_frame.f_globals.get("__name__", "")
        if name.partition(".")[0] == package:
            file = trace.tb_frame.f_code.co_filename.replace("\\", "/").split("/")
            found = f"{'/'.join(file[-2:])}, line {trace.tb_lineno}"
        trace = trace.tb_next
    return found
