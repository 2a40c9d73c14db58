"""The bench: what emulated devices sense arrives in the recording by their bytes, and whatever goes wrong is marked."""

from __future__ import annotations

import numpy as np
import pytest

from tactbench.core.acquisition import acquire
from tactbench.core.errors import DataError, RigError, UsageError
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.recording.reader import open_recording
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig_file import Allowed, DeviceEntry, EmulationSettings, ForceEntry
from tactbench.devices.emulation.real_time import RealTimeDevices
from tactbench.plugin import ForceRamp, Quality, RigContext, Scene, load_object, load_registry
from tactbench.plugin.devices import NamedDevice, RigFile, emulators_of
from tests.devices.emulating import emulating

REGISTRY = load_registry()
SECONDS = 2.0
TASK = REGISTRY.tasks["force"].spec
SCENE = Scene(
    name="press",
    profile=ForceRamp(
        duration=assumed(SECONDS, "s", "short"), hold=assumed(0.5, "s", "short"), samples=round(100 * SECONDS)
    ),
)


def rig_file(sensor="icub", faults=(), force_faults=(), seed=1, **force) -> RigFile:
    return RigFile(
        rig="bench",
        sensors={sensor: DeviceEntry(link="emulated", faults=faults)},
        force=ForceEntry(device="net-ft", link="emulated", faults=force_faults, **{"zero_s": 0.5, **force}),
        emulation=EmulationSettings(seed=seed),
    )


def bench(file, operator=None):
    context = RigContext(effects=tuple(REGISTRY.effects), rig_file=file, operator=operator)
    return load_object(REGISTRY.rigs["bench"].where)(context)


def press(path, file, sensor="icub", scene=SCENE, operator=None):
    """Record one scene; return its path and the error that ended it, if one did."""
    error = None
    try:
        request = RecordingRequest(REGISTRY.sensors[sensor], REGISTRY.rigs["bench"], scene, path, seed=7, rig_file=file)
        acquire(bench(file, operator), request, clock=lambda: 0.0, complete_interrupted=True)
    except RigError as raised:
        error = raised
    return error


def read(path):
    """Return a recording's meta and streams; it is whole, whatever happened."""
    with open_recording(path) as recording:
        recording.verify()
        return recording.meta, {name: recording.read(name) for name in recording.stream_names}


def simulated(sensor="icub"):
    """Return what the twin says of the same scene: by stream times [ns], data and channels."""
    twin = load_object(REGISTRY.rigs["twin"].where)(RigContext(effects=tuple(REGISTRY.effects)))
    with twin.open(REGISTRY.sensors[sensor], SCENE, seed=7) as acquisition:
        blocks = list(acquisition)
        specs = {spec.name: spec for spec in (*acquisition.streams, *acquisition.reference)}
    return {
        name: (
            np.concatenate([block.t_ns for block in blocks if block.stream == name]),
            np.concatenate([block.data for block in blocks if block.stream == name]),
            [channel.name for channel in spec.channels],
        )
        for name, spec in specs.items()
    }


@pytest.mark.parametrize("sensor", ["icub", "biotac"])
def test_the_bytes_carry_what_the_twin_computed(tmp_path, sensor):
    """Every row is a sample of the twin, not later than the row and at most a sample's distance before it."""
    assert press(tmp_path / "p.h5", rig_file(sensor), sensor) is None
    meta, streams = read(tmp_path / "p.h5")
    assert (meta.simulated, meta.emulation.time, meta.clock) == (True, "virtual", "simulated")
    assert set(meta.emulation.devices) == {sensor, "force"}
    name = "taxels" if sensor == "icub" else "electrodes"
    times, data, channels = simulated(sensor)[name]
    stream = streams[name]
    mine = [[channel.name for channel in stream.spec.channels].index(channel) for channel in channels]
    rows = stream.data[:, mine].astype(float)
    # When the scene began on the recording's clock is not written down; the force tells it to a sample.
    begin = stream.t_ns[0]
    steps = np.diff(times).max()
    found = 0
    for t, row in list(zip(stream.t_ns - begin, rows, strict=True))[9:]:  # the BioTac is asked for eight frames ahead
        near = (times > t - 3 * steps) & (times < t + 3 * steps)
        found += bool((data[near] == row).all(axis=1).any()) if sensor == "icub" else 1
        assert (np.abs(data[near] - row).min(axis=0) <= 0.5).all()
    assert found > 0.9 * len(rows)
    pressing = streams["force_torque"].data[:, 2]
    # 5 N at the end, .7 N of noise held for a hundredth of a second: a tenth of a second has ten samples.
    assert pressing[-150:-50].mean() == pytest.approx(4.7, abs=1.0)
    assert meta.streams[name].received == meta.streams[name].written == len(rows)


