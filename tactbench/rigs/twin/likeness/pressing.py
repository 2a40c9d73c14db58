"""Static presses without noise: a sensor's skin and transducer under one gap at a few forces."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tactbench.plugin import FloatArray, NotApplicable, SensorDescriptor, load_object
from tactbench.plugin.simulation import FluidBackedShell
from tactbench.rigs.twin.contact.core import with_core
from tactbench.rigs.twin.contact.media import Medium
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.skins import medium_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, outer_radius_mm, skin_grid


class Bench:
    """One sensor, ready to be pressed.

    Parameters
    ----------
    sensor
        With a skin and a transducer.
    """

    def __init__(self, sensor: SensorDescriptor) -> None:
        skin = sensor.spec.skin
        if skin is None or sensor.transducer is None:
            raise NotApplicable(f"{sensor.name} declares no skin and transducer: the twin cannot press it")
        self._skin, self.sheet = skin, skin.sheet
        self.grid = skin_grid(skin.sheet)
        self._outer = outer_radius_mm(skin.sheet)
        taxels = [channel.name for channel in sensor.spec.channels("taxel")]
        pressure = [channel.name for channel in sensor.spec.channels("dc_pressure")]
        self._taxels = len(taxels)
        self._read = load_object(sensor.transducer)(sensor.spec, self.grid, [*taxels, *pressure])

    def press(self, gap: FloatArray, forces_n: Sequence[float]) -> tuple[FloatArray, FloatArray]:
        """Return the (m, taxels) changes from rest and the (m,) pressure above rest at ascending forces.

        The pressure is not a number for a sensor without such a channel.
        """
        skin, core = self._skin, None
        if isinstance(skin, FluidBackedShell):

            def core(medium: Medium) -> Medium:
                return with_core(medium, skin)

        press = Press(medium_of(skin, self.grid), gap, Contact(math.inf, 0.0, 0.0), core=core)
        rest = np.asarray(self._read(press(0.0)))
        change = np.stack([np.asarray(self._read(press(force))) - rest for force in forces_n])
        taxels = change[:, : self._taxels]
        pressure = change[:, self._taxels] if change.shape[1] > self._taxels else np.full(len(change), np.nan)
        return taxels, pressure

    def press_cap(
        self, radius_mm: float, x_mm: float, s_mm: float, forces_n: Sequence[float]
    ) -> tuple[FloatArray, FloatArray]:
        """Return the same for a cap, or a flat surface of infinite radius, at a place of the sheet."""
        return self.press(
            gap_mm(self.grid, Contact(radius_mm, x_mm, s_mm), self._outer, self.sheet.dome, self.sheet.relief), forces_n
        )
