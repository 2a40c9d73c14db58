"""Gauge voltages through a calibration file: golden vectors, both ways to the matrix, files that are refused."""

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tactbench.rigs.parallel_manipulator
from tactbench.rigs.parallel_manipulator.force_torque.ati import AtiFileError, read_calibration

FT8577 = (Path(tactbench.rigs.parallel_manipulator.__file__).parent / "force_torque" / "FT8577.cal").read_bytes()


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
STEP_V = 20.0 / 2**16


def without(name, data=FT8577):
    return b"\n".join(line for line in data.splitlines() if f"<{name} ".encode() not in line)


@pytest.mark.parametrize(("volts", "expected"), PRODUCTS, ids=[f"AT-3.{i + 1}" for i in range(len(PRODUCTS))])
def test_matrix_product(volts, expected):
    wrench = read_calibration(FT8577).wrench(volts)
    # Half of the last digit printed, in N and N-mm, and rounding of the sum.
    assert np.abs(wrench * np.repeat([1.0, 1e3], 3) - expected).max() <= 5.001e-6


def test_bias_is_taken_off_before_the_matrix():
    """AT-3.9."""
    volts, bias = [1.2, 0.8, 1.1, 0.9, 1, 0.7], [1.1, 1, 0.8, 1.3, 0.5, 1.3]
    calibration = read_calibration(FT8577)
    expected = np.array(PRODUCTS[6][1])
    assert np.abs(calibration.wrench(volts, bias) * np.repeat([1.0, 1e3], 3) - expected).max() <= 5.001e-6
    many = calibration.wrench(np.tile(volts, (7, 1)), bias)
    assert many.shape == (7, 6)


def test_what_the_file_says():
    calibration = read_calibration(FT8577)
    assert (calibration.serial, calibration.body_style, calibration.part_number) == ("FT8577", "Nano17", "SI-25-0.25")
    assert calibration.largest == pytest.approx((25, 25, 35, 0.25, 0.25, 0.25))
    assert calibration.voltages == (-10.0, 10.0)
    assert calibration.rebuilt_difference == pytest.approx(8.1e-6, abs=5e-8)  # AT-3, digits printed.


def test_the_matrix_is_rebuilt_where_an_older_file_does_not_state_it():
    stated, rebuilt = read_calibration(FT8577), read_calibration(without("UserAxis"))
    difference = np.abs(np.array(stated.matrix) - rebuilt.matrix) / np.repeat([1.0, 1e-3], 3)[:, None]
    assert difference.max() == pytest.approx(stated.rebuilt_difference)
    assert rebuilt.rebuilt_difference is None
    assert read_calibration(without("Axis", without("BasicTransform"))).matrix == stated.matrix


def test_a_transform_is_the_moment_of_the_force():
    """Against the definition: torque about a point moved by D is T - D x F."""
    moved = without("UserAxis").replace(b'Dx="0" Dy="0" Dz="6.096"', b'Dx="1.5" Dy="-2.5" Dz="6.096"')
    plain = without("UserAxis").replace(b'Dz="6.096"', b'Dz="0"')
    volts = np.random.default_rng(4).uniform(-3, 3, (20, 6))
    before, after = (read_calibration(data).wrench(volts) for data in (plain, moved))
    expected = before[:, 3:] - np.cross([1.5e-3, -2.5e-3, 6.096e-3], before[:, :3])
    assert np.abs(after[:, 3:] - expected).max() < 1e-12
    assert np.array_equal(after[:, :3], before[:, :3])


def test_units_become_si():
    metres = FT8577.replace(b'TorqueUnits="N-mm"', b'TorqueUnits="N-m"')
    pounds = FT8577.replace(b'ForceUnits="N"', b'ForceUnits="lbf"')
    plain = np.array(read_calibration(FT8577).matrix)
    assert np.array(read_calibration(metres).matrix)[3:] == pytest.approx(1e3 * plain[3:])
    assert np.array(read_calibration(pounds).matrix)[:3] == pytest.approx(4.4482216152605 * plain[:3])
    with pytest.raises(AtiFileError, match="stone"):
        read_calibration(FT8577.replace(b'ForceUnits="N"', b'ForceUnits="stone"'))


def test_what_one_step_of_a_converter_moves():
    matrix = np.array(read_calibration(FT8577).matrix)
    worst = STEP_V * np.abs(matrix).max(axis=1)
    assert 1e3 * worst[:3] == pytest.approx([1.004, 1.224, 1.172], abs=5e-4)
    assert 1e6 * worst[3:] == pytest.approx([7.449, 7.209, 4.515], abs=5e-4)
    rms = STEP_V / np.sqrt(12) * np.sqrt((matrix**2).sum(axis=1))
    assert 1e3 * rms[:3] == pytest.approx([0.410, 0.426, 0.574], abs=5e-4)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not an XML file"),
        (b"\x89PNG\r\n", "not an XML file"),
        (b'<?xml version="1.0" encoding="klingon"?><x/>', "not an XML file"),
        (FT8577[:-30], "not an XML file"),
        (b"<x>&lol;</x>", "not an XML file"),
        (b"<x/>", "FTSensor"),
        (FT8577.replace(b'NumGages="6"', b'NumGages="7"'), "7 gauges"),
        (FT8577.replace(b'UserAxis Name="Tz"', b'UserAxis Name="Fz"'), "no Tz"),
        (FT8577.replace(b"3.28574", b"three"), "three"),
        (FT8577.replace(b"3.28574", b"nan"), "6 numbers"),
        (FT8577.replace(b" 3.28574", b""), "6 numbers"),
        (FT8577.replace(b' Serial="FT8577"', b""), "Serial"),
        (without("UserAxis", without("BasicTransform")), "neither"),
        (without("UserAxis").replace(b'Rx="0"', b'Rx="30"'), "neither"),
        (without("UserAxis").replace(b'scale="1.57420173377595"', b'scale="0"'), "scale 0"),
        (FT8577.replace(b"  0.04912  -4.01052  -0.04494   1.93650  -0.03469   1.87318 ", b"0 0 0 0 0 0"), "singular"),
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
