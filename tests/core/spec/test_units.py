import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import UsageError
from tactbench.core.spec import units

ATOMS = sorted(units._ATOMS)


# Every name in the base units m, kg, s, A, K and count: a factor and their exponents in that order. BIPM, The
# International System of Units, 9th edition, tables 2 and 4; standard gravity is 9.80665 m/s^2 (CGPM 1901).
IN_BASE_UNITS = {
    "": {"1": 1.0, "%": 0.01, "rad": 1.0, "deg": math.pi / 180},
    "count": {"count": 1.0},
    "m": {"m": 1.0, "cm": 0.01, "mm": 1e-3, "um": 1e-6},
    "kg": {"kg": 1.0, "g": 1e-3},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "s-1": {"Hz": 1.0, "kHz": 1e3},
    "m kg s-2": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3, "kgf": 9.80665},
    "m-1 kg s-2": {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6},
    "m2 kg s-2": {"J": 1.0, "N*m": 1.0, "N*mm": 1e-3},
    "m2 kg s-3": {"W": 1.0, "mW": 1e-3},
    "A": {"A": 1.0, "mA": 1e-3},
    "m2 kg s-3 A-1": {"V": 1.0, "mV": 1e-3},
    "m2 kg s-3 A-2": {"ohm": 1.0, "kohm": 1e3},
    "m-2 kg-1 s3 A2": {"S": 1.0},
    "m-2 kg-1 s4 A2": {"F": 1.0, "pF": 1e-12},
    "kg s-2 A-1": {"T": 1.0, "uT": 1e-6},
    "K": {"K": 1.0, "degC": 1.0},
    "m-2 kg s-2": {"MPa/mm": 1e9},
    "m-1 s-1": {"1/mm/s": 1e3},
}


def test_every_unit_is_what_its_definition_says():
    named = {unit for units_of in IN_BASE_UNITS.values() for unit in units_of}
    assert named - {"N*m", "N*mm", "MPa/mm", "1/mm/s"} == set(ATOMS)
    for base, factors in IN_BASE_UNITS.items():
        exponents = dict.fromkeys(("m", "kg", "s", "A", "K", "count"), 0)
        for part in base.split():
            name, exponent = re.fullmatch(r"([A-Za-z]+)(-?[0-9]*)", part).groups()
            exponents[name] = int(exponent or 1)
        for unit, factor in factors.items():
            assert units.parse(unit) == (pytest.approx(factor, rel=1e-15), tuple(exponents.values())), unit


@pytest.mark.parametrize("unit", ["", " ", "furlong", "N/furlong"])
def test_what_is_no_unit_is_refused(unit):
    with pytest.raises(UsageError):
        units.parse(unit)


def test_a_name_with_its_unit():
    found = [units.with_unit("force", unit) for unit in ("1", "N", "mm/N/s", "N*mm/Hz")]
    assert found == ["force", "force_n", "force_mm_per_n_s", "force_n_mm_per_hz"]


@given(st.sampled_from(ATOMS), st.sampled_from(ATOMS))
def test_there_and_back_is_one(first, second):
    if units.parse(first)[1] == units.parse(second)[1]:
        # Two roundings of factors that are not powers of two: a few units in the last place.
        assert units.conversion(first, second) * units.conversion(second, first) == pytest.approx(1.0, rel=4e-16)
    else:
        with pytest.raises(UsageError):
            units.conversion(first, second)
