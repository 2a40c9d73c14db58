"""Addresses: every part is understood or refused with the next step."""

from __future__ import annotations

import pytest

from tactbench.links.address import KINDS, parse_address
from tactbench.plugin import UsageError
from tactbench.plugin.devices import LinkError, open_link


@pytest.mark.parametrize("kind", KINDS)
def test_examples_are_addresses(kind):
    assert parse_address(KINDS[kind].example)[0] == kind


@pytest.mark.parametrize(
    ("text", "kind", "target", "options"),
    [
        ("serial:///dev/ttyUSB0?baud=9600&parity=even&stop_bits=2", "serial", "/dev/ttyUSB0",
         {"baud": 9600, "parity": "even", "stop_bits": 2}),
        ("serial:///dev/my%20port?baud=9600", "serial", "/dev/my port",
         {"baud": 9600, "parity": "none", "stop_bits": 1}),
        ("can://socketcan/can0?bitrate=1000000", "can", "socketcan/can0", {"bitrate": 1000000}),
        ("can://slcan//dev/ttyACM0?bitrate=500000&sleep_after_open=0.5", "can", "slcan//dev/ttyACM0",
         {"bitrate": 500000, "sleep_after_open": 0.5}),
        ("udp://192.168.1.1:49152", "udp", "192.168.1.1:49152", {}),
        ("udp://[::1]:49152", "udp", "[::1]:49152", {}),
        ("spi://bridge/socket://10.0.0.2:4001?speed_hz=1&mode=3", "spi/bridge", "socket://10.0.0.2:4001",
         {"speed_hz": 1, "mode": 3, "baud": 115200}),
    ],
)  # fmt: skip
def test_parts(text, kind, target, options):
    assert parse_address(text) == (kind, target, options)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("/dev/ttyUSB0", "serial:///dev/ttyUSB0?baud=115200"),
        ("serail:///dev/ttyUSB0?baud=9600", "'serial'"),
        ("can://sockcan/can0", "'socketcan'"),
        ("spi://spidev/0.0?speed_hz=4400000", "'spi/bridge'"),
        ("serial:///dev/ttyUSB0?baut=9600", "'baud'"),
        ("serial:///dev/ttyUSB0", "'baud'"),
        ("serial:///dev/ttyUSB0?baud=fast", "'baud'"),
        ("serial:///dev/ttyUSB0?baud=9600&parity=mark", "'odd'"),
        ("udp://192.168.1.1", "port"),
        ("udp://192.168.1.1:70000", "port"),
        ("spi://bridge/x?speed_hz=4400000&mode=4", "3"),
    ],
)
def test_an_error_names_what_is_wrong_or_expected(text, named):
    with pytest.raises(UsageError) as raised:
        open_link(text)
    assert named in str(raised.value)


@pytest.mark.parametrize(
    ("address", "named"),
    [
        ("serial:///dev/there-is-none?baud=9600", "list_ports"),
        ("can://slcan/dev/there-is-none?bitrate=1000000", "can://slcan//dev/ttyACM0"),
        ("can://slcan//dev/there?bitrte=1000000", "'bitrate'"),
        ("can://pcan/PCAN_USBBUS1", "can://pcan/PCAN_USBBUS1"),
    ],
)
def test_a_link_that_does_not_open_names_the_next_step(address, named):
    with pytest.raises((LinkError, UsageError)) as raised:
        open_link(address)
    assert named in str(raised.value)
