"""Several channels at one place are one taxel, and figures of real units are no part of what is recorded."""

from tactbench.core.report.datasheet import OF_DEVICES
from tactbench.core.spec.scene import RANGES, Scene
from tactbench.plugin import (
    ChannelSpec,
    SensorSpec,
    StreamSpec,
    load_registry,
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


def test_ranges_are_of_known_nuisances_and_hold_what_is_stated():
    for descriptor in load_registry().sensors:
        spec = descriptor.spec
        stated = {**Scene(name="s").nuisances(), **{name: one.value for name, one in spec.settable().items()}}
        stated = {"offset_scale": 1.0, **stated}
        for name, one in {**RANGES, **spec.ranges}.items():
            assert one.lower <= stated[name] <= one.upper, (spec.name, name)
            assert one.lower < one.upper
        assert "ranges" not in spec.model_dump()


def test_every_fact_of_a_data_sheet_has_a_source_and_no_sample_depends_on_it():
    for descriptor in load_registry().sensors:
        spec = descriptor.spec
        assert "data_sheet" not in spec.model_dump()
        for name in OF_DEVICES:
            fact = getattr(spec.data_sheet, name)
            assert fact is None or (fact.source.tag in ("sourced", "derived", "measured") and fact.source.reference)
