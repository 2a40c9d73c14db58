"""Random hard cases, each with a written right answer: families of them, a judge, and checks made of both.

A family is a function that draws one case, carries it out and holds the answer against laws; its docstring is the right
answer. Judged, a case has passed, was refused with an explanation, or failed: a wrong number, one that is not finite, a
warning, a refusal where there is an answer, an answer where there is none, or an error that explains nothing.
"""

from __future__ import annotations

import inspect
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np

from tactbench.plugin import Check, Scalar, TactbenchError, Verdict
from tactbench.rigs.twin.draws import generator

Right = Literal["answer", "refusal", "either"]
"""What is right: an answer that keeps the laws, an explained refusal, or whichever of both it turns out to be."""


class WrongError(Exception):
    """An answer that breaks a law."""


@dataclass
class Case:
    """One case in the making: where its numbers come from, and what was drawn."""

    rng: np.random.Generator
    right: Right = "answer"
    drawn: dict[str, Scalar] = field(default_factory=dict)

    def says(self, **drawn: Scalar) -> None:
        """Remember what was drawn, for whoever repeats the case."""
        self.drawn.update(drawn)

    def uniform(self, low: float, high: float) -> float:
        """Draw between `low` and `high`."""
        return float(self.rng.uniform(low, high))

    def decades(self, low: float, high: float) -> float:
        """Draw between `low` and `high`, every decade alike."""
        return float(10 ** self.rng.uniform(math.log10(low), math.log10(high)))

    def one_of(self, *choices: str) -> str:
        """Draw one name."""
        return str(self.rng.choice(choices))

    def chance(self, share: float) -> bool:
        """Draw whether."""
        return bool(self.rng.random() < share)

    def holds(self, law: object, text: str) -> None:
        """Raise WrongError unless `law` is true."""
        if not law:
            raise WrongError(text)


Family = Callable[[Case], None]


@dataclass(frozen=True)
class Outcome:
    """What became of one case."""

    verdict: Literal["passed", "refused", "failed"]
    detail: str
    drawn: dict[str, Scalar]


def families() -> dict[str, Family]:
    """Return every family of the twin by its name, ``group: what is hard``."""
    from tactbench.rigs.twin.verification import hard_channels, hard_contact, hard_memory, hard_skins

    groups = {
        "contact": (*hard_contact.FAMILIES, *hard_skins.FAMILIES),
        "memory": hard_memory.FAMILIES,
        "channels": hard_channels.FAMILIES,
    }
    return {f"{group}: {one.__name__.replace('_', ' ')}": one for group, some in groups.items() for one in some}


def judge(name: str, family: Family, seed: int, number: int) -> Outcome:
    """Draw case `number` of a family and judge it; the same arguments give the same case on any machine."""
    case = Case(generator(seed, "hard case", name, str(number)))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            family(case)
    except TactbenchError as error:
        said = f"{type(error).__name__}: {error}"
        if not (error.message.strip() and error.hint.strip()):
            return Outcome("failed", f"refused without an explanation: {said}", case.drawn)
        if case.right == "answer":
            return Outcome("failed", f"refused although there is an answer: {said}", case.drawn)
        return Outcome("refused", said, case.drawn)
    except WrongError as error:
        return Outcome("failed", str(error), case.drawn)
    except Exception as error:  # a judge reports whatever comes
        return Outcome("failed", f"{type(error).__name__}: {error}", case.drawn)
    if case.right == "refusal":
        return Outcome("failed", "answered although there is no answer", case.drawn)
    return Outcome("passed", "", case.drawn)


def checks(cases: int = 60, seed: int = 1) -> list[Check]:
    """Return one check a family, `cases` spread over all of them (at least one each)."""
    found = families()
    each = max(1, round(cases / len(found)))
    return [
        Check(
            name=f"hard {name.replace(': ', ' ')}",
            group=name.split(":")[0],
            title=(inspect.getdoc(family) or name).splitlines()[0],
            run=partial(_verdicts, name, family, each, seed),
        )
        for name, family in found.items()
    ]


def _verdicts(name: str, family: Family, cases: int, seed: int) -> Sequence[Verdict]:
    outcomes = [judge(name, family, seed, number) for number in range(cases)]
    failed = [(number, one) for number, one in enumerate(outcomes) if one.verdict == "failed"]
    note = f"case {failed[0][0]} with seed {seed}: {failed[0][1].detail}" if failed else ""
    refused = sum(one.verdict == "refused" for one in outcomes)
    return [
        Verdict(
            name=f"failed of {cases} cases",
            found=float(len(failed)),
            low=0.0,
            high=0.0,
            source=f"the laws in the family's description; {refused} refused with an explanation",
            note=note,
        )
    ]
