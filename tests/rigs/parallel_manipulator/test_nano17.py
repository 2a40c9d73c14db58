"""Gauge voltages through a calibration file: golden vectors, both ways to the matrix, files that are refused.

The gauge stream: its vectors, its emulator and its driver.
"""

import math
import struct
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality, RigError, UsageError
from tactbench.plugin.devices import (
    DriverSettings,
    EmulatorSettings,
    Frame,
    LinkTimeout,
    LinkUnplugged,
    Received,
    encode_frame,
    open_link,
)
from tactbench.rigs.parallel_manipulator.force_torque.ati_xml import LARGEST_BYTES, AtiFileError, elements
from tactbench.rigs.parallel_manipulator.force_torque.nano17.codec import read_calibration
from tactbench.rigs.parallel_manipulator.force_torque.nano17.driver import build
from tactbench.rigs.parallel_manipulator.force_torque.nano17.emulator import (
    EMULATED_CALIBRATION,
    GaugeEmulator,
    GaugeFault,
)
from tactbench.rigs.parallel_manipulator.force_torque.nano17.emulator import build as build_emulator
from tactbench.rigs.parallel_manipulator.force_torque.nano17.gauges import (
    About,
    GaugeReader,
    encode_about,
    encode_sample,
)
from tests.rigs.parallel_manipulator.pumps import VirtualLink, joined, on_pty, read_for

FT8577 = EMULATED_CALIBRATION.read_bytes()

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


@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6))
@settings(max_examples=60)
def test_a_wrench_comes_back_to_the_converters_step(share):
    calibration = read_calibration(FT8577)
    wrench, bias = 0.3 * np.array(share) * calibration.largest, np.linspace(-0.5, 0.5, 6)
    read = STEP_V * np.rint(calibration.volts(wrench, bias) / STEP_V)
    # Half a step in every gauge at most, all in the worst direction.
    most = STEP_V / 2 * np.abs(np.array(calibration.matrix)).sum(axis=1)
    assert (np.abs(calibration.wrench(read, bias) - wrench) <= most * (1 + 1e-9)).all()


def test_marks():
    calibration = read_calibration(FT8577)
    codes = np.zeros((5, 6))
    codes[1, 2] = 2**15 - 1  # Highest code of a bipolar converter.
    codes[2, 5] = -(2**15)
    codes[3, 0] = 2**15 - 2
    volts = codes * STEP_V
    volts[4, 1] = np.nan
    marks = calibration.quality(volts, step_v=STEP_V)
    assert marks.shape == (5, 6)
    assert [set(row) for row in marks.tolist()] == [
        {Quality.GOOD},
        {Quality.SATURATED},
        {Quality.SATURATED},
        {Quality.GOOD},
        {Quality.MISSING},
    ]
    assert calibration.beyond_range([24.9, -25.1, 0, 0, 0, 0.26]).tolist() == [False, True, False, False, False, True]


BILLION_LAUGHS = b"""<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<FTSensor Serial="&b;"/>"""
OTHER_FILE = b'<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/hostname">]><x>&f;</x>'


@pytest.mark.parametrize(
    "data",
    [BILLION_LAUGHS, OTHER_FILE, b'<!DOCTYPE x SYSTEM "http://example.org/x.dtd"><x/>', b"<!DOCTYPE x><x/>"],
    ids=["entities", "other file", "outer document type", "document type"],
)
def test_document_types_and_entities_are_refused(data):
    with pytest.raises(AtiFileError, match="document type or an entity"):
        read_calibration(data)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "not an XML file"),
        (b"\x89PNG\r\n", "not an XML file"),
        (b'<?xml version="1.0" encoding="klingon"?><x/>', "not an XML file"),
        (FT8577[:-30], "not an XML file"),
        (b"<x>&lol;</x>", "not an XML file"),
        (b"<a/>" + b" " * LARGEST_BYTES, "at most"),
        (b"<x/>", "FTSensor"),
        (FT8577.replace(b'NumGages="6"', b'NumGages="7"'), "7 gauges"),
        (FT8577.replace(b'UserAxis Name="Tz"', b'UserAxis Name="Fz"'), "Six UserAxis rows"),
        (FT8577.replace(b"3.28574", b"three"), "three"),
        (FT8577.replace(b"3.28574", b"nan"), "nan"),
        (FT8577.replace(b" 3.28574", b""), "6 values"),
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


