import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import UsageError
from tactbench.core.spec import units

ATOMS = [
    "1", "%", "count", "rad", "deg", "K", "degC", "s", "ms", "min", "Hz", "kHz", "m", "mm", "N", "mN", "gf", "kgf",
    "Pa", "MPa", "V", "mV", "ohm", "kohm", "F", "pF", "T", "mT",
]  # fmt: skip


@pytest.mark.parametrize(
    ("given_unit", "wanted", "factor"),
    [
        ("gf", "N", 9.80665e-3),  # standard gravity, CGPM 1901
        ("kPa", "Pa", 1e3),
        ("MPa/mm", "Pa/m", 1e9),
        ("N*mm", "N*m", 1e-3),
        ("min", "s", 60.0),
        ("kgf", "N", 9.80665),
        ("mT", "uT", 1e3),
        ("V*A", "mW", 1e3),
        ("mA", "A", 1e-3),
        ("mK", "degC", 1e-3),
        ("kHz", "1/s", 1e3),
        ("deg", "rad", 0.017453292519943295),
        ("%", "1", 0.01),
        *((one, other, 1.0) for one, other in (
            ("N", "kg*m/s/s"), ("Pa", "N/m/m"), ("J", "N*m"), ("W", "J/s"), ("V", "W/A"), ("S", "A/V"), ("ohm", "V/A"),
            ("F", "A*s/V"), ("T", "N/A/m"), ("count", "count"), ("kg", "kg"),
        )),
    ],
)  # fmt: skip
def test_known_conversions(given_unit, wanted, factor):
    assert units.conversion(given_unit, wanted) == pytest.approx(factor, rel=1e-15)


@given(st.sampled_from(ATOMS), st.sampled_from(ATOMS))
def test_there_and_back_is_one(first, second):
    if units.parse(first)[1] == units.parse(second)[1]:
        # Two roundings of factors that are not powers of two: a few units in the last place.
        assert units.conversion(first, second) * units.conversion(second, first) == pytest.approx(1.0, rel=4e-16)
    else:
        with pytest.raises(UsageError):
            units.conversion(first, second)


@pytest.mark.parametrize("unit", ["newton", "mmin", "kdeg", "kkg", "", "m m#"])
def test_other_names_are_refused(unit):
    """Only the symbols take a prefix, and only one."""
    with pytest.raises(UsageError):
        units.parse(unit)
