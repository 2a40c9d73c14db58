"""The calibration file (``.cal``) of an ATI sensor that is read by its six gauge voltages.

``F = U (V - V_bias)``, V six gauge voltages, V_bias those of the unloaded sensor, U the ``UserAxis`` rows (sourced: a
public MATLAB script that quotes the file of a Nano17 FT8577).
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree.ElementTree import ParseError, fromstring

import numpy as np

from tactbench.plugin import UsageError

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

_POUND_N = 4.4482216152605
"""One pound-force: 0.45359237 kg by 9.80665 m/s^2 (sourced: international yard and pound agreement 1959, CGPM 1901)."""
UNITS = {"N": 1.0, "lb": _POUND_N, "lbf": _POUND_N, "N-m": 1.0, "N-mm": 1e-3, "lb-in": _POUND_N * 0.0254,
         "lbf-in": _POUND_N * 0.0254}  # fmt: skip
"""Newtons or newton metres by ATI's name (names sourced: ATI manual 9620-05-NET FT, table 7.3, as quoted in public
clients)."""
AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


class AtiFileError(UsageError):
    """A file is not the ATI file that was expected."""


def read_calibration(data: bytes) -> tuple[FloatArray, FloatArray]:
    """Return what the bytes of a ``.cal`` file say.

    Returns
    -------
    matrix : (6 axes, 6 gauges)
        U: N/V for Fx, Fy, Fz and N*m/V for Tx, Ty, Tz.
    largest : (6,)
        Rated range of each axis, to both sides: N and N*m.

    Raises
    ------
    AtiFileError
        If they are no calibration file of six gauges.
    """
    try:
        sensor = fromstring(data)
        calibration = next(sensor.iter("Calibration")).attrib
        rows = {row.attrib["Name"]: row.attrib for row in sensor.iter("UserAxis")}
        si = np.repeat([UNITS[calibration["ForceUnits"]], UNITS[calibration["TorqueUnits"]]], 3)
        matrix = np.array([[float(value) for value in rows[axis]["values"].split()] for axis in AXES]) * si[:, None]
        if matrix.shape != (6, 6) or not np.isfinite(matrix).all():
            raise ValueError("each UserAxis row needs 6 numbers")
        return matrix, si * [float(rows[axis]["max"]) for axis in AXES]
    except (ParseError, LookupError, ValueError, StopIteration) as error:
        raise AtiFileError(f"This is no ATI calibration of six gauges: {error}.", hint="Is it a .cal file?") from error
