"""A scene's numbers are looked at before anything is made of them."""

from __future__ import annotations

import math

import pytest

from tactbench.plugin import ForceRamp, Indenter, Placement, RigContext, RigError, Scene, assumed
from tactbench.plugin.simulation import Environment
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.preparation import MOST_SAMPLES, check_numbers
from tactbench.rigs.twin.rig import build


def _q(value, unit="s"):
    return assumed(value, unit, "test")


def test_an_ordinary_scene_passes():
    check_numbers(Scene(name="plain"))


def test_an_infinite_radius_is_a_flat_surface():
    check_numbers(Scene(name="flat", indenter=Indenter(radius=_q(math.inf, "mm"))))


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ({"profile": ForceRamp(duration=_q(math.nan))}, "profile duration"),
        ({"profile": ForceRamp(end=_q(-1.0, "N"))}, "profile end"),
        ({"placement": Placement(scatter=_q(-0.1, "mm"))}, "placement scatter"),
        ({"placement": Placement(x=_q(math.inf, "mm"))}, "placement x"),
        ({"environment": Environment(force_noise=_q(math.nan, "N"))}, "environment force noise"),
        ({"environment": Environment(noise_scale=math.inf)}, "environment noise scale"),
        ({"indenter": Indenter(radius=_q(-math.inf, "mm"))}, "indenter radius"),
        ({"profile": ForceRamp(samples=MOST_SAMPLES + 1)}, "samples"),
    ],
)
def test_a_number_that_is_none_is_named(part, says):
    with pytest.raises(RigError, match=says) as refused:
        check_numbers(Scene(name="odd", **part))
    assert refused.value.hint


def test_the_clock_of_a_stream_nobody_observes_is_not_made(sensors):
    # 11 days: 2e9 samples of the BioTac's vibration at 2200 Hz, which no memory holds; its electrodes have ten.
    profile = ForceRamp(duration=_q(1e6), hold=_q(0.0), end=_q(0.0, "N"), samples=10)
    rig = build(RigContext(effects=tuple(tactbench_effects())))
    with rig.open(sensors["biotac"], Scene(name="long", profile=profile), seed=1) as acquisition:
        assert {samples.t_ns.size for samples in acquisition.samples.values()} == {10}