# The gauge stream -----------------------------------------------------------------------------------------------------

VECTORS = [
    (About(1, 1000.0, "tactbench emulator"), 0x21, 0, struct.pack("<HI", 1, 1_000_000) + b"tactbench emulator"),
    ((0, 0, (0, 0, 0, 0, 0, 0)), 0x20, 0, bytes(20)),
    (
        (65538, 2**32 - 1, (1, -1, 32767, -32768, 256, -2)),
        0x20,
        2,
        struct.pack("<II6h", 65538, 2**32 - 1, 1, -1, 32767, -32768, 256, -2),
    ),
]


def unstuffed(line):
    """Cheshire and Baker 1999, as the paper has it: each code is the way to the next zero."""
    body, place = b"", 0
    while place < len(line):
        code = line[place]
        body += line[place + 1 : place + code] + (b"\0" if code < 255 else b"")
        place += code
    return body[:-1]


def test_vectors_of_the_document():
    text = (Path(__file__).parents[3] / "docs" / "links.md").read_text(encoding="utf-8")
    block = text.split("## The gauge stream")[1].split("```text\n")[1].split("```")[0]
    lines = [bytes.fromhex(line) for line in block.splitlines()]
    for line, (what, kind, number, payload) in zip(lines, VECTORS, strict=True):
        assert (encode_about(what) if isinstance(what, About) else encode_sample(*what)) == line
        body = unstuffed(line[:-1])
        assert body[:6] == struct.pack("<BBHH", 1, kind, number, len(payload))
        assert body[6:-4] == payload
        assert body[-4:] == struct.pack("<I", zlib.crc32(body[:-4]))
    reader = GaugeReader()
    reader.feed(Received(b"".join(lines), 5))
    samples, stamps = reader.taken()
    assert reader.about == VECTORS[0][0]
    assert samples.counter.tolist() == [0, 65538]
    assert samples.micros.tolist() == [0, 2**32 - 1]
    assert samples.counts.tolist() == [[0] * 6, [1, -1, 32767, -32768, 256, -2]]
    assert stamps.tolist() == [5, 5]


