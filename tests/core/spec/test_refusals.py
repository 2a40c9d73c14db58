"""What declarations are taken and refused: every rule of a model by a case on either side of it."""

import pytest
from pydantic import ValidationError

from tactbench.core.errors import UsageError
from tactbench.core.spec.events import THRESHOLDS, SlipTarget, SlipThresholds
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig import Parameter
from tactbench.core.spec.rig_file import DeviceEntry, ForceEntry, RigFile
from tactbench.core.spec.scene import Indenter, Simulation, Slide, Surface
from tactbench.core.spec.sensor import ChannelSpec, DataSheet, Nuisances, PhysicalRange, SensorSpec, StreamSpec
from tactbench.core.spec.skin import SheetTable
from tactbench.core.spec.task import DeclaredTask
from tactbench.plugin import (
    ChannelTarget,
    EstimatorDescriptor,
    ForcePath,
    IndenterDescriptor,
    LabelTarget,
    Source,
    Summary,
    TaskSpec,
    VectorTarget,
)
from tests.core.evaluation.made import force_task, sensor
from tests.core.events.made import policy

WHY = Source(tag="assumed", reference="a test")
NAN = float("nan")


def q(value, unit="mm"):
    return assumed(value, unit, "a test")


def newtons(lower, upper, unit="N"):
    return PhysicalRange(lower=lower, upper=upper, unit=unit, source=WHY)


def axes(**second):
    """A stream of two channels of one site, of which the second differs by `second`."""
    place = {"kind": "taxel", "site": "a", "position_m": (0.0, 0.0, 0.1), "normal": (0.0, 0.0, 1.0)}
    channels = ChannelSpec(name="ax", **place), ChannelSpec(**{"name": "ay", **place, **second})
    return (StreamSpec(name="magnets", channels=channels),)


FORCE = force_task().model_dump(exclude_unset=True)
MEAN = Summary(measure="mean")
LABEL = {"kind": "classification", "metric": "macro_f1", "unit": "1", "target": LabelTarget(name="object")}
WHOLE = {**LABEL, "answer_per": "recording", "splits": ("session",)}
FRAMES = {
    **LABEL, "target": SlipTarget(hop_s=0.1, window_s=0.2), "answer_per": "frame", "summaries": (MEAN,), "splits": (),
}  # fmt: skip
EVENTS = {**FRAMES, "kind": "events", "metric": "recall_area", "alarms": policy(), "max_false_alarms_per_minute": 1.0}
PLACE = {"target": VectorTarget(names=("x", "y"), unit="mm"), "metric": "mean_euclidean_error"}
CHANNEL = {"source": "channel", "kind": "force", "name": "fz", "unit": "N"}
DEPTH = {"source": "label", "name": "depth", "unit": "mm"}

