"""What a process that has cells computed and a cell server say to each other: bytes with their length before them."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tactbench.core.errors import EngineError, TactbenchError
from tactbench.core.matrix.pool.limits import Limits


@dataclass(frozen=True)
class Setting:
    """What is the same for all cells of a run."""

    session: str
    """A name for the run; a server serves one"""
    folder: str
    """Working folder that relative paths count from"""
    limits: Limits = field(default_factory=Limits)
    surroundings: Mapping[str, str] = field(default_factory=dict)
    """What the process that asks computes with; empty: the server need not agree"""
    memory: str = ""
    """File that remembers digests of sources, if there is one; nobody but the process that asks writes it"""
    threads: Mapping[str, str] = field(default_factory=dict)
    """Environment variables that hold numerical libraries at a number of threads"""


@dataclass(frozen=True)
class Request:
    """One item to be worked on."""

    work: Callable[[Any], Any]
    item: Any
    files: Mapping[str, str] = field(default_factory=dict)
    """Fingerprints of the files that the item names"""
    where: str = "This machine"
    """Who is asked, for readers"""
    company: int | None = None
    """Cells that may be at work at once on the machine that is asked, if that is known"""


@dataclass(frozen=True)
class Reply:
    """What became of an item: a result, or the exception that stopped it."""

    result: Any = None
    error: BaseException | None = None
    traceback_text: str = ""
    """Where the exception was raised, which pickle does not keep"""

    @property
    def outcome(self) -> Any:
        """The one or the other, as engines yield it."""
        return self.result if self.error is None else self.error


def pack(message: Any) -> bytes:
    """Return a message as bytes; pickle, since both ends are processes of one run."""
    return pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)


def pack_reply(outcome: Any) -> bytes:
    """Return the reply that carries `outcome`, or what can be said of it where it does not let itself be sent."""
    if isinstance(outcome, BaseException):
        reply = Reply(error=outcome, traceback_text=getattr(outcome, "traceback_text", ""))
    else:
        reply = Reply(result=outcome)
    try:
        return pack(reply)
    except Exception as error:
        what = f"{type(outcome).__name__}: {outcome}" if isinstance(outcome, BaseException) else type(outcome).__name__
        return pack(Reply(error=EngineError(f"{what} cannot be sent to another process: {error}.")))


def unpack_reply(content: bytes) -> Reply:
    """Return the reply that `content` carries, or one that says that it cannot be read here."""
    try:
        reply = pickle.loads(content)
    except Exception as error:
        return Reply(error=EngineError(f"What the cell answered cannot be read here: {error}."))
    if not isinstance(reply, Reply):
        return Reply(error=EngineError(f"A {type(reply).__name__} came in place of a reply."))
    if isinstance(reply.error, TactbenchError):
        reply.error.traceback_text = reply.traceback_text
    return reply
