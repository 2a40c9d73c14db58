"""Real skins and real sensors for the twin's tests."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tactbench.plugin import SensorDescriptor, SensorSpec, assumed
from tactbench.plugin.simulation import BondedLayer, SheetTable
from tactbench.rigs.twin.contact.core import with_core
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.newton import NewtonSolver
from tactbench.rigs.twin.contact.pressing import medium_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tactbench.sensors.biotac.spec import SPEC as BIOTAC
from tactbench.sensors.icub.spec import SPEC as ICUB
from tests.oracles.layers import bonded_layer

SPECS = {"biotac": BIOTAC, "icub": ICUB}

SolverOf = Callable[..., NewtonSolver]


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
def medium() -> Callable[..., Medium]:
    """The whole skin of a sensor, the core included."""

    def make(name: str, *, skin: object = None, core: bool = True) -> Medium:
        declared = skin if skin is not None else SPECS[name].skin
        made = medium_of(declared, skin_grid(declared.sheet))
        return with_core(made, declared) if made.has_core and core else made

    return make


@pytest.fixture(scope="session")
def solver(medium: Callable[..., Medium]) -> SolverOf:
    def make(name: str, radius: float, x: float, s: float = 0.0, **more: object) -> NewtonSolver:
        made = medium(name, **more)
        sheet = SPECS[name].skin.sheet
        return NewtonSolver(
            made, gap_mm(made.grid, Contact(radius, x, s), sheet.outer_radius.to("mm"), sheet.dome, sheet.relief)
        )

    return make


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
            edges = {key: assumed(value, "mm", "test") for key, value in edges.items()}
            sheet = sheet.model_copy(update={**edges, "dome": None, "relief": None, "cells": (48, 64)})
        skin = skin.model_copy(update={**change, "sheet": sheet})
        made = medium_of(skin, skin_grid(sheet))
        if made.has_core and core:
            made = with_core(made, skin)
        return dataclasses.replace(made, contact_updates=0), skin

    return make


@pytest.fixture(scope="session")
def layer() -> Callable[..., tuple[BondedLayer, NewtonSolver]]:
    """A flat bonded layer on 24 mm, pressed by a sphere of radius 10 mm in the middle."""

    def make(poisson: float, **more: float) -> tuple[BondedLayer, NewtonSolver]:
        skin = bonded_layer(poisson, **more)
        grid = skin_grid(skin.sheet)
        return skin, NewtonSolver(medium_of(skin, grid), gap_mm(grid, Contact(10.0, 0.0, 0.0)))

    return make
