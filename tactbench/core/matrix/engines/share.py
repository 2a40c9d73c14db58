"""What items of work need beforehand: loaded once by a process for those it forks, or done by one of these."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from typing import Any


@dataclass(frozen=True)
class Share:
    """One thing that may be loaded before an item is begun, so that others find it there."""

    what: Hashable
    """What it is: loaded once"""
    load: Callable[[], object]
    """Loads it into this process"""
    trusted: bool = False
    """Whether loading it does nothing to this process that is not meant; else a child tries first"""


def shares_of(work: Any, item: Any) -> list[Share]:
    """Return what `work` needs for `item` beside others: a function says it in its attribute ``shares``."""
    while isinstance(work, partial):
        work = work.func
    shares = getattr(work, "shares", None)
    return [] if shares is None else list(shares(item))
