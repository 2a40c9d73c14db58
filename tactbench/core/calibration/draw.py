"""One draw: a value for every nuisance and, once it has been carried out, a number for every output."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from tactbench.core.samples import FloatArray
from tactbench.core.spec.calibration import CalibrationSpec, Fixed, LogUniform, Prior


@dataclass(frozen=True)
class Draw:
    """One draw that has been carried out, or could not be."""

    number: int
    seed: int
    """Of all its recordings and estimators."""
    parameters: Mapping[str, float]
    """By nuisance, in the unit of its prior."""
    outputs: Mapping[str, float]
    """By output; those read off the first draws only are missing elsewhere."""
    status: Literal["done", "failed"] = "done"
    reason: str = ""
    """Why it failed."""


Varied = Mapping[str, tuple[tuple[Draw, ...], ...]]
"""By name of a variation, the draws of each of its settings: one a seed."""


def parameters_of(spec: CalibrationSpec, seed: int, number: int) -> tuple[int, dict[str, float]]:
    """Return the recordings' seed of draw `number` and its value of every nuisance.

    Each nuisance has a stream of its own, named after it: a draw is the same alone, among any others and in any order,
    and one nuisance more or fewer leaves the other values as they are.
    """
    values = {
        nuisance.name: sample(nuisance.prior, _generator(seed, number, nuisance.stream)) for nuisance in spec.nuisances
    }
    return int(_generator(seed, number, "recordings and estimators").integers(2**31)), values


def sample(prior: Prior, rng: np.random.Generator) -> float:
    """Return one number from a prior."""
    if isinstance(prior, Fixed):
        return prior.value
    if isinstance(prior, LogUniform):
        return min(max(math.exp(rng.uniform(math.log(prior.low), math.log(prior.high))), prior.low), prior.high)
    return float(rng.uniform(prior.low, prior.high))


def parameter_values(draws: Sequence[Draw], name: str) -> FloatArray:
    """Return (n,) values of one nuisance."""
    return np.array([draw.parameters[name] for draw in draws], dtype=np.float64)


def output_values(draws: Sequence[Draw], name: str) -> FloatArray:
    """Return (n,) values of one output; NaN where a draw has none."""
    return np.array([draw.outputs.get(name, math.nan) for draw in draws], dtype=np.float64)


def finished(draws: Sequence[Draw]) -> list[Draw]:
    """Return the draws that were carried out, in order of their number."""
    return sorted((draw for draw in draws if draw.status == "done"), key=lambda draw: draw.number)


def _generator(seed: int, number: int, name: str) -> np.random.Generator:
    digest = hashlib.blake2b(name.encode(), digest_size=16).digest()
    words: npt.NDArray[np.uint32] = np.frombuffer(digest, dtype="<u4")
    return np.random.default_rng(np.random.SeedSequence([seed, number, *(int(word) for word in words)]))
