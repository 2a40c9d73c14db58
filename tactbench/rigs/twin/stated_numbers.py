"""The numbers of a scene, looked at before anything is made of them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pydantic import BaseModel

from tactbench.plugin import Quantity, RigError, Scene

MOST_SAMPLES = 20_000_000
"""Samples of a stream that are still made: two and a half hours at 2200 Hz, 160 MB a channel and effect."""
_NOT_BELOW_ZERO = ("scatter", "start", "end", "hold", "duration", "since_power_on", "force_noise")
"""Fields of a scene's parts for which less than zero means nothing."""
_LOOP = ("proportional", "integral", "delay", "motor_lag", "resolution")
"""Those of a force loop."""
_ABOVE_ZERO = ("force_filter", "cutoff", "rate", "speed", "acceleration")
"""Fields that divide, or without which nothing moves."""


def check_numbers(scene: Scene) -> None:
    """Refuse a scene in which a number is none, infinite, or below zero where there is no such thing.

    A radius may be infinite: that is a flat surface.

    Raises
    ------
    RigError
        Naming the field.
    """
    samples = scene.profile.samples
    if samples > MOST_SAMPLES:
        raise RigError(
            f"Scene {scene.name!r} asks for {samples} samples; up to {MOST_SAMPLES} fit into memory.",
            hint="Record in parts.",
        )
    for name, value, text in _numbers(scene, ()):
        positive = name[-1] in _ABOVE_ZERO
        signed = not positive and name[-1] not in (*_NOT_BELOW_ZERO, *_LOOP)
        flat = name[-1] == "radius" and value == math.inf
        if not (math.isfinite(value) or flat) or (value < 0 and not signed) or (value == 0 and positive):
            raise RigError(
                f"The {' '.join(name).replace('_', ' ')} of scene {scene.name!r} is {text}.",
                hint="Give a finite number" + ("." if signed else ", above zero." if positive else ", not below zero."),
            )


def _numbers(model: BaseModel, above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], float, str]]:
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Quantity):
            yield (*above, name), value.value, str(value)
        elif isinstance(value, float):
            yield (*above, name), value, f"{value:g}"
        elif isinstance(value, BaseModel):
            yield from _numbers(value, (*above, name))
