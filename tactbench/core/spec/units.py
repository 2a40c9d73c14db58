"""Units: a small closed table, so that every number can be turned into SI or refused.

Compound units are products and quotients of the names below, for example ``N/mm``, ``MPa/mm``, ``N*mm``.
"""

from __future__ import annotations

from functools import lru_cache

from tactbench.core.errors import UsageError, did_you_mean

Dimension = tuple[int, int, int, int, int, int]
"""Exponents of (length, mass, time, current, temperature, count)."""

# name -> (factor to SI, exponents). Standard gravity 9.80665 m/s² (CGPM 1901) defines the gram-force.
_ATOMS: dict[str, tuple[float, Dimension]] = {
    "1": (1.0, (0, 0, 0, 0, 0, 0)),
    "%": (0.01, (0, 0, 0, 0, 0, 0)),
    "count": (1.0, (0, 0, 0, 0, 0, 1)),
    "m": (1.0, (1, 0, 0, 0, 0, 0)),
    "cm": (1e-2, (1, 0, 0, 0, 0, 0)),
    "mm": (1e-3, (1, 0, 0, 0, 0, 0)),
    "um": (1e-6, (1, 0, 0, 0, 0, 0)),
    "kg": (1.0, (0, 1, 0, 0, 0, 0)),
    "g": (1e-3, (0, 1, 0, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0, 0, 0)),
    "ms": (1e-3, (0, 0, 1, 0, 0, 0)),
    "us": (1e-6, (0, 0, 1, 0, 0, 0)),
    "ns": (1e-9, (0, 0, 1, 0, 0, 0)),
    "min": (60.0, (0, 0, 1, 0, 0, 0)),
    "Hz": (1.0, (0, 0, -1, 0, 0, 0)),
    "kHz": (1e3, (0, 0, -1, 0, 0, 0)),
    "N": (1.0, (1, 1, -2, 0, 0, 0)),
    "mN": (1e-3, (1, 1, -2, 0, 0, 0)),
    "kN": (1e3, (1, 1, -2, 0, 0, 0)),
    "gf": (9.80665e-3, (1, 1, -2, 0, 0, 0)),
    "kgf": (9.80665, (1, 1, -2, 0, 0, 0)),
    "Pa": (1.0, (-1, 1, -2, 0, 0, 0)),
    "hPa": (1e2, (-1, 1, -2, 0, 0, 0)),
    "kPa": (1e3, (-1, 1, -2, 0, 0, 0)),
    "MPa": (1e6, (-1, 1, -2, 0, 0, 0)),
    "J": (1.0, (2, 1, -2, 0, 0, 0)),
    "W": (1.0, (2, 1, -3, 0, 0, 0)),
    "mW": (1e-3, (2, 1, -3, 0, 0, 0)),
    "A": (1.0, (0, 0, 0, 1, 0, 0)),
    "mA": (1e-3, (0, 0, 0, 1, 0, 0)),
    "V": (1.0, (2, 1, -3, -1, 0, 0)),
    "mV": (1e-3, (2, 1, -3, -1, 0, 0)),
    "S": (1.0, (-2, -1, 3, 2, 0, 0)),
    "ohm": (1.0, (2, 1, -3, -2, 0, 0)),
    "kohm": (1e3, (2, 1, -3, -2, 0, 0)),
    "F": (1.0, (-2, -1, 4, 2, 0, 0)),
    "pF": (1e-12, (-2, -1, 4, 2, 0, 0)),
    "T": (1.0, (0, 1, -2, -1, 0, 0)),
    "uT": (1e-6, (0, 1, -2, -1, 0, 0)),
    "K": (1.0, (0, 0, 0, 0, 1, 0)),
    # Temperatures in degC are differences here; absolute ones carry the offset in `absolute_si`.
    "degC": (1.0, (0, 0, 0, 0, 1, 0)),
    "rad": (1.0, (0, 0, 0, 0, 0, 0)),
    "deg": (0.017453292519943295, (0, 0, 0, 0, 0, 0)),
}


@lru_cache(maxsize=256)
def parse(unit: str) -> tuple[float, Dimension]:
    """Return the factor to SI and the dimension of `unit`.

    Raises
    ------
    UsageError
        If a part of `unit` is not in the table; the message offers the nearest names.
    """
    factor, exponents = 1.0, [0] * 6
    sign = 1
    for token in unit.replace("*", " * ").replace("/", " / ").split():
        if token == "*":
            sign = 1
        elif token == "/":
            sign = -1
        else:
            if token not in _ATOMS:
                hint = f"{did_you_mean(token, _ATOMS)}Units: {', '.join(sorted(_ATOMS))}."
                raise UsageError(f"The unit {unit!r} is not known.", hint=hint)
            size, dimension = _ATOMS[token]
            factor *= size**sign
            exponents = [have + sign * more for have, more in zip(exponents, dimension, strict=True)]
    if not unit.strip():
        raise UsageError("The unit is empty.", hint="Write 1 for a pure number, count for a raw reading.")
    return factor, tuple(exponents)  # type: ignore[return-value]


def with_unit(name: str, unit: str) -> str:
    """Return a name with its unit: ``force_noise_n``, ``drive_integral_mm_per_n_s``; the name of a pure number."""
    unit_text = unit.lower().replace("*", "_").replace("/", "_per_", 1).replace("/", "_")
    return name if unit == "1" else f"{name}_{unit_text}"


def conversion(given: str, target_unit: str) -> float:
    """Return the factor that turns a number in `given` into one in `target_unit`.

    Raises
    ------
    UsageError
        If either unit is unknown or the two measure different things.
    """
    (size, dimension), (target, wanted_dimension) = parse(given), parse(target_unit)
    if dimension != wanted_dimension:
        raise UsageError(
            f"The unit {given!r} cannot be turned into {target_unit!r}: they measure different things.",
            hint="Correct the unit, or state the conversion explicitly.",
        )
    return size / target