def test_frames_are_stamped_with_their_first_byte_and_damaged_ones_counted():
    frames = [encode_sample(n, n, (n,) * 6) for n in range(4)]
    reader, line = GaugeReader(), frames[0] + frames[1][:-3] + frames[2] + frames[3]
    for t_ns, start in enumerate(range(0, len(line), 7)):
        reader.feed(Received(line[start : start + 7], t_ns))
    samples, stamps = reader.taken()
    assert samples.counter.tolist() == [0, 3]
    assert stamps.tolist() == [0, len(line[: -len(frames[3])]) // 7]
    assert reader.damaged == 1
    reader.feed(Received(encode_frame(Frame(0x20, 0, bytes(19))) + encode_frame(Frame(0x22, 0)), 0))
    assert (len(reader), reader.unknown) == (0, 2)
    with pytest.raises(RigError, match="version 2"):
        reader.feed(Received(encode_frame(Frame(0x20, 0, bytes(20), version=2)), 0))


@given(st.lists(st.binary(max_size=60), max_size=10))
@settings(max_examples=40)
def test_any_bytes_are_survived(pieces):
    reader = GaugeReader()
    for piece in pieces:
        with suppress(RigError):
            reader.feed(Received(piece, 0))
    reader.feed(Received(b"\0" + encode_sample(7, 8, (9,) * 6), 0))
    assert reader.taken()[0].counter[-1] == 7


REST_V = (0.3, -0.2, 0.1, 0.05, -0.4, 0.25)


def pressed(time_s):
    """Nothing for half a second, then a wrench that every axis takes part in."""
    wave = 0.0 if time_s < 100.5 else 0.5 - 0.5 * math.cos(2 * math.pi * 3.0 * (time_s - 100.5))
    return (1.0 * wave, -2.0 * wave, -5.0 * wave, 0.01 * wave, -0.02 * wave, 0.003 * wave)


@pytest.fixture
def calibration_file(tmp_path):
    file = tmp_path / "FT8577.cal"
    file.write_bytes(FT8577)
    return str(file)


def gauges(wrench=pressed, rest_v=REST_V, **more):
    return GaugeEmulator(wrench, read_calibration(FT8577), rest_v, **more)


def driver_on(emulator, calibration_file, *, unplugged_s=math.inf, **options):
    link = VirtualLink(emulator, unplugged_s=unplugged_s)
    options = {"calibration": calibration_file} | options
    return build(DriverSettings(open_link=lambda: link, options=options, clock=link.clock)), link


def test_a_wrench_comes_back_through_gauges_frames_and_bias(calibration_file):
    driver, link = driver_on(gauges(), calibration_file)
    assert driver.identify() == {
        "model": "Nano17",
        "calibration": "FT8577 SI-25-0.25",
        "converter": "tactbench emulator",
        "firmware": "1",
        "rate_hz": "1000",
    }
    driver.start()
    block = read_for(driver, link, 1.0)
    # The microcontroller counts from power-on, which was at 100 s; its microseconds are whole.
    at_s = 100.0 + block.device_ns / 1e9
    expected = np.array([pressed(t) for t in at_s])
    # Half a step in each gauge, and in the bias that was taken from steady readings, all in the worst direction.
    most = STEP_V * np.abs(np.array(read_calibration(FT8577).matrix)).sum(axis=1)
    assert (np.abs(block.data - expected) <= most * (1 + 1e-9)).all()
    assert np.abs(expected).max() > 4.0
    assert np.diff(block.sequence).tolist() == [1] * (len(block.data) - 1)
    assert set(np.diff(block.device_ns)) == {1_000_000}
    # A frame is on the line for 32 bytes at 921600 baud, two where it waits for the one that says who sends it.
    delay_ns = block.t_ns - round(100e9) - block.device_ns
    assert delay_ns.min() >= 10e9 * 32 / 921_600 - 1
    assert delay_ns.max() <= 10e9 * 2 * 40 / 921_600
    assert not block.quality.any()
    assert driver.counts == {}


def test_counters_are_counted_on_over_their_wraps(calibration_file):
    driver, link = driver_on(
        gauges(first_counter=2**32 - 150, first_micros=2**32 - 130_000), calibration_file, bias_samples=0
    )
    driver.start()
    block = read_for(driver, link, 0.3)
    assert np.diff(block.sequence).tolist() == [1] * (len(block.data) - 1)
    assert block.sequence[-1] > 2**32
    assert set(np.diff(block.device_ns)) == {1_000_000}


def test_the_zero_is_taken_where_it_is_asked_for(calibration_file):
    load = {"now": -1.0}
    driver, link = driver_on(gauges(lambda t: (0, 0, load["now"], 0, 0, 0)), calibration_file, bias_samples=0)
    driver.start()
    loaded = read_for(driver, link, 0.2)
    zero_n = read_calibration(FT8577).wrench(REST_V)
    assert np.abs(loaded.data - zero_n - [0, 0, -1.0, 0, 0, 0]).max() < 2e-3
    assert driver.tare()
    load["now"] = -3.0
    block = read_for(driver, link, 0.3)
    # What came while the zero was taken is of the old one, and is not lost.
    assert block.sequence[0] == loaded.sequence[-1] + 1
    assert np.diff(block.sequence).tolist() == [1] * (len(block.data) - 1)
    assert np.abs(block.data[:100] - loaded.data[-1]).max() < 2e-3
    assert block.data[-1, 2] == pytest.approx(-2.0, abs=2e-3)


def test_faults_are_gaps_doubles_and_marks(calibration_file):
    faults = [
        GaugeFault("dropped", every=10, start_s=101.0, end_s=102.0),
        GaugeFault("doubled", every=10, start_s=102.0, end_s=103.0),
        GaugeFault("damaged", every=10, start_s=103.0, end_s=104.0),
        GaugeFault("saturated", start_s=104.0, end_s=104.5),
    ]
    driver, link = driver_on(gauges(faults=faults), calibration_file)
    driver.start()
    block = read_for(driver, link, 5.0)
    steps = np.diff(block.sequence)
    assert {int(step): int((steps == step).sum()) for step in np.unique(steps) if step != 1} == {0: 100, 2: 200}
    saturated = (block.device_ns >= round(4e9)) & (block.device_ns < round(4.5e9))
    assert (block.quality[saturated] == Quality.SATURATED).all()
    assert (block.quality[~saturated] == Quality.GOOD).all()
    assert driver.counts == {"damaged": 100}
    with pytest.raises(UsageError, match=r"no fault called .coffee.*damaged, doubled"):
        GaugeFault("coffee")


def test_readings_beyond_the_rated_range_are_counted(calibration_file):
    driver, link = driver_on(gauges(lambda t: (0, 0, 0 if t < 100.5 else -36.0, 0, 0, 0)), calibration_file)
    driver.start()
    block = read_for(driver, link, 1.0)
    assert not block.quality.any()
    assert driver.counts == {"beyond_range": int((block.data[:, 2] < -35).sum())}


def test_no_zero_is_taken_at_an_end(calibration_file):
    driver, _ = driver_on(gauges(faults=[GaugeFault("saturated")]), calibration_file)
    with pytest.raises(RigError, match="at an end"):
        driver.start()


def test_a_microcontroller_that_restarts_is_not_followed_silently(calibration_file):
    emulator = gauges()
    driver, link = driver_on(emulator, calibration_file)
    driver.start()
    link.emulator = gauges()
    with pytest.raises(RigError, match="begun to count its samples anew"):
        read_for(driver, link, 1.0)


def test_other_rates_are_refused_with_the_right_one(calibration_file):
    driver, _ = driver_on(gauges(rate_hz=500), calibration_file)
    with pytest.raises(RigError, match=r"500 times a second.*1000.*rate_hz: 500"):
        driver.identify()


def test_something_else_on_the_line(calibration_file):
    driver, _ = driver_on(gauges(faults=[GaugeFault("damaged")]), calibration_file)
    with pytest.raises(LinkTimeout, match=r"sent 100 samples within .*0 samples, .* damaged"):
        driver.start()


def test_unplugged(calibration_file):
    driver, link = driver_on(gauges(), calibration_file, unplugged_s=101.0)
    driver.start()
    with pytest.raises(LinkUnplugged):
        read_for(driver, link, 5.0)
    driver.stop()
    driver.close()
    driver.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "'calibration' of nano17"),
        ({"calibration": "/nowhere/FT0.cal"}, "The calibration cannot be read"),
        ({"calibration": __file__}, "not an XML file"),
        ({"calibration": "x", "bias": True}, "no option of nano17 called 'bias'.*bias_samples"),
        ({"calibration": "x", "bias_samples": -1}, "'bias_samples' of nano17"),
    ],
)
def test_options_that_are_refused(options, message):
    with pytest.raises(UsageError, match=message):
        build(DriverSettings(open_link=lambda: open_link("loop://"), options=options))


