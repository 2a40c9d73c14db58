"""Gauge voltages through a calibration file: golden vectors, both ways to the matrix, files that are refused."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.rigs.parallel_manipulator.force_torque.ati import AtiFileError, read_calibration

FT8577 = Path(__file__).with_name("FT8577.cal").read_bytes()


# AT-3: volts less bias, then N and N-mm.
PRODUCTS = [
    ([0, 0, 0, 0, 0, 0], [0.00000, 0.00000, 0.00000, 0.00000, 0.00000, 0.00000]),
    ([1, 0, 0, 0, 0, 0], [-0.00593, 0.04912, 3.74583, 0.43927, -23.62228, 0.14700]),
    ([0, 0, 0, 1, 0, 0], [3.28574, 1.93650, 0.02560, 11.97267, -19.95816, -14.27979]),
    ([1, 1, 1, 1, 1, 1], [0.18189, -0.23135, 11.31770, -0.52296, -1.14722, -42.52877]),
    ([1, 0, 1, 0, 1, 0], [0.19237, -0.03051, 11.28875, -0.10098, -0.22420, 0.80193]),
    ([0, 1, 0, 1, 0, 1], [-0.01048, -0.20084, 0.02895, -0.42198, -0.92302, -43.33070]),
    ([0.1, -0.2, 0.3, -0.4, 0.5, -0.6], [0.75366, -1.12232, 3.41055, -11.52352, 3.11199, 17.63540]),
    ([-0.5, 0.25, -0.5, 0.25, -0.5, 0.25], [-0.09881, -0.03495, -5.63714, -0.05500, -0.11865, -11.23364]),
]


@pytest.mark.parametrize(("volts", "expected"), PRODUCTS, ids=[f"AT-3.{i + 1}" for i in range(len(PRODUCTS))])
def test_matrix_product(volts, expected):
    matrix, _ = read_calibration(FT8577)
    wrench = matrix @ volts
    # Half of the last digit printed, in N and N-mm, and rounding of the sum.
    assert np.abs(wrench * np.repeat([1.0, 1e3], 3) - expected).max() <= 5.001e-6


def test_what_the_file_says_becomes_si():
    plain, largest = read_calibration(FT8577)
    assert largest == pytest.approx((25, 25, 35, 0.25, 0.25, 0.25))
    metres = FT8577.replace(b'TorqueUnits="N-mm"', b'TorqueUnits="N-m"')
    pounds = FT8577.replace(b'ForceUnits="N"', b'ForceUnits="lbf"')
    assert read_calibration(metres)[0][3:] == pytest.approx(1e3 * plain[3:])
    assert read_calibration(pounds)[0][:3] == pytest.approx(4.4482216152605 * plain[:3])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x89PNG\r\n", "no ATI calibration"),
        (b'<?xml version="1.0" encoding="klingon"?><x/>', "no ATI calibration"),
        (FT8577[:-30], "no ATI calibration"),
        (b"<x/>", "no ATI calibration"),
        (FT8577.replace(b'ForceUnits="N"', b'ForceUnits="stone"'), "stone"),
        (FT8577.replace(b'UserAxis Name="Tz"', b'UserAxis Name="Fz"'), "Tz"),
        (FT8577.replace(b"3.28574", b"three"), "three"),
        (FT8577.replace(b"3.28574", b"nan"), "6 numbers"),
        (FT8577.replace(b" 3.28574", b""), "six gauges"),
    ],
)
def test_files_that_are_refused(data, message):
    with pytest.raises(AtiFileError, match=message):
        read_calibration(data)


@given(st.binary(max_size=400), st.integers(0, len(FT8577)))
@settings(max_examples=80)
def test_any_bytes_raise_nothing_else(noise, place):
    for data in (noise, FT8577[:place] + noise + FT8577[place + len(noise) :]):
        with suppress(AtiFileError):
            read_calibration(data)
