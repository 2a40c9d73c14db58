"""Real skins and real sensors, the twin with all its effects, and runs before the converter."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

from tactbench.plugin import PlanEntry, Quantity, RigContext, Scene, SensorDescriptor, SensorSpec, assumed
from tactbench.plugin.simulation import Environment, SheetTable
from tactbench.rigs.twin import tactbench_effects, tactbench_indenters
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.shell import with_core
from tactbench.rigs.twin.contact.stages import medium_of
from tactbench.rigs.twin.geometry import skin_grid
from tactbench.rigs.twin.planner import carried_out
from tactbench.rigs.twin.rig import build
from tactbench.rigs.twin.synthesis import Synthesis
from tactbench.sensors.biotac import SPEC as BIOTAC
from tactbench.sensors.icub import SPEC as ICUB

SPECS = {"biotac": BIOTAC, "icub": ICUB}
EFFECTS = tuple(tactbench_effects())
TWIN = build(RigContext(effects=EFFECTS, indenters=tuple(tactbench_indenters())))


def q(value: float, unit: str = "mm") -> Quantity:
    return assumed(value, unit, "test")


SILENT = Environment(noise_scale=0.0, drift_scale=0.0, force_noise=q(0.0, "N"))


def named(entries: Iterable[PlanEntry]) -> dict[str, PlanEntry]:
    return {entry.effect: entry for entry in entries}


def unrounded(sensor: SensorDescriptor, scene: Scene) -> Synthesis:
    """Return a scene carried out up to the converter."""
    plan = TWIN.plan(sensor, scene)
    stages = tuple(effect for effect in plan.stages if effect.name != "converter")
    return carried_out(sensor, scene, 1, dataclasses.replace(plan, stages=stages))


@pytest.fixture(scope="session")
def specs() -> dict[str, SensorSpec]:
    return SPECS


@pytest.fixture(scope="session")
def sensors() -> dict[str, SensorDescriptor]:
    return {
        name: SensorDescriptor(spec=spec, transducer=f"tactbench.sensors.{name}.transduction:build")
        for name, spec in SPECS.items()
    }


@pytest.fixture(scope="session")
def prototype() -> Callable[..., tuple[Medium, Any]]:
    """The skins that an independent implementation's published depths hold for: even film, cylinder, one penalty."""

    def make(name: str, *, core: bool = True) -> tuple[Medium, Any]:
        skin = SPECS[name].skin
        given = {"contact_stiffness": 3.6} if name == "icub" else {"mid_radius": 7.4, "clamp_stiffness": 0.5}
        change = {key: assumed(value, getattr(skin, key).unit, "test") for key, value in given.items()}
        sheet = skin.sheet.model_copy(update={"cells": (44, 48)})
        if name == "biotac":
            angle = np.arange(0.0, 90.1, 0.25)
            side = np.clip(np.radians(angle) - 0.6, 0.0, 1.0)
            film = np.maximum(1.27 * (1.0 - 0.85 * side**2), 0.25)
            change["film"] = SheetTable(
                x_mm=(0.0,), angle_deg=tuple(angle), value_mm=(tuple(film),), source=skin.film.source
            )
            edges = {"x_min": -14.5, "x_max": 5.5, "arc": math.pi * 8.2, "outer_radius": 8.2}
            edges = {key: q(value) for key, value in edges.items()}
            sheet = sheet.model_copy(update={**edges, "dome": None, "relief": None, "cells": (48, 64)})
        skin = skin.model_copy(update={**change, "sheet": sheet})
        made = medium_of(skin, skin_grid(sheet))
        if made.has_core and core:
            made = with_core(made, skin)
        return dataclasses.replace(made, contact_updates=0), skin

    return make
