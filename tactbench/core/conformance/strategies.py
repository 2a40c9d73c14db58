"""Strategies of hypothesis for what plugins are given: forces, states of a skin, scenes, questions to an estimator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st

from tactbench.core.conformance.geometry import pressed_locally, skin_grid
from tactbench.core.conformance.trial_press import tiny_scene
from tactbench.core.samples import SkinState
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.scene import Indenter, Scene
from tactbench.core.spec.sensor import SensorSpec

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray

_WHY = "drawn by a test"


def forces(largest_n: float = 20.0) -> st.SearchStrategy[float]:
    """Return forces from 0, which is among them, to `largest_n` newtons."""
    return st.one_of(st.just(0.0), st.floats(0.0, largest_n, allow_subnormal=False))


@st.composite
def skin_states(draw: st.DrawFn, spec: SensorSpec, largest_n: float = 20.0) -> SkinState:
    """Return states of a sensor's skin under a narrow press anywhere on its sheet; the sensor must declare a skin."""
    if spec.skin is None:
        raise ValueError(f"{spec.name} declares no skin: there are no states of it")
    sheet = spec.skin.sheet
    half = sheet.arc.to("mm") / 2
    at_mm = (draw(st.floats(sheet.x_min.to("mm"), sheet.x_max.to("mm"))), draw(st.floats(-half, half)))
    return pressed_locally(spec.skin, skin_grid(sheet), draw(forces(largest_n)), at_mm)


@st.composite
def scenes(draw: st.DrawFn, largest_n: float = 2.0) -> Scene:
    """Return short scenes, flat or with a cap of 5 to 30 mm, that a simulated rig carries out in tenths of a second."""
    radius = draw(st.one_of(st.none(), st.floats(5.0, 30.0)))
    indenter = Indenter() if radius is None else Indenter(radius=assumed(radius, "mm", _WHY))
    profile = tiny_scene().profile.model_copy(update={"end": assumed(draw(st.floats(0.1, largest_n)), "N", _WHY)})
    return tiny_scene(indenter=indenter, profile=profile)


@st.composite
def questions(draw: st.DrawFn, kind: str = "regression", classes: int = 3) -> tuple[FloatArray, Any]:
    """Return X (n, features) and y (n,) to teach an estimator with; of every class there is a row."""
    rows, columns = draw(st.integers(max(10, classes), 60)), draw(st.integers(1, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    X = rng.normal(size=(rows, columns))
    if kind == "classification":
        return X, np.arange(rows) % classes
    return X, X[:, 0] + 0.1 * rng.normal(size=rows)
