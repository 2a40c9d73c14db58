"""SPI of the machine itself."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from tactbench.links.spi_link import SpidevLink
from tactbench.plugin.devices import LinkError


def test_a_missing_package_is_named():
    if importlib.util.find_spec("spidev"):
        pytest.skip("spidev is installed")
    with pytest.raises(LinkError, match=r"pip install 'tactbench\[spi\]'"):
        SpidevLink("0.0", speed_hz=4_400_000)


def test_a_device_that_is_not_there_does_not_open():
    pytest.importorskip("spidev", reason="spidev is not installed")
    if Path("/dev/spidev9.9").exists():
        pytest.skip("there is a /dev/spidev9.9")
    with pytest.raises(LinkError, match="cannot be opened"):
        SpidevLink("9.9", speed_hz=4_400_000)
