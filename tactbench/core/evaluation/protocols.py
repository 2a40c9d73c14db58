"""Protocols: how recordings become features X and labels y, and on which data each step of that is fitted."""

from __future__ import annotations

import re
from typing import Literal

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.spec.quantity import Frozen


class ProtocolSpec(Frozen):
    """A protocol: steps of discarding, scaling and filtering samples, and the data on which each step is fitted."""

    name: str
    title: str
    discard_samples: int = 0
    """Samples dropped at the start of every recording."""
    discard_hold: bool = False
    """Drop the hold before the press (the set-up's initialization) if the recording's scene states one."""
    tare: bool = False
    """Subtract from readings the recording's own mean over the unloaded hold of its scene; see `sets.hold_s`."""
    three_sigma: bool = False
    """Drop a sample if a feature or the reference force is over three standard deviations from the mean of its set. The
    results are marked with a dagger, as test rows are then chosen by statistics of the test set."""
    scaled_by: Literal["each set", "training set"]
    """Data whose mean and deviation scale a set: the set itself or the training set."""
    window_over: Literal["kept samples", "consecutive samples"]
    """Samples over which the mean filter runs, never across recordings or sets."""
    roles_only: bool = False
    """True to require recordings with the roles train, validation and test, and split by these roles."""
    first_row_only: bool = False
    """Keep only the first row of every recording, to test recordings, not sensors, for leaks; for all tasks."""
    every: int = 1
    """N to keep only each N-th sample from the first, as from a sensor with an N times lower sampling rate."""
    k: int | None = None
    """Number of earlier samples that the mean filter includes; None to use the estimator's own or chosen number."""


KARL2016 = ProtocolSpec(
    name="karl2016",
    title="Karl et al. 2016, section III",
    discard_samples=600,
    three_sigma=True,
    scaled_by="each set",
    window_over="kept samples",
    roles_only=True,
)
"""Protocol of Karl et al. 2016, section III: "the first 600 samples were discarded"; "if any of the force or taxel
responses violated a three sigma rule, the sample was discarded"; "each of the training, validation and testing set was
divided by its taxel wise standard deviation after subtracting its taxel wise mean".
"""

KARL2016_TRAINING_SCALE = KARL2016.model_copy(
    update={
        "name": "karl2016-training-scale",
        "title": "Karl et al. 2016, section III, but every set scaled by the training set",
        "scaled_by": "training set",
    }
)
"""As `karl2016`, but with every set scaled by the training set, to show the effect of scaling each set by itself.
The three-sigma rule still drops test rows by the test set's own statistics."""

DEPLOYABLE = ProtocolSpec(
    name="deployable",
    title="Each recording tared on its own unloaded hold, everything fitted on training sessions",
    discard_hold=True,
    tare=True,
    scaled_by="training set",
    window_over="consecutive samples",
)
"""As in use: tare before each press, causal filters, no statistics of the test set, no row dropped by its label."""

DEPLOYABLE_UNTARED = DEPLOYABLE.model_copy(
    update={
        "name": "deployable-untared",
        "title": "Everything fitted on training sessions, readings as they are",
        "tare": False,
    }
)
"""As `deployable`, but without the tare, to show the effect of taring."""

FIRST_FRAME = ProtocolSpec(
    name="first-frame",
    title="The first row of each recording alone, everything else as deployable-untared",
    scaled_by="training set",
    window_over="consecutive samples",
    first_row_only=True,
)
"""Answers from a recording's first reading, before any contact. The hold, which includes this reading, is kept."""

PROTOCOLS = {
    protocol.name: protocol
    for protocol in (KARL2016, KARL2016_TRAINING_SCALE, DEPLOYABLE, DEPLOYABLE_UNTARED, FIRST_FRAME)
}


def is_probe(name: str) -> bool:
    """Return True if the protocol of this name is a probe for leaks, False also for an unknown name."""
    return name in PROTOCOLS and PROTOCOLS[name].first_row_only


def without_options(name: str) -> str:
    """Return the name of a protocol without its options, such as ``deployable`` for ``deployable@k=3``."""
    return name.partition("@")[0]


def protocol_called(name: str) -> ProtocolSpec:
    """Return the protocol of a name, which may end in options: ``deployable@every=4,k=3``.

    Raises
    ------
    UnknownNameError
        If there is no protocol of this name.
    UsageError
        If an option is neither ``every=N`` (N from 1) nor ``k=N`` (N from 0).
    """
    plain = without_options(name)
    if plain not in PROTOCOLS:
        raise UnknownNameError("protocol", plain, PROTOCOLS)
    if plain == name:
        return PROTOCOLS[name]
    found = re.fullmatch(r"(?:every=([1-9][0-9]{0,5}))?(?:(?:^|(?<=.),)k=([0-9]{1,6}))?", name[len(plain) + 1 :])
    if found is None or not any(found.groups()):
        raise UsageError(
            f"Protocol {name!r}: {name[len(plain) + 1 :]!r} is not an option of a protocol.",
            hint=f"Write {plain}@every=4 for every 4th sample, {plain}@k=3 for a mean over 4, {plain}@every=4,k=3.",
        )
    given = {key: int(text) for key, text in zip(("every", "k"), found.groups(), strict=True) if text}
    return PROTOCOLS[plain].model_copy(update={"name": name, **given})


def shots(split: str) -> int | None:
    """Return N, the number of training sessions, for a split named ``few-shot-N``; None for another split."""
    found = re.fullmatch(r"few-shot-([1-9][0-9]*)", split)
    return int(found[1]) if found else None
