"""ATI's files: units, and the calibration file (``.cal``) of a sensor that is read by its six gauge voltages.

``F = U (V - V_bias)``, V six gauge voltages, V_bias those of the unloaded sensor. Newer files state U ready-made
(``UserAxis``); for older ones it is rebuilt from ``Axis`` rows, their scales and the ``BasicTransform`` to the tool's
origin: ``T <- T - D x F`` (sourced: a public MATLAB script that quotes the files of a Nano17 FT8577 and a Nano43 FT9439
and builds both matrices so; it agrees with the UserAxis rows of FT8577 to the digits printed).
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, ParseError, fromstring

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from tactbench.plugin import UsageError

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

_POUND_N = 4.4482216152605
"""One pound-force: 0.45359237 kg by 9.80665 m/s^2 (sourced: international yard and pound agreement 1959, CGPM 1901)."""
_INCH_M = 0.0254
_KGF_N = 9.80665

FORCE_UNITS = {
    "N": 1.0,
    "kN": 1e3,
    "lb": _POUND_N,
    "lbf": _POUND_N,
    "klb": 1e3 * _POUND_N,
    "klbf": 1e3 * _POUND_N,
    "kg": _KGF_N,
    "kgf": _KGF_N,
    "g": 1e-3 * _KGF_N,
    "gf": 1e-3 * _KGF_N,
}
"""Name -> newtons (names sourced: ATI manual 9620-05-NET FT, table 7.3, as quoted in public clients; those without the
final f assumed)."""
TORQUE_UNITS = {
    "Nm": 1.0,
    "Nmm": 1e-3,
    "kNm": 1e3,
    "lbin": _POUND_N * _INCH_M,
    "lbfin": _POUND_N * _INCH_M,
    "lbft": _POUND_N * 12 * _INCH_M,
    "lbfft": _POUND_N * 12 * _INCH_M,
    "kgcm": _KGF_N * 1e-2,
    "kgfcm": _KGF_N * 1e-2,
}
"""Name without hyphens -> newton metres (sourced and assumed as above)."""
DISTANCE_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": _INCH_M, "ft": 12 * _INCH_M}
"""Name -> metres (sourced as above)."""


class AtiFileError(UsageError):
    """A file is not the ATI file that was expected."""


def elements(data: bytes) -> list[Element]:
    """Return the elements of an XML file in the order of their start tags; raises AtiFileError if `data` is no XML."""
    try:
        return list(fromstring(data).iter())
    except (ParseError, LookupError, ValueError) as error:  # the last two: encodings that Python lacks
        raise AtiFileError(f"This is not an XML file: {error}.") from error


def unit(table: dict[str, float], name: str, what: str) -> float:
    """Return the SI value of a unit as ATI spells it; raises AtiFileError for one that is not in `table`."""
    plain = name.strip()
    for spelling in (plain, plain.replace("-", "").replace(".", "")):
        if spelling in table:
            return table[spelling]
    raise AtiFileError(f"The {what} unit {name!r} is not known; known: {', '.join(table)}.")


AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
GAUGES = 6


class GaugeCalibration(BaseModel):
    """What a calibration file says, in SI units."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

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


def read_calibration(data: bytes) -> GaugeCalibration:
    """Return what the bytes of a ``.cal`` file say.

    Raises
    ------
    AtiFileError
        If they are no calibration file of six gauges.
    """
    found = elements(data)
    try:
        return _calibration(found)
    except KeyError as error:
        raise AtiFileError(f"The file has no {error.args[0]}.", hint="Is it an ATI .cal file?") from error
    except ValueError as error:  # of a number, a shape, or pydantic's
        raise AtiFileError(f"The file is no calibration of six gauges: {error}.") from error


def _calibration(found: list[Element]) -> GaugeCalibration:
    sensor, calibration = (_one(found, name) for name in ("FTSensor", "Calibration"))
    if sensor.get("NumGages", "6") != str(GAUGES):
        raise ValueError(f"it is for {sensor['NumGages']} gauges")
    force_n = unit(FORCE_UNITS, calibration["ForceUnits"], "force")
    torque_nm = unit(TORQUE_UNITS, calibration["TorqueUnits"], "torque")
    si = np.array([force_n] * 3 + [torque_nm] * 3)
    stated = _rows(found, "UserAxis")
    # The file's torque per force, in its own units: mm with N and N-mm.
    lever = unit(DISTANCE_UNITS, calibration.get("DistUnits", "mm"), "distance") * force_n / torque_nm
    rebuilt = _rebuilt(found, lever)
    either = stated or rebuilt
    if either is None:
        raise ValueError("it has neither six UserAxis rows nor six Axis rows with their transform")
    matrix, largest = either
    rows = matrix * si[:, None]
    if np.linalg.matrix_rank(rows / np.abs(rows).max(axis=1, keepdims=True).clip(min=1e-300)) < len(AXES):
        raise ValueError("its matrix is singular")
    span = float(calibration.get("OutputRange", "20"))
    bipolar = calibration.get("OutputBipolar", "True").strip().lower() == "true"
    return GaugeCalibration(
        serial=sensor["Serial"],
        body_style=sensor.get("BodyStyle", ""),
        part_number=calibration.get("PartNumber", ""),
        matrix=tuple(map(tuple, rows.tolist())),
        largest=tuple((largest * si).tolist()),
        voltages=(-span / 2, span / 2) if bipolar else (0.0, span),
        rebuilt_difference=None if stated is None or rebuilt is None else float(np.abs(stated[0] - rebuilt[0]).max()),
    )


def _one(found: list[Element], name: str) -> dict[str, str]:
    """Return the attributes of the one element of a name."""
    those = [element.attrib for element in found if element.tag == name]
    if len(those) != 1:
        raise KeyError(f"element {name}, or several")
    return those[0]


def _rows(found: list[Element], name: str) -> tuple[FloatArray, FloatArray] | None:
    """Return the (6, 6) values and (6,) ranges of the six elements of a name; None: there is none."""
    by_axis = {element.attrib["Name"]: element.attrib for element in found if element.tag == name}
    if not by_axis:
        return None
    values = [[float(value) for value in by_axis[axis]["values"].split()] for axis in AXES]
    if {len(row) for row in values} != {GAUGES} or not np.isfinite(values).all():
        raise ValueError(f"each {name} row needs {GAUGES} numbers")
    return np.array(values), np.array([float(by_axis[axis]["max"]) for axis in AXES])


def _rebuilt(found: list[Element], lever: float) -> tuple[FloatArray, FloatArray] | None:
    """Return the matrix from Axis rows, scales and transform, in the file's units; None: it is not to be had."""
    axes = _rows(found, "Axis")
    transforms = [element.attrib for element in found if element.tag == "BasicTransform"]
    if axes is None or len(transforms) != 1:
        return None
    move = {key: float(transforms[0].get(key, "0")) for key in ("Dx", "Dy", "Dz", "Rx", "Ry", "Rz")}
    if any(move[key] != 0.0 for key in ("Rx", "Ry", "Rz")):
        return None  # In which order the angles turn is in no source.
    scales = {element.attrib["Name"]: float(element.attrib["scale"]) for element in found if element.tag == "Axis"}
    if 0.0 in scales.values():
        raise ValueError("an Axis row has the scale 0")
    matrix = axes[0] / np.array([scales[axis] for axis in AXES])[:, None]
    dx, dy, dz = (move[key] * lever for key in ("Dx", "Dy", "Dz"))
    matrix[3:] -= np.array([[0.0, -dz, dy], [dz, 0.0, -dx], [-dy, dx, 0.0]]) @ matrix[:3]
    return matrix, axes[1]
