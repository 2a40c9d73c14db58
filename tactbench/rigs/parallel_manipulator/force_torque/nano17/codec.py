"""An ATI Nano17 by its six gauge voltages: the calibration file, the matrix and its marks.

``F = U (V - V_bias)``, V six gauge voltages, V_bias those of the unloaded sensor. Newer files state U ready-made
(``UserAxis``); for older ones it is rebuilt from ``Axis`` rows, their scales and the ``BasicTransform`` to the tool's
origin: ``T <- T - D x F`` (sourced: a public MATLAB script that quotes the files of a Nano17 FT8577 and a Nano43 FT9439
and builds both matrices so; it agrees with the UserAxis rows of FT8577 to the digits printed).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from tactbench.plugin import Quality
from tactbench.rigs.parallel_manipulator.force_torque.ati_xml import (
    DISTANCE_UNITS,
    FORCE_UNITS,
    TORQUE_UNITS,
    AtiFileError,
    Element,
    elements,
    unit,
)

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
GAUGES = 6


class GaugeCalibration(BaseModel):
    """What a calibration file says, in SI units."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    serial: str
    body_style: str
    part_number: str
    matrix: tuple[tuple[float, ...], ...]
    """(6 axes, 6 gauges): N/V for Fx, Fy, Fz and N*m/V for Tx, Ty, Tz."""
    largest: tuple[float, ...]
    """(6,) rated range of each axis, to both sides: N and N*m."""
    voltages: tuple[float, float]
    """Ends of a gauge's output, V."""
    rebuilt_difference: float | None
    """Largest difference of the stated matrix from the one rebuilt, in the file's own units per volt; None: the file
    has only one of them. Printed digits explain about 1e-5."""

    def wrench(self, volts: npt.ArrayLike, bias: npt.ArrayLike = 0.0) -> FloatArray:
        """Return forces and torques.

        Parameters
        ----------
        volts
            (…, 6) gauge voltages.
        bias
            (6,) voltages of the unloaded sensor.

        Returns
        -------
        (…, 6) Fx, Fy, Fz [N], Tx, Ty, Tz [N*m].
        """
        loaded = np.asarray(volts, dtype=float) - np.asarray(bias, dtype=float)
        # Not by a matrix product, whose last bit depends on how many rows it is given at once.
        wrench: FloatArray = (loaded[..., None, :] * np.array(self.matrix)).sum(axis=-1)
        return wrench

    def volts(self, wrench: npt.ArrayLike, bias: npt.ArrayLike = 0.0) -> FloatArray:
        """Return the (…, 6) gauge voltages [V] that mean `wrench` (…, 6) [N, N*m]: the inverse of `wrench`."""
        volts: FloatArray = np.linalg.solve(np.array(self.matrix), np.asarray(wrench, dtype=float)[..., None])[..., 0]
        volts += np.asarray(bias, dtype=float)
        return volts

    def quality(self, volts: npt.ArrayLike, *, step_v: float) -> npt.NDArray[np.uint8]:
        """Return the (…, 6) marks of the six axes.

        Every axis depends on every gauge: one gauge within a step of the end of its range marks all six as saturated,
        and one that is not a number marks all six as missing.

        Parameters
        ----------
        volts
            (…, 6) gauge voltages, bias included.
        step_v
            Step of the converter [V]: the highest code of a bipolar one is a step below the end.
        """
        given = np.asarray(volts, dtype=float)
        low, high = self.voltages
        # A thousandth of a step of room for the rounding of count times step.
        at_end = (given <= low + 1e-3 * step_v) | (given >= high - 1.001 * step_v)
        marks = np.where(at_end.any(axis=-1), int(Quality.SATURATED), int(Quality.GOOD))
        marks = np.where(np.isfinite(given).all(axis=-1), marks, int(Quality.MISSING))
        return np.repeat(marks[..., None], len(AXES), axis=-1).astype(np.uint8)

    def beyond_range(self, wrench: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Return (…, 6): whether an axis reads more than its rated range, where the calibration is not stated."""
        beyond: npt.NDArray[np.bool_] = np.abs(np.asarray(wrench, dtype=float)) > np.array(self.largest)
        return beyond


def read_calibration(data: bytes) -> GaugeCalibration:
    """Return what the bytes of a ``.cal`` file say.

    Raises
    ------
    AtiFileError
        If they are no calibration file of six gauges, or not safe to read (document types and entities are refused).
    """
    found = elements(data)
    sensor, calibration = _only(found, "FTSensor").attributes, _only(found, "Calibration").attributes
    if sensor.get("NumGages", "6") != str(GAUGES):
        raise AtiFileError(f"The file is for {sensor.get('NumGages')} gauges; sensors of {GAUGES} are read.")
    force_n = unit(FORCE_UNITS, _need(calibration, "ForceUnits"), "force")
    torque_nm = unit(TORQUE_UNITS, _need(calibration, "TorqueUnits"), "torque")
    si = np.array([force_n] * 3 + [torque_nm] * 3)
    stated, rebuilt = _rows(found, "UserAxis"), _rebuilt(found, calibration, force_n, torque_nm)
    if stated is None and rebuilt is None:
        raise AtiFileError("The file has neither six UserAxis rows nor six Axis rows with their transform.")
    matrix, largest = stated or rebuilt or ((), ())
    rows = np.array(matrix) * si[:, None]
    if np.linalg.matrix_rank(rows / np.abs(rows).max(axis=1, keepdims=True).clip(min=1e-300)) < len(AXES):
        raise AtiFileError("The file's matrix is singular: six gauges must tell six axes apart.")
    span = _number(calibration.get("OutputRange", "20"))
    bipolar = calibration.get("OutputBipolar", "True").strip().lower() == "true"
    return GaugeCalibration(
        serial=_need(sensor, "Serial"),
        body_style=sensor.get("BodyStyle", ""),
        part_number=calibration.get("PartNumber", ""),
        matrix=tuple(tuple(float(value) for value in row) for row in rows),
        largest=tuple(float(value) for value in np.array(largest) * si),
        voltages=(-span / 2, span / 2) if bipolar else (0.0, span),
        rebuilt_difference=None
        if stated is None or rebuilt is None
        else float(np.abs(np.array(stated[0]) - np.array(rebuilt[0])).max()),
    )


_Rows = tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]
"""Six rows of six values, and six rated ranges."""


def _rows(found: list[Element], name: str) -> _Rows | None:
    """Return the rows of six elements `name`; None: there is none."""
    rows = [element.attributes for element in found if element.name == name]
    if not rows:
        return None
    by_axis = {_need(row, "Name"): row for row in rows}
    if len(rows) != len(AXES) or set(by_axis) != set(AXES):
        raise AtiFileError(f"Six {name} rows {', '.join(AXES)} were expected, not {', '.join(by_axis)}.")
    values = tuple(tuple(_number(value) for value in _need(by_axis[axis], "values").split()) for axis in AXES)
    if {len(row) for row in values} != {GAUGES}:
        raise AtiFileError(f"Every {name} row needs {GAUGES} values.")
    return values, tuple(_number(_need(by_axis[axis], "max")) for axis in AXES)


def _rebuilt(found: list[Element], calibration: dict[str, str], force_n: float, torque_nm: float) -> _Rows | None:
    """Return the matrix from Axis rows, scales and transform, in the file's units; None: it is not to be had."""
    axes = _rows(found, "Axis")
    transforms = [element.attributes for element in found if element.name == "BasicTransform"]
    if axes is None or len(transforms) != 1:
        return None
    move = {key: _number(transforms[0].get(key, "0")) for key in ("Dx", "Dy", "Dz", "Rx", "Ry", "Rz")}
    if any(move[key] != 0.0 for key in ("Rx", "Ry", "Rz")):
        return None  # In which order the angles turn is in no source.
    scales = {e.attributes.get("Name"): _number(_need(e.attributes, "scale")) for e in found if e.name == "Axis"}
    if 0.0 in scales.values():
        raise AtiFileError("An Axis row has the scale 0.")
    matrix = np.array(axes[0]) / np.array([scales[axis] for axis in AXES])[:, None]
    # The file's torque per force, in its own units: mm with N and N-mm.
    lever = unit(DISTANCE_UNITS, calibration.get("DistUnits", "mm"), "distance") * force_n / torque_nm
    dx, dy, dz = (move[key] * lever for key in ("Dx", "Dy", "Dz"))
    cross = np.array([[0.0, -dz, dy], [dz, 0.0, -dx], [-dy, dx, 0.0]])
    matrix[3:] -= cross @ matrix[:3]
    return tuple(tuple(float(value) for value in row) for row in matrix), axes[1]


def _only(found: list[Element], name: str) -> Element:
    those = [element for element in found if element.name == name]
    if len(those) != 1:
        raise AtiFileError(f"One element {name} was expected, {len(those)} were found.", hint="Is it an ATI .cal file?")
    return those[0]


def _need(attributes: dict[str, str], name: str) -> str:
    if name not in attributes:
        raise AtiFileError(f"The attribute {name} is missing.")
    return attributes[name]


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise AtiFileError(f"A number was expected, not {text!r}.")
    return value