def test_the_same_seed_gives_the_same_recording_and_another_does_not(tmp_path):
    for name, seed in (("a", 1), ("b", 1)):
        assert press(tmp_path / f"{name}.h5", rig_file(seed=seed, faults=("late-answer:every=7",))) is None
    (_, first), (_, second) = read(tmp_path / "a.h5"), read(tmp_path / "b.h5")
    for name, stream in first.items():
        assert np.array_equal(stream.data, second[name].data)
        assert np.array_equal(stream.t_ns, second[name].t_ns)


def marked(stream, quality):
    return int((stream.quality & quality).any(axis=1).sum()) if stream.quality is not None else 0


FAULTS = [
    ("icub", "dropped-frame:half=tail,every=10", "taxels", Quality.MISSING),
    ("icub", "not-connected:start_s=1.5", "taxels", Quality.MISSING),
    ("biotac", "parity:every=51", "electrodes", Quality.SUSPECT),
]


@pytest.mark.parametrize(("sensor", "fault", "stream", "quality"), FAULTS)
def test_faults_of_a_sensor_are_marked_and_counted_and_the_recording_is_valid(tmp_path, sensor, fault, stream, quality):
    assert press(tmp_path / "p.h5", rig_file(sensor, faults=(fault,)), sensor) is None
    meta, streams = read(tmp_path / "p.h5")
    assert 0 < marked(streams[stream], quality) < len(streams[stream].data)
    assert any(name.startswith(f"{sensor}: ") and count for name, count in meta.counts.items())
    assert meta.emulation.faults == (f"{sensor}: {fault}",)
    assert not meta.excluded


@pytest.mark.parametrize(
    ("fault", "field"),
    [("dropped:every=100", "gaps"), ("doubled:every=100", "duplicates"), ("out-of-order:every=100", "late")],
)
def test_losses_of_the_force_sensor_are_counted_and_gaps_marked(tmp_path, fault, field):
    assert press(tmp_path / "p.h5", rig_file(force_faults=(fault,))) is None
    meta, streams = read(tmp_path / "p.h5")
    counts, force = meta.streams["force_torque"], streams["force_torque"]
    assert getattr(counts, field) == pytest.approx(10 * SECONDS, abs=2)
    assert counts.received == counts.written + counts.dropped + counts.duplicates + counts.late
    assert counts.written == len(force.data)
    assert marked(force, Quality.GAP) == counts.gaps
    assert np.all(np.diff(force.sequence) > 0)


@pytest.mark.parametrize("part", ["sensor", "force"])
def test_a_pulled_cable_ends_the_scene_and_keeps_what_there_is(tmp_path, part):
    faults = {"faults" if part == "sensor" else "force_faults": ("unplug:start_s=2.0",)}
    assert press(tmp_path / "p.h5", rig_file(**faults)) is None
    meta, streams = read(tmp_path / "p.h5")
    assert meta.excluded.startswith("incomplete")
    assert "gone" in meta.excluded
    assert 10 < len(streams["taxels"].data) < 50 * SECONDS


@pytest.mark.parametrize(
    ("part", "fault", "stream"),
    [("force", "dropped:start_s=1.2", "force_torque"), ("sensor", "dropped-frame:start_s=1.2", "taxels")],
)
def test_a_device_that_falls_silent_ends_the_scene_and_the_recording_is_incomplete(tmp_path, part, fault, stream):
    """Also the force sensor: recordings that lack it were evaluated as whole ones."""
    file = rig_file(**{"faults" if part == "sensor" else "force_faults": (fault,)})
    file = file.model_copy(update={"allowed": Allowed(silent_s=0.3)})
    assert press(tmp_path / "p.h5", file) is None
    meta, streams = read(tmp_path / "p.h5")
    assert meta.excluded.startswith("incomplete")
    assert f" {stream} came for 0.3" in meta.excluded
    assert len(streams["taxels"].data) < 40 * SECONDS  # the scene ended
    with pytest.raises(DataError, match=f"1 recordings.*{stream}"):
        load_dataset(TASK, [tmp_path / "p.h5"])
    assert load_dataset(TASK, [tmp_path / "p.h5"], include_incomplete=True).metas == (meta,)


def test_losses_beyond_what_is_allowed_make_it_incomplete(tmp_path):
    assert press(tmp_path / "p.h5", rig_file(force_faults=("dropped:every=20",))) is None
    meta, _ = read(tmp_path / "p.h5")
    assert meta.excluded.startswith("incomplete: force_torque")


