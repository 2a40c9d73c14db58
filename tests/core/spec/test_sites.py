"""Several channels at one place: the axes of one magnet are one taxel, not three."""

import pytest
from pydantic import ValidationError

from tactbench.core.report.datasheet import table_one
from tactbench.plugin import ChannelSpec, SensorSpec, Source, StreamSpec


def magnets(channels):
    stream = StreamSpec(name="magnets", channels=tuple(channels))
    assumed = Source(tag="assumed", reference="made for a test")
    return SensorSpec(name="pad", title="Pad", principle="magnetic", principle_source=assumed, streams=(stream,))


def axes(site, **more):
    return [ChannelSpec(name=f"{site}{axis}", kind="taxel", site=site, **more) for axis in "xyz"]


def test_axes_of_a_magnet_are_one_site():
    lone = ChannelSpec(name="lone", kind="taxel")
    warm = ChannelSpec(name="warm", kind="dc_temperature", site="a")
    sensor = magnets([*axes("a"), lone, *axes("b"), warm])
    assert [[one.name for one in site] for site in sensor.sites("taxel")] == [
        ["ax", "ay", "az"],
        ["lone"],
        ["bx", "by", "bz"],
    ]
    assert sum(map(len, sensor.sites())) == 8
    (row,) = [row for row in table_one([sensor]) if row.title == "# taxels"]
    assert row.facts[0].text == "3, of 7 channels"
    assert SensorSpec.model_validate_json(sensor.model_dump_json()).sites() == sensor.sites()


@pytest.mark.parametrize("field", ["position_m", "normal"])
def test_a_site_in_two_places_is_refused(field):
    elsewhere = ChannelSpec(name="at", kind="taxel", site="a", **{field: (0.0, 0.0, 1.0)})
    with pytest.raises(ValidationError, match="site a: the place of at is not that of ax"):
        magnets([*axes("a"), elsewhere])
