"""The options that say what is pressed on a sensor, and the scene they describe."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.spec.rig import SensorDescriptor
    from tactbench.core.spec.scene import Scene


def press_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add --cap-mm, --force-n and --seconds to a verb; they are given to `scene_of`."""
    above_0 = click.FloatRange(min=0, min_open=True)
    for option in (
        click.option("--seconds", type=above_0, metavar="T",
                     help="Duration; the ramp keeps its shape. Default 60."),
        click.option("--force-n", type=above_0, metavar="F", help="Force at the end; default 5."),
        click.option("--cap-mm", type=above_0, metavar="R",
                     help="Radius of a spherical cap; without it the indenter is flat."),
    ):  # fmt: skip
        command = option(command)
    return command


def scene_of(
    name: str, cap_mm: float | None, force_n: float | None, seconds: float | None, sensor: SensorDescriptor | None
) -> Scene:
    """Return the scene the options describe; what they leave open is that of the paper. None: no sensor is pressed."""
    from tactbench.core.spec.profile import ForceRamp
    from tactbench.core.spec.quantity import sourced
    from tactbench.core.spec.scene import Indenter, Scene

    reference = "the command line"
    ramp = ForceRamp()
    change: dict[str, Any] = {}
    if force_n is not None:
        change["end"] = sourced(force_n, "N", reference)
    if seconds is not None:
        share = seconds / ramp.duration.to("s")
        change["duration"] = sourced(seconds, "s", reference)
        change["hold"] = sourced(ramp.hold.to("s") * share, "s", f"{reference}: the same share of the duration")
        change["samples"] = max(1, round(ramp.samples * share))
    indenter = Indenter() if cap_mm is None else Indenter(radius=sourced(cap_mm, "mm", reference))
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels())) if sensor else ("taxel",)
    labels: dict[str, str | float | int] = {} if cap_mm is None else {"cap_radius_mm": cap_mm}
    observe = ("taxel",) if "taxel" in kinds else kinds
    return Scene(name=name, indenter=indenter, profile=ramp.model_copy(update=change), observe=observe, labels=labels)
