"""Addresses: every part is understood or refused with the next step."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.links.address import KINDS, parse_address
from tactbench.plugin import UsageError
from tactbench.plugin.devices import LinkError, open_link


@pytest.mark.parametrize("kind", KINDS)
def test_examples_are_addresses(kind):
    assert parse_address(KINDS[kind].example).kind == kind


@pytest.mark.parametrize(
    ("text", "kind", "target", "options"),
    [
        ("serial:///dev/ttyUSB0?baud=9600&parity=even&stop_bits=2", "serial", "/dev/ttyUSB0",
         {"baud": 9600, "parity": "even", "stop_bits": 2}),
        ("serial:///dev/my%20port?baud=9600", "serial", "/dev/my port", {"baud": 9600}),
        ("can://socketcan/can0?bitrate=1000000", "can", "socketcan/can0", {"bitrate": 1000000}),
        ("can://slcan//dev/ttyACM0?bitrate=500000&sleep_after_open=0.5", "can", "slcan//dev/ttyACM0",
         {"bitrate": 500000, "sleep_after_open": 0.5}),
        ("udp://192.168.1.1:49152", "udp", "192.168.1.1:49152", {}),
        ("udp://[::1]:49152", "udp", "[::1]:49152", {}),
        ("spi://spidev/0.1?speed_hz=4400000&mode=3", "spi/spidev", "0.1", {"speed_hz": 4400000, "mode": 3}),
        ("spi://bridge/socket://10.0.0.2:4001?speed_hz=1", "spi/bridge", "socket://10.0.0.2:4001", {"speed_hz": 1}),
    ],
)  # fmt: skip
def test_parts(text, kind, target, options):
    address = parse_address(text)
    assert address == (kind, target, options)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("/dev/ttyUSB0", "serial:///dev/ttyUSB0?baud=115200"),
        ("serail:///dev/ttyUSB0?baud=9600", "Did you mean 'serial'"),
        ("can://sockcan/can0", "Did you mean 'socketcan'"),
        ("serial:///dev/ttyUSB0?baut=9600", "Did you mean 'baud'"),
        ("serial:///dev/ttyUSB0", "'baud' of the address"),
        ("serial:///dev/ttyUSB0?baud=fast", "'baud' of the address"),
        ("serial:///dev/ttyUSB0?baud=9600&baud=9600", "gives a key twice"),
        ("serial:///dev/ttyUSB0?baud=9600&parity=mark", "'none', 'even' or 'odd'"),
        ("can://virtual/", "does not say what to open"),
        ("udp://192.168.1.1", "a host and a port"),
        ("udp://192.168.1.1:70000", "a host and a port"),
        ("spi://spidev/0.0?speed_hz=4400000&mode=4", "less than or equal to 3"),
    ],
)
def test_what_is_wrong_is_said(text, said):
    with pytest.raises(UsageError) as raised:
        parse_address(text)
    assert said in str(raised.value)


@settings(max_examples=50)
@given(st.text(max_size=40) | st.builds("{}://{}?{}".format, st.sampled_from([*KINDS]), st.text(), st.text()))
def test_any_text_is_an_address_or_a_usage_error(text):
    try:
        kind = parse_address(text).kind
    except UsageError as error:
        kind, hint = None, error.hint
    assert kind in KINDS or hint


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("serial:///dev/there-is-none?baud=9600", "list_ports"),
        ("can://slcan/dev/there-is-none?bitrate=1000000", "can://slcan//dev/ttyACM0"),
        ("can://slcan//dev/there?bitrte=1000000", "Did you mean 'bitrate'"),
        ("can://pcan/PCAN_USBBUS1", "cannot be opened"),
        ("spi://spidev/zero?speed_hz=1", "pip install 'tactbench[spi]'"),
    ],
)
def test_what_does_not_open_says_what_to_do(address, said):
    with pytest.raises((LinkError, UsageError)) as raised:
        open_link(address)
    assert said in str(raised.value)