TAKEN_AND_REFUSED = [
    (SlipThresholds, THRESHOLDS.model_dump(), [{}, {"incipient_slip_share": 0.5, "gross_stick_ratio": 0.4}],
     [{"incipient_slip_share": 0.5, "gross_stick_ratio": 0.5}, {"incipient_slip_share": 0.95}]),
    (Parameter, {"default": 1.0, "unit": "mm", "text": "a size"},
     [{}, {"default": 0.0}, {"most": 1.0}, {"least": -2.0, "default": -1.0}],
     [{"default": -0.1}, {"most": 0.9}, {"default": NAN}, {"unit": "furlong"}, {"text": " a size"}]),
    (ForcePath, {"times_s": (0.0, 0.5, 1.0), "forces_n": (0.0, 3.0, 1.0), "samples": 100, "source": WHY}, [{}],
     [{"times_s": (0.0,), "forces_n": (0.0,)}, {"times_s": (0.1, 0.5, 1.0)}, {"times_s": (0.0, 0.5, 0.5)},
      {"times_s": (0.0, 1.0)}, {"forces_n": (0.0, -1.0, 0.0)}, {"forces_n": (0.0, NAN, 0.0)}]),
    (Indenter, {}, [{}, {"shape": "flat"}, {"shape": "cap", "radius": q(2)}, {"radius": q(2)},
                    {"shape": "cap", "dimensions": {"radius": q(2)}}, {"shape": "pin", "angle": q(30, "deg")}],
     [{"shape": "cap"}, {"shape": "flat", "radius": q(2)}, {"shape": "pin", "radius": q(2)},
      {"shape": "cap", "dimensions": {"radius": q(2), "a": q(2)}},
      {"dimensions": {"a": q(1)}}, {"radius": q(2), "angle": q(30, "deg")}, {"angle": q(30, "deg")}]),
    (Surface, {"static_friction": q(0.5, "1"), "kinetic_friction": q(0.5, "1")},
     [{}, {"kinetic_friction": q(0.0, "1")}, {"stribeck_speed": q(0, "mm/s"), "roughness": q(0), "hurst": q(1, "1")}],
     [{"kinetic_friction": q(0.6, "1")}, {"kinetic_friction": q(-0.1, "1")}, {"stribeck_speed": q(-1, "mm/s")},
      {"roughness": q(-1)}, {"roll_off": q(0)}, {"hurst": q(0, "1")}, {"hurst": q(1.1, "1")}]),
    (Slide, {"speed": q(5.0, "mm/s")}, [{}, {"start": q(0, "s"), "duration": q(1, "s")}],
     [{"speed": q(0, "mm/s")}, {"start": q(-1, "s")}, {"duration": q(0, "s")}]),
    (Simulation, {}, [{}, {"rung": "fine"}, {"tolerance": 1.0}, {"effects": ("+all", "-creep", "drift")}],
     [{"rung": "fine", "tolerance": 1.0}, {"effects": ("creep!",)}, {"tolerance": 0.0}, {"nuisances": {"a": NAN}}]),
    (Summary, {"measure": "mean"},
     [{}, {"start": 0.5}, {"measure": "band-energy", "band_hz": (0.5, 20)}],
     [{"start": 1.0}, {"end": 1.1}, {"band_hz": (5, 20)}, {"measure": "band-energy"},
      *({"measure": "band-energy", "band_hz": band} for band in ((0, 20), (20, 20), (20, 5)))]),
    (DeviceEntry, {"link": "emulated"}, [{}, {"faults": ("late",)}, {"link": "can0"}],
     [{"link": "can0", "faults": ("late",)}, {"link": ""}]),
    (ForceEntry, {"link": "can0", "device": "ati"}, [{}, {"sign": -1}], [{"sign": 0}, {"sign": 2}, {"range_n": 0.0}]),
    (ChannelSpec, {"name": "a", "kind": "taxel"},
     [{"sign": -1}, {"sign": 0}, {"sign": 1}], [{"sign": 2}, {"name": "1"}]),
    (RigFile, {"rig": "bench", "sensors": {"icub": {"link": "a"}}},
     [{}, {"version": 1}], [{"version": 2}, {"sensors": {}}]),
    (SheetTable, {"x_mm": (0, 1), "angle_deg": (0, 9, 18), "value_mm": ((1, 2, 3), (1, 2, 3)), "source": WHY}, [{}],
     [{"x_mm": (0, 1, 2)}, {"x_mm": (1, 1)}, {"angle_deg": (0, 9)}, {"angle_deg": (0, 9, 9)},
      {"x_mm": (), "value_mm": ()}, {"value_mm": ((1, 2, 3), (1, 2))}]),
    (Nuisances, {"warm_up_tau": q(1, "s"), "wander_tau": q(1, "s")},
     [{}, {"warm_up": q(1, "count"), "wander": q(1, "count")}, {"largest_slope": 3}], [{"wander_tau": q(1, "mm")}]),
    (Nuisances, {}, [{}], [{"warm_up": q(1, "count")}, {"wander": q(1, "count")}]),
    (DataSheet, {}, [{}, {"force_range": newtons(0, 10)}, {"force_range": newtons(1, 10, "mN")}],
     [{"force_range": newtons(-1, 10)}, {"force_range": newtons(10, 10)}, {"force_range": newtons(0, 1, "mm")}]),
    (SensorSpec, sensor().model_dump(exclude={"streams"}), [{"streams": axes()}],
     [{"streams": axes(position_m=(0.0, 0.0, 0.2))}, {"streams": axes(normal=(0.0, 1.0, 0.0))},
      {"streams": axes(position_m=None)}, {"streams": axes(name="ax")}, {"streams": axes() + axes(name="az")},
      {"streams": ()}]),
    (EstimatorDescriptor, {"name": "a", "title": "A", "kinds": ("events",), "where": "a:b"},
     [{}, {"kinds": ("regression",), "grid": {"a": (1,)}, "window_grid": (0, 5)}],
     [{"grid": {"a": (1,)}}, {"window_grid": (0, 5)}, {"where": "a"}, {"name": "A"}]),
    (IndenterDescriptor, {"name": "a", "title": "A", "where": "a:b"}, [{}],
     [{"dimensions": {"angle": Parameter(default=1.0, unit="deg", text="an angle")}}]),
    (TaskSpec, FORCE, [{}], [{"metric": "rsme"}, LABEL | {"target": FORCE["target"]}, {"summaries": (MEAN,)},
                             {"answer_per": "recording"}]),
    (TaskSpec, FORCE | PLACE, [{}], [{"kind": "classification"}, {"metric": "rmse"}, {"target": FORCE["target"]}]),
    (TaskSpec, FORCE | FRAMES, [{}],
     [{"answer_per": "sample"}, {"target": LabelTarget(name="a")}, {"summaries": ()},
      {"splits": ("in-session",)}, {"alarms": policy(), "max_false_alarms_per_minute": 1.0}]),
    (TaskSpec, FORCE | EVENTS, [{}], [{"alarms": None}, {"max_false_alarms_per_minute": None},
                                      {"target": LabelTarget(name="a"), "answer_per": "sample", "summaries": ()}]),
    (TaskSpec, FORCE | WHOLE,
     [{"summaries": (MEAN,)},
      {"summaries": (Summary(measure="mean", kinds=("ac_pressure",)),), "optional_features": ("ac_pressure",)}],
     [{}, {"summaries": (MEAN,), "splits": ("in-session",)},
      {"summaries": (MEAN,), "kind": "regression", "metric": "rmse", "target": ChannelTarget()},
      {"summaries": (Summary(measure="mean", kinds=("ac_pressure",)),)}]),
    (DeclaredTask, {"name": "push", "target": CHANNEL, "splits": ("session",)}, [{}, {"target": DEPTH}],
     [{"answer": "number"}, {"metric": "macro_f1"}, {"target": DEPTH, "metric": "rmse"}, {"frames_by": "os:system"},
      {"answer_per": "recording", "summaries": [MEAN]}, {"splits": ()}]),
]  # fmt: skip


