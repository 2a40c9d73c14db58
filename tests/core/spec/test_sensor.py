"""Several channels at one place are one taxel, and figures of real units are no part of what is recorded."""

import pytest
from pydantic import ValidationError

from tactbench.core.report.datasheet import OF_DEVICES, table_one
from tactbench.plugin import (
    ChannelSpec,
    DataSheet,
    PhysicalRange,
    SensorSpec,
    Source,
    StreamSpec,
    load_registry,
    sourced,
)
from tests.core.evaluation.made import sensor


def magnets(*channels):
    given = sensor().model_dump(exclude={"streams"})
    return SensorSpec(**given, streams=(StreamSpec(name="magnets", channels=channels),))


def axes(site):
    return [ChannelSpec(name=f"{site}{axis}", kind="taxel", site=site) for axis in "xyz"]


def test_axes_of_a_magnet_are_one_site():
    lone = ChannelSpec(name="lone", kind="taxel")
    warm = ChannelSpec(name="warm", kind="dc_temperature", site="a")
    pad = magnets(*axes("a"), lone, *axes("b"), warm)
    sites = [[one.name for one in site] for site in pad.sites("taxel")]
    assert sites == [["ax", "ay", "az"], ["lone"], ["bx", "by", "bz"]]
    assert sum(map(len, pad.sites())) == 8
    (row,) = [row for row in table_one([pad]) if row.title == "# taxels"]
    assert row.facts[0].text == "3, of 7 channels"


@pytest.mark.parametrize("field", ["position_m", "normal"])
def test_a_site_in_two_places_is_refused(field):
    elsewhere = ChannelSpec(name="at", kind="taxel", site="a", **{field: (0.0, 0.0, 1.0)})
    with pytest.raises(ValidationError, match="site a: the place of at is not that of ax"):
        magnets(*axes("a"), elsewhere)


def test_every_fact_of_a_data_sheet_has_a_source_and_no_sample_depends_on_it():
    for descriptor in load_registry().sensors:
        spec = descriptor.spec
        assert "data_sheet" not in spec.model_dump()
        for name in OF_DEVICES:
            fact = getattr(spec.data_sheet, name)
            assert fact is None or (fact.source.tag in ("sourced", "derived", "measured") and fact.source.reference)


def test_a_data_sheet_refuses_what_cannot_be():
    with pytest.raises(ValueError, match="measure different things"):
        DataSheet(mass=sourced(3.0, "mm", "a test"))
    source = Source(tag="sourced", reference="a test")
    with pytest.raises(ValueError, match="larger force"):
        DataSheet(force_range=PhysicalRange(lower=5.0, upper=1.0, unit="N", source=source))
