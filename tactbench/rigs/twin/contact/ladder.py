"""Choice of the cheapest contact solver that keeps a scene's tolerance."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.contact.pressing import pressed, slide_of
from tactbench.rigs.twin.fidelity import FINE, RUNGS
from tactbench.rigs.twin.synthesis import Synthesis

TABLE_SHARE = 1 / 3
"""Share of a tolerance that the load table may use; the contact solver may use the rest."""
_PROBES = (0.3, 1.0)
"""Shares of the largest load at which a contact solver is compared with the next more accurate one."""
_CHOSEN: dict[str, tuple[str, float]] = {}


def choose_rung(run: Synthesis, names: list[str], largest_n: float) -> None:
    """Give `run` the cheapest contact solver that keeps the scene's tolerance, and the estimate of the solver's error.

    The error is the solver's largest difference to the next more accurate one, over two loads and all channels. The
    last solver's error is at most its difference to the one before: halving the cells at least halves the error.

    Raises
    ------
    RigError
        If no contact solver keeps the tolerance; the message states the smallest error reached.
    """
    tolerance = run.scene.simulation.tolerance
    if tolerance is None:
        return
    # The place of a recording's contact scatters by a tenth of a millimetre: that changes no rung's error much.
    spec, body = run.sensor.model_dump_json(), (run.contact.radius_mm, run.contact.shape)
    key = f"{spec}|{body}|{largest_n}|{names}|{sorted(run.lent)}|{tolerance}|{slide_of(run)}"
    if key not in _CHOSEN:
        _CHOSEN[key] = _cheapest(run, names, largest_n, tolerance)
    run.rung, run.rung_error = _CHOSEN[key]
    run.fidelity = dataclasses.replace(RUNGS[run.rung], most_nodes=FINE.most_nodes)


def _cheapest(run: Synthesis, names: list[str], largest_n: float, tolerance: float) -> tuple[str, float]:
    error, own = float("inf"), _probed(run, names, largest_n, next(iter(RUNGS)))
    for low, high in itertools.pairwise(RUNGS):
        coarser, own = own, _probed(run, names, largest_n, high)
        if coarser is None or own is None:
            continue
        error = float(np.max(np.abs(coarser - own)))
        if error <= (1 - TABLE_SHARE) * tolerance:
            return low, error
    last = list(RUNGS)[-1]
    if error <= 2 * (1 - TABLE_SHARE) * tolerance:
        return last, error / 2
    raise RigError(
        f"No contact solver keeps the scene's tolerance {tolerance:g}: the finest is off by {error / 2:.2g}.",
        hint="Give a larger tolerance, or a sensor spec with more cells.",
    )


def _probed(run: Synthesis, names: list[str], largest_n: float, name: str) -> FloatArray | None:
    """Return the readings' changes from rest at the compared loads; for an observed slide, those in full slip, too.

    None if the contact solver `name` does not support this skin.
    """
    try:
        press, read = pressed(run, names, RUNGS[name])
    except RigError:
        return None
    states = [press(share * largest_n) for share in _PROBES]
    slide = slide_of(run)
    if names and slide is not None:
        from tactbench.rigs.twin.contact.slide_table import dragged_state
        from tactbench.rigs.twin.contact.tangential import tangential_of

        along, (direction, friction) = tangential_of(run.skin, press.medium.grid), slide
        states += [dragged_state(state, state, along, direction, friction, 0.0) for state in states]
    rest = read(press(0.0))
    return np.stack([read(state) - rest for state in states])
