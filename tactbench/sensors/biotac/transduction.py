"""From skin states to the BioTac's counts: film, conduction, divider; and the fluid's pressure.

It gives the 19 electrodes and PDC. TDC, TAC and PAC are not read from the skin: effects of the twin give them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from tactbench.plugin import FloatArray, RigError, SensorSpec, SkinGrid, SkinState
from tactbench.sensors.biotac.discs import discs_on, outer_radius_mm, shell_of
from tactbench.sensors.biotac.electrodes import NAMES
from tactbench.sensors.biotac.film import REFINEMENT, film_at_rest, refined, spectral_interpolation, with_tail
from tactbench.sensors.biotac.sheet import TOLERANCE, FilmSheet

NEIGHBOURS = 2
"""Potentials of the nearest loads to begin the next one with; more do not save steps."""
MOST_KEPT = 16
"""Loads whose potentials are kept: those of a table."""


class Preparation:
    """What does not depend on the load: geometry, interpolation and the factor of the film at rest."""

    def __init__(self, sensor: SensorSpec, grid: SkinGrid, refinement: int) -> None:
        self.skin = shell_of(sensor)
        self.coarse_film = film_at_rest(self.skin, grid.s_mm)[None, :]
        film_radius = sensor.parameters["film_radius"].to("mm")
        under_skin = refined(grid, refinement, shrink_s=film_radius / outer_radius_mm(sensor))
        fine, tail = with_tail(under_skin, sensor.parameters["film_tail"].to("mm"))
        self.film = np.broadcast_to(film_at_rest(self.skin, fine.s_mm), (len(fine.x_mm), len(fine.s_mm))).copy()
        # Behind the sheet the skin is not pressed: no deflection.
        self.to_fine_x = np.vstack(
            [np.zeros((tail, len(grid.x_mm))), spectral_interpolation(len(grid.x_mm), len(under_skin.x_mm))]
        )
        self.to_fine_s = np.ascontiguousarray(spectral_interpolation(len(grid.s_mm), len(fine.s_mm)).T)
        self.residual_film = self.skin.residual_film.to("mm")
        contacts, cell_mm = discs_on(sensor, fine)
        # S/m times ohm is 1/m: a length, the only electrical scale of the problem.
        conductivity = sensor.parameters["conductivity"].to("S/m")
        leak_mm = 1e3 / (conductivity * sensor.parameters["reference_resistor"].to("ohm"))
        self.sheet = FilmSheet(cell_mm, contacts, leak_mm, np.maximum(self.film, self.residual_film))
        self.rest = self.sheet.at_rest

    def film_under(self, state: SkinState) -> FloatArray:
        """Return the film on the conduction grid: h0 evaluated there exactly, the deflection interpolated."""
        deflection = self.to_fine_x @ state.deflection_mm @ self.to_fine_s
        return np.asarray(np.maximum(self.film - deflection, self.residual_film))


class BioTacTransducer:
    """Readings in counts, before noise, rounding and clipping.

    Each call begins with the potentials of the calls before, which saves a third of the steps if loads come in order.
    Its answer depends on them by no more than the solver's tolerance, 0.12 counts; the same calls in the same order
    give the same bits.
    """

    def __init__(
        self, prepared: Preparation, sensor: SensorSpec, wanted: Sequence[str], tolerance: float = TOLERANCE
    ) -> None:
        self._prepared = prepared
        self._tolerance = tolerance
        self._electrodes = [(place, NAMES.index(name)) for place, name in enumerate(wanted) if name in NAMES]
        self._pressures = [place for place, name in enumerate(wanted) if name == "PDC"]
        self._n_wanted = len(wanted)
        self._earlier: dict[float, FloatArray] = {}
        channels = {channel.name: channel for channel in sensor.channels()}
        self._full_scale = channels[NAMES[0]].upper or 0.0
        pdc = channels["PDC"]
        if pdc.scale is None or pdc.rest is None:
            raise RigError("PDC needs a scale and a rest level.", hint="Complete the sensor's channel.")
        self._pa_per_count, self._pdc_rest = pdc.scale.to("Pa/count"), pdc.rest.value

    def __call__(self, state: SkinState) -> FloatArray:
        """Return the (n_wanted,) readings under `state`.

        Raises
        ------
        RigError
            If `state` is not of the prepared grid and film, or the film cannot be solved.
        """
        readings = np.empty(self._n_wanted)
        if self._electrodes:
            self._check(state)
            nearest = sorted(self._earlier, key=lambda force: abs(force - state.force_n))[:NEIGHBOURS]
            neighbours = [self._earlier[force] for force in nearest]
            answer = self._prepared.sheet.solve(self._prepared.film_under(state), neighbours, self._tolerance)
            self._earlier[state.force_n] = answer.unknowns
            while len(self._earlier) > MOST_KEPT:
                del self._earlier[next(iter(self._earlier))]
            for place, electrode in self._electrodes:
                readings[place] = self._full_scale * answer.electrodes[electrode]
        for place in self._pressures:
            readings[place] = self._pdc_rest + 1e6 * state.fluid_pressure_mpa / self._pa_per_count
        return readings

    def _check(self, state: SkinState) -> None:
        expected = np.maximum(self._prepared.coarse_film - state.deflection_mm, self._prepared.residual_film)
        if state.thickness_mm.shape != expected.shape or not np.abs(state.thickness_mm - expected).max() <= 1e-6:
            raise RigError(
                "The skin state's film is not this sensor's film at rest less its deflection.",
                hint="Use the state of a contact solved with this sensor's skin on the grid given to build().",
            )


def build(
    sensor: SensorSpec,
    grid: SkinGrid,
    wanted: Sequence[str],
    *,
    refinement: int = REFINEMENT,
    tolerance: float = TOLERANCE,
) -> BioTacTransducer:
    """Prepare the BioTac's transduction.

    Parameters
    ----------
    sensor
        The BioTac's spec, perhaps with other parameters.
    grid
        The grid on which skin states will come.
    wanted
        Names of channels: E1 to E19 and PDC.
    refinement
        Conduction cells per skin cell and axis.
    tolerance
        Relative error, in the energy norm, at which the conduction's iteration stops.

    Raises
    ------
    RigError
        For TDC, TAC, PAC and unknown names; for a skin that is no fluid-backed shell.
    """
    for name in wanted:
        if name not in NAMES and name != "PDC":
            raise RigError(
                f"{name} of {sensor.name} is not read from the skin.",
                hint=f"Ask for {NAMES[0]} to {NAMES[-1]} and PDC.",
            )
    return BioTacTransducer(prepared(sensor, grid, refinement), sensor, tuple(wanted), tolerance)


def prepared(sensor: SensorSpec, grid: SkinGrid, refinement: int = REFINEMENT) -> Preparation:
    """Return the preparation for `sensor` and `grid`, made once and kept."""
    return _prepared(_Key(sensor, grid, refinement))


class _Key:
    """Specs hold dictionaries and grids arrays: neither can be hashed, their contents can."""

    def __init__(self, sensor: SensorSpec, grid: SkinGrid, refinement: int) -> None:
        self.sensor, self.grid, self.refinement = sensor, grid, refinement
        self._text = (sensor.model_dump_json(), grid.x_mm.tobytes(), grid.s_mm.tobytes(), refinement)

    def __hash__(self) -> int:
        return hash(self._text)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._text == other._text


@lru_cache(maxsize=8)
def _prepared(key: _Key) -> Preparation:
    return Preparation(key.sensor, key.grid, key.refinement)