def test_a_sensor_that_sends_nothing_is_an_error_and_the_recording_left_out_of_every_evaluation(tmp_path):
    file = rig_file(faults=("dropped-frame:start_s=0.5",)).model_copy(update={"allowed": Allowed(silent_s=0.2)})
    error = press(tmp_path / "p.h5", file)
    assert error is not None
    assert "taxels" in error.message
    meta, streams = read(tmp_path / "p.h5")
    assert meta.excluded.startswith("interrupted")
    assert set(streams) == {"force_torque"}


def test_a_force_sensor_mounted_the_other_way_gives_the_same_force(tmp_path):
    assert press(tmp_path / "a.h5", rig_file(force_faults=())) is None
    assert press(tmp_path / "b.h5", rig_file(channel="fx", sign=-1)) is None
    (_, plain), (meta, turned) = read(tmp_path / "a.h5"), read(tmp_path / "b.h5")
    held = plain["force_torque"].data[:400, 2]
    assert abs(held.mean()) < 0.5  # .7 N of noise, held for a hundredth of a second: some 50 samples
    assert len(meta.drawn["zero of force_torque"].split(", ")) == 6
    names = [channel.name for channel in turned["force_torque"].spec.channels]
    assert names == ["normal", "fy", "fz", "tx", "ty", "tz"]
    assert np.abs(turned["force_torque"].data[:, 0] - plain["force_torque"].data[:, 2]).max() <= 3e-6
    assert meta.drawn["normal force"] == "-fx of net-ft"


class Somebody:
    """An operator who follows and keeps all prompts."""

    def __init__(self):
        self.told = []

    def prompt(self, text):
        self.told.append(text)


def test_the_steps_are_prompted_in_order_and_a_loaded_force_sensor_gets_no_zero(tmp_path):
    """Hands off, the zero, press now: the zero was taken after the prompt to press, from a hand that pressed."""
    somebody = Somebody()
    file = rig_file()
    with RealTimeDevices(emulators_of(file, REGISTRY, "icub", lambda t_s: {"fz": 4.09})) as loaded:
        counts = {"counts_per_newton": 1e6, "counts_per_newton_metre": 1e6}
        entries = {name: {"link": address, "emulator": True} for name, address in loaded.addresses.items()}
        entries["force"]["options"] = counts
        there = file.model_copy(
            update={
                "sensors": {"icub": file.sensors["icub"].model_copy(update=entries["icub"])},
                "force": file.force.model_copy(update=entries["force"]),
            }
        )
        error = press(tmp_path / "p.h5", there, operator=somebody)
        assert error is not None
        assert "4.09 N" in error.message
        assert len(somebody.told) == 1
        low = there.model_copy(update={"force": there.force.model_copy(update={"largest_zero_n": 5.0})})
        assert press(tmp_path / "p.h5", low, operator=somebody) is None
    assert [("hands off" in text, "Press now" in text) for text in somebody.told[1:]] == [(True, False), (False, True)]
    assert "4.09 N" in somebody.told[-1]
    assert read(tmp_path / "p.h5")[0].emulation.devices == ("icub", "force")


def test_what_cannot_be_is_refused_with_the_next_step(tmp_path):
    with pytest.raises(UsageError, match="--rig-file"):
        bench(None)
    with pytest.raises(UsageError, match="'biotac'"):
        press(tmp_path / "p.h5", rig_file("icub"), "biotac")
    with pytest.raises(UsageError, match="'fq'"):
        press(tmp_path / "p.h5", rig_file(channel="fq"))
    motor = NamedDevice(device="faulhaber", link="emulated")
    with pytest.raises(UsageError, match="motor"):
        bench(rig_file().model_copy(update={"devices": {"motor": motor}}))
    with pytest.raises(UsageError, match="replay"):
        bench(rig_file().model_copy(update={"emulation": EmulationSettings(physics="replay")}))
    mixed = rig_file()
    with pytest.raises(UsageError, match="icub"):
        press(
            tmp_path / "p.h5",
            mixed.model_copy(update={"sensors": {"icub": DeviceEntry(link="can://virtual/mixed")}}),
        )
    assert list(tmp_path.iterdir()) == []


def test_in_real_time_nothing_is_lost_and_the_recording_says_so(tmp_path):
    with emulating(rig_file(zero_s=0.1), tmp_path) as file:
        assert press(tmp_path / "p.h5", file) is None
    meta, streams = read(tmp_path / "p.h5")
    assert (meta.clock, meta.emulation.time, meta.simulated) == ("host", "real", True)
    assert meta.emulation.factor == pytest.approx(1.0, abs=0.2)
    assert len(streams["force_torque"].data) == pytest.approx(1000 * SECONDS, rel=0.1)
    assert meta.clocks["force_torque"].method == "hull-1way"
