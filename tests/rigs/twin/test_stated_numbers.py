"""A scene's numbers are looked at before anything is made of them."""

from __future__ import annotations

import math

import pytest

from tactbench.core.spec.scene import ForceLoop
from tactbench.plugin import ForceRamp, Indenter, RigError, Scene
from tactbench.rigs.twin.planner import MOST_SAMPLES, check_numbers
from tests.rigs.twin.conftest import TWIN, q


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ({"profile": ForceRamp(samples=MOST_SAMPLES + 1)}, "samples"),
        ({"drive": ForceLoop(delay=q(-1.0, "ms"))}, "drive delay"),
    ],
)
def test_a_number_that_is_none_is_named(part, says):
    check_numbers(Scene(name="flat", indenter=Indenter(radius=q(math.inf))))
    with pytest.raises(RigError, match=says):
        check_numbers(Scene(name="odd", **part))


def test_the_clock_of_a_stream_nobody_observes_is_not_made(sensors):
    # 11 days: 2e9 samples of the BioTac's vibration at 2200 Hz, which no memory holds; its electrodes have ten.
    profile = ForceRamp(duration=q(1e6, "s"), hold=q(0.0, "s"), end=q(0.0, "N"), samples=10)
    with TWIN.open(sensors["biotac"], Scene(name="long", profile=profile), seed=1) as acquisition:
        assert {samples.t_ns.size for samples in acquisition.samples.values()} == {10}
