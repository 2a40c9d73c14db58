"""Random hard cases, each with a written right answer: families of them, and a judge.

A family is a function that draws one case, carries it out and holds the answer against laws; its docstring is the right
answer. Judged, a case has passed, was refused with an explanation, or failed: a wrong number, one that is not finite, a
warning, a refusal where there is an answer, an answer where there is none, or an error that explains nothing.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from tactbench.plugin import Scalar, TactbenchError
from tactbench.rigs.twin.synthesis import generator

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

    def says(self, **drawn):
        """Remember what was drawn, for whoever repeats the case."""
        self.drawn.update(drawn)

    def uniform(self, low, high):
        """Draw between `low` and `high`."""
        return float(self.rng.uniform(low, high))

    def decades(self, low, high):
        """Draw between `low` and `high`, every decade alike."""
        return float(10 ** self.rng.uniform(math.log10(low), math.log10(high)))

    def one_of(self, *choices):
        """Draw one name."""
        return str(self.rng.choice(choices))

    def chance(self, share):
        """Draw whether."""
        return bool(self.rng.random() < share)

    def holds(self, law, text):
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


def judge(name, family, seed, number):
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
