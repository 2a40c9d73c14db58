"""Table of units: every unit is converted to SI, or refused.

Compound units are products and quotients of the names below, for example ``N/mm``, ``MPa/mm``, ``N*mm``.
"""

from __future__ import annotations

from functools import lru_cache

from tactbench.core.errors import UsageError, did_you_mean

Dimension = tuple[int, ...]
"""Exponents of the base dimensions (length, mass, time, current, temperature, count)."""

_BASE = ("m", "kg", "s", "A", "K", "count")
_PREFIXES = {"M": 1e6, "k": 1e3, "h": 1e2, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12}
_SYMBOLS = {
    "m": (1.0, "m"), "g": (1e-3, "kg"), "s": (1.0, "s"), "A": (1.0, "A"), "K": (1.0, "K"), "Hz": (1.0, "1/s"),
    "N": (1.0, "kg*m/s/s"), "Pa": (1.0, "N/m/m"), "J": (1.0, "N*m"), "W": (1.0, "J/s"), "V": (1.0, "W/A"),
    "S": (1.0, "A/V"), "ohm": (1.0, "V/A"), "F": (1.0, "A*s/V"), "T": (1.0, "N/A/m"),
    "gf": (9.80665e-3, "N"),  # by standard gravity, 9.80665 m/s² (CGPM 1901)
}  # fmt: skip
"""Factors of units that take a prefix, each with the unit in which the factor is given."""
_WORDS = {
    "1": (1.0, ""), "%": (0.01, ""), "count": (1.0, "count"), "min": (60.0, "s"), "rad": (1.0, ""),
    "deg": (0.017453292519943295, ""), "degC": (1.0, "K"),
}  # fmt: skip
"""Factors of units that take no prefix. Temperatures in degC are differences, as in K."""


@lru_cache(maxsize=256)
def parse(unit: str) -> tuple[float, Dimension]:
    """Return the factor to SI and the dimension of `unit`; raise UsageError, with similar names, if unknown."""
    if not unit.strip():
        raise UsageError("The unit is empty.", hint="Write 1 for a pure number, or count for a raw reading.")
    factor, exponents, sign = 1.0, (0,) * len(_BASE), 1
    for token in unit.replace("*", " * ").replace("/", " / ").split():
        if token in ("*", "/"):
            sign = 1 if token == "*" else -1
            continue
        size, dimension = _named(token, unit)
        factor *= size**sign
        exponents = tuple(have + sign * more for have, more in zip(exponents, dimension, strict=True))
    return factor, exponents


def _named(name: str, unit: str) -> tuple[float, Dimension]:
    """Return the factor to SI and the dimension of `name`, which is a part of `unit`."""
    if name in _BASE:
        return 1.0, tuple(int(name == one) for one in _BASE)
    table, prefix, symbol = {**_SYMBOLS, **_WORDS}, 1.0, name
    if name not in table and name[0] in _PREFIXES and name[1:] in _SYMBOLS:
        prefix, symbol = _PREFIXES[name[0]], name[1:]
    if symbol not in table:
        hint = f"{did_you_mean(name, table)}Units: {', '.join(table)}; prefixes: {', '.join(_PREFIXES)}."
        raise UsageError(f"The unit {unit!r} is not known.", hint=hint)
    size, of = table[symbol]
    whole, dimension = parse(of) if of else (1.0, (0,) * len(_BASE))
    return prefix * size * whole, dimension


def with_unit(name: str, unit: str) -> str:
    """Return a name with its unit: ``force_noise_n``, ``drive_integral_mm_per_n_s``; pure numbers add no unit."""
    unit_text = unit.lower().replace("*", "_").replace("/", "_per_", 1).replace("/", "_")
    return name if unit == "1" else f"{name}_{unit_text}"


def conversion(given: str, target_unit: str) -> float:
    """Return the factor from `given` to `target_unit`; raise UsageError for an unknown unit or another dimension."""
    (size, dimension), (target, wanted_dimension) = parse(given), parse(target_unit)
    if dimension != wanted_dimension:
        raise UsageError(
            f"The unit {given!r} cannot be converted to {target_unit!r}, which has another dimension.",
            hint="Give a unit of the same dimension.",
        )
    return size / target
