"""Protocols as data: how recordings become X and y, and on which data each step is fitted; names of few-shot splits."""

from __future__ import annotations

import re
from typing import Literal

from pydantic import Field

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.spec.quantity import Frozen


class ProtocolSpec(Frozen):
    """The steps of discarding, scaling and filtering, and the data on which each is fitted."""

    name: str
    title: str
    discard_samples: int = Field(default=0, ge=0)
    """Samples dropped at the start of every recording."""
    discard_hold: bool = False
    """Drop the scene's stated hold (the set-up's initialization, before any load) where a recording has a scene."""
    tare: bool = False
    """Subtract from each recording its own mean over the unloaded hold that its scene states; see `sets.hold_s`."""
    three_sigma: bool = False
    """Drop a sample if a feature or the reference force lies beyond three standard deviations of its set."""
    scaled_by: Literal["each set", "training set"]
    """Whose mean and deviation scale a set."""
    window_over: Literal["kept samples", "consecutive samples"]
    """Samples that the mean filter runs over; never across recordings or parts."""
    roles_only: bool = False
    """Only recordings with the roles train, validation and test can be used."""
    uses_test_statistics: bool = False
    """Rows carry a dagger."""
    first_row_only: bool = False
    """Keep the first row of every recording and nothing else; see `splits`."""
    every: int = Field(default=1, ge=1)
    """Every such sample is looked at, from the first: those of a sensor so many times slower."""
    k: int | None = Field(default=None, ge=0)
    """Samples that the mean filter looks back; None: as many as the estimator states or chooses."""
    probe: bool = False
    """It asks for leaks of recordings, not for a sensor's skill, and is allowed for every task, listed or not."""


KARL2016 = ProtocolSpec(
    name="karl2016",
    title="Karl et al. 2016, section III",
    discard_samples=600,
    three_sigma=True,
    scaled_by="each set",
    window_over="kept samples",
    roles_only=True,
    uses_test_statistics=True,
)
"""The paper's protocol: "the first 600 samples were discarded"; "if any of the force or taxel responses violated a
three sigma rule, the sample was discarded"; "each of the training, validation and testing set was divided by its
taxel wise standard deviation after subtracting its taxel wise mean".
"""

KARL2016_TRAINING_SCALE = KARL2016.model_copy(
    update={
        "name": "karl2016-training-scale",
        "title": "Karl et al. 2016, section III, but every set scaled by the training set",
        "scaled_by": "training set",
    }
)
"""The paper's protocol in everything but one: beside it, it shows the worth of scaling each set by itself. The
three-sigma rule still drops test rows by the test set's own statistics."""

DEPLOYABLE = ProtocolSpec(
    name="deployable",
    title="Each recording tared on its own unloaded hold, everything fitted on training sessions",
    discard_hold=True,
    tare=True,
    scaled_by="training set",
    window_over="consecutive samples",
)
"""As a sensor in use: tared before a press, no statistic of the test set, causal windows, no row dropped by label."""

DEPLOYABLE_UNTARED = DEPLOYABLE.model_copy(
    update={
        "name": "deployable-untared",
        "title": "Everything fitted on training sessions, readings as they are",
        "tare": False,
    }
)
"""The same without the tare: beside it, it shows the worth of taring."""

FIRST_FRAME = ProtocolSpec(
    name="first-frame",
    title="The first row of each recording alone, everything else as deployable-untared",
    scaled_by="training set",
    window_over="consecutive samples",
    first_row_only=True,
    probe=True,
)
"""The answer from the reading before anything happened. The hold is not dropped, since the first row lies in it."""

PROTOCOLS = {
    protocol.name: protocol
    for protocol in (KARL2016, KARL2016_TRAINING_SCALE, DEPLOYABLE, DEPLOYABLE_UNTARED, FIRST_FRAME)
}


def is_probe(name: str) -> bool:
    """Return whether a protocol is a probe for leaks; an unknown name is none."""
    return name in PROTOCOLS and PROTOCOLS[name].probe


def without_options(name: str) -> str:
    """Return the name of a protocol without its options (``@…``)."""
    return name.partition("@")[0]


def protocol_called(name: str) -> ProtocolSpec:
    """Return a protocol by name, which may end in options: ``deployable@every=4,k=3``.

    Raises
    ------
    UnknownNameError
        If there is none of this name.
    UsageError
        If an option is none of ``every=N`` (from 1) and ``k=N`` (from 0).
    """
    plain = without_options(name)
    if plain not in PROTOCOLS:
        raise UnknownNameError("protocol", plain, PROTOCOLS)
    if plain == name:
        return PROTOCOLS[name]
    found = re.fullmatch(r"(?:every=([1-9][0-9]{0,5}))?(?:(?:^|(?<=.),)k=([0-9]{1,6}))?", name[len(plain) + 1 :])
    if found is None or not any(found.groups()):
        raise UsageError(
            f"Protocol {name!r}: {name[len(plain) + 1 :]!r} is no option of a protocol.",
            hint=f"Write {plain}@every=4 for every 4th sample, {plain}@k=3 for a mean over 4, {plain}@every=4,k=3.",
        )
    given = {key: int(text) for key, text in zip(("every", "k"), found.groups(), strict=True) if text}
    return PROTOCOLS[plain].model_copy(update={"name": name, **given})


def shots(split: str) -> int | None:
    """Return how many training sessions a split named `few-shot-N` has; None if it is another."""
    found = re.fullmatch(r"few-shot-([1-9][0-9]*)", split)
    return int(found[1]) if found else None