@pytest.mark.parametrize(("model", "base", "taken", "refused"), TAKEN_AND_REFUSED)
def test_every_rule_takes_and_refuses_what_lies_beside_it(model, base, taken, refused):
    for change in taken:
        assert isinstance(model.model_validate({**base, **change}), model), change
    for change in refused:
        with pytest.raises((ValidationError, UsageError)):
            pytest.fail(f"taken: {model.model_validate({**base, **change})!r}")


def rig(**more):
    return RigFile.model_validate({"rig": "bench", "sensors": {"icub": {"link": "emulated"}}, **more})


def test_a_rig_file_is_for_one_rig_and_one_clock():
    real = {"force": {"link": "can0", "device": "ati"}, "devices": {"motor": {"link": "can1", "device": "faulhaber"}}}
    assert list(rig(**real).entries()) == ["icub", "force", "motor"]
    assert rig().checked_for("bench") == rig().checked_for_one_clock() == rig()
    all_real = rig(sensors={"icub": {"link": "can2"}}, **real)
    assert (rig(**real).emulated, all_real.emulated) == (True, False)
    assert all_real.checked_for_one_clock() is all_real
    with pytest.raises(UsageError, match="'bench'"):
        rig().checked_for("twin")
    with pytest.raises(UsageError, match="force, motor"):
        rig(**real).checked_for_one_clock()