def test_the_emulator_of_a_rig_file_on_a_pseudo_terminal(calibration_file):
    """In real time."""
    settings_ = EmulatorSettings(
        senses=lambda t: {"fz": -2.5},
        rng=np.random.default_rng(5),
        options={"calibration": calibration_file, "bias_samples": 0, "rate_hz": 500},
        faults=["doubled:every=50"],
    )
    with on_pty(build_emulator(settings_)) as end:
        address = f"serial://{end.name}?baud=921600"
        with build(DriverSettings(open_link=lambda: open_link(address), options=settings_.options)) as driver:
            end.opened()
            assert driver.identify()["rate_hz"] == "500"
            driver.start()
            blocks = []
            while sum(len(block.data) for block in blocks) < 200:
                blocks += driver.read(10.0)
            block = joined(blocks)
            end.unplug()
            with pytest.raises(LinkUnplugged):
                list(iter(lambda: driver.read(10.0), None))
    assert set(np.diff(block.sequence)) == {0, 1}
    # The gauges of this sensor have a rest of their own, which was not taken off.
    assert np.ptp(block.data, axis=0).max() == 0
    assert np.abs(block.data[0, 2] + 2.5) > 0.01
    with pytest.raises(UsageError, match="2592 samples"):
        gauges(rate_hz=3000)


def test_text_is_that_of_its_element():
    assert [(e.name, e.text) for e in elements(b"<a>1<b>2</b>3</a>")] == [("a", "13"), ("b", "2")]
