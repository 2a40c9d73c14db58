"""Making the recordings that are missing."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from functools import lru_cache

from tactbench.core.errors import UnwritableError
from tactbench.core.matrix.engines.choice import EngineChoice
from tactbench.core.matrix.explanation import Book
from tactbench.core.matrix.installed import built
from tactbench.core.matrix.material import Order, need_of
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.planning import Material
from tactbench.core.matrix.progress import Progress
from tactbench.core.plugins.interfaces import Rig
from tactbench.core.plugins.registry import installed

GRACE_S = 5.0
"""Seconds that a real rig has to stand still and let go of its devices when its time is up."""


def acquire_missing(
    material: Material,
    cells: Sequence[Cell],
    book: Book,
    choice: EngineChoice,
    told: Progress,
    meanwhile: Callable[[], None] | None = None,
) -> None:
    """Make the recordings that `cells` lack, and note in `material` which were made and what went wrong.

    Simulations do not disturb each other and are not timed by the wall: they use all cores. A real rig does one scene
    at a time, and is asked to end before it is ended. A scene that its process does not survive costs its recording.

    Parameters
    ----------
    meanwhile
        Done here while others are busy.

    Raises
    ------
    UnwritableError
        If the disk refuses them.
    """
    needs = dict.fromkeys(map(need_of, cells))
    unique = {order.path: order for need in needs for order in material.orders.get(need, ())}
    missing = [order for path, order in unique.items() if not path.exists()]
    if not missing:
        return
    book.note_recordings(missing)
    from tactbench.core.recording.format import partial_path

    simulated = all(installed().rigs[order.rig].simulated for order in missing)
    hands = min(max(choice.jobs, os.cpu_count() or 1), len(missing)) if simulated else 1
    told.begin("recording", len(missing), alone=False)
    pool = choice.pool(hands, grace_s=0.0 if simulated else GRACE_S)
    try:
        outcomes = pool.each(record, missing, meanwhile)
        for order, outcome in outcomes:
            if isinstance(outcome, UnwritableError):
                raise outcome  # the disk is no cell's fault, and refuses the next one too
            if isinstance(outcome, BaseException):
                material.refused[order.path] = outcome
                partial_path(order.path).unlink(missing_ok=True)
            else:
                material.recorded.made(order.path, outcome)
            told.advance(f"{order.sensor} {order.scene.name}", stopped=isinstance(outcome, BaseException))
    except BaseException:
        # Workers that were ended in the middle could not tidy up behind themselves.
        for order in missing:
            partial_path(order.path).unlink(missing_ok=True)
        raise


@lru_cache(maxsize=4)
def _rig(name: str) -> Rig:
    return built(name, installed())  # type: ignore[return-value]


def record(order: Order) -> str:
    """Make one recording and return its content digest. Raises whatever the rig raises."""
    from tactbench.core.acquisition import acquire

    registry = installed()
    rig = registry.rigs[order.rig]
    made = acquire(
        _rig(order.rig),
        registry.sensors[order.sensor],
        rig,
        order.scene,
        role=order.role,
        seed=order.seed,
        path=order.path,
        # Simulations run side by side: what they cost is the processor's time. A real rig is waited for.
        clock=time.process_time if rig.simulated else time.perf_counter,
        provenance={},
    )
    return made.content_digest
