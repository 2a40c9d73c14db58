"""One scene on a rig into one file: everything the rig says is kept, and a rig that fails leaves nothing."""

import itertools
import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest

from tactbench.core.acquisition import acquire
from tactbench.core.errors import LinkUnplugged, RigError
from tactbench.core.recording.reader import content_digest, open_recording
from tactbench.core.recording.salvage import rescue
from tactbench.core.samples import Block
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import Source, assumed
from tactbench.core.spec.recording import PlanEntry, StreamClock, StreamCounts
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Indenter, Scene
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, StreamSpec

TAXELS = StreamSpec(name="taxels", dtype="uint16", channels=(ChannelSpec(name="t1", kind="taxel"),))
SOUND = StreamSpec(name="sound", channels=(ChannelSpec(name="pac", kind="ac_pressure"),))
FORCE = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
SENSOR = SensorDescriptor(
    spec=SensorSpec(
        name="pad", title="a pad", principle="capacitive", principle_source=Source(tag="assumed", reference="test"),
        streams=(TAXELS, SOUND),
    )
)  # fmt: skip
SCENE = Scene(
    name="cap", session="b", labels={"cap_radius_mm": 5.0}, indenter=Indenter(radius=assumed(5, "mm", "test")),
    profile=ForceRamp(samples=30),
)  # fmt: skip


class Weights:
    """A rig that puts weights on a sensor, one block each; what it drew is known only at the end."""

    streams = (TAXELS,)
    reference = (FORCE,)
    plan = (PlanEntry(effect="creep", included=False, reason="nobody looks"),)
    assumptions = {"weight_n": 0.5}  # noqa: RUF012

    def __init__(self, fails_at=None):
        self.fails_at = fails_at
        self.drawn = {}
        self.closed = False

    @contextmanager
    def open(self, sensor, scene, *, seed):
        self.rng = np.random.default_rng(seed)
        try:
            yield self
        finally:
            self.closed = True

    def __iter__(self):
        for number in range(3):
            if number == self.fails_at:
                raise RigError("the weight fell off", hint="Pick it up.")
            times = (np.arange(10) + 10 * number) * 1_000_000
            yield Block("taxels", times, self.rng.integers(0, 100, (10, 1)).astype(np.uint16))
            yield Block("force_torque", times, np.full((10, 1), 0.5 * number))
        self.drawn = {"offset_mm": 0.25}


def run(path, rig, *, simulated=True, clock=None, **more):
    descriptor = RigDescriptor(name="weights", title="weights", where="x:y", simulated=simulated)
    ticks = itertools.count()
    return acquire(rig, SENSOR, descriptor, SCENE, role="train", seed=7, path=path,
                   clock=clock or (lambda: float(next(ticks))), provenance={"tactbench": "1"}, **more)  # fmt: skip


def test_everything_the_rig_says_is_kept(tmp_path):
    rig = Weights()
    meta, digest = run(tmp_path / "r.h5", rig)
    with open_recording(tmp_path / "r.h5") as recording:
        recording.verify()
        assert recording.meta == meta
        assert recording.content_digest() == digest
        assert recording.stream_names == ("taxels", "force_torque")
        assert recording.read("force_torque").data[:, 0].tolist() == [0.0] * 10 + [0.5] * 10 + [1.0] * 10
        assert np.array_equal(
            recording.read("taxels").data, np.random.default_rng(7).integers(0, 100, (30, 1)).astype(np.uint16)
        )
    assert (meta.name, meta.session, meta.role, meta.seed) == ("cap", "b", "train", 7)
    assert (meta.rig, meta.simulated, meta.scene, meta.labels) == ("weights", True, SCENE, {"cap_radius_mm": 5.0})
    assert (meta.plan, meta.assumptions, meta.drawn) == (Weights.plan, {"weight_n": 0.5}, {"offset_mm": 0.25})
    assert meta.sensor.streams == (TAXELS,)  # only what was recorded
    assert (meta.clock, meta.clocks, meta.streams, meta.emulation) == ("simulated", {}, {}, None)
    assert rig.closed


@pytest.mark.parametrize("fails_at", [0, 2])
def test_a_rig_that_fails_leaves_nothing(tmp_path, fails_at):
    rig = Weights(fails_at)
    with pytest.raises(RigError, match="fell off"):
        run(tmp_path / "r.h5", rig)
    assert list(tmp_path.iterdir()) == []
    assert rig.closed


def test_the_seed_and_the_scene_decide_the_content_and_not_the_name(tmp_path):
    """What was computed on the way is provenance: it may differ in the last bit between processors."""

    class Elsewhere(Weights):
        plan = (PlanEntry(effect="creep", included=False, reason="nobody looks", change=1e-9),)

        def __iter__(self):
            yield from super().__iter__()
            self.drawn = {"solver_residual": 1e-9}

    digests = [run(tmp_path / f"{name}.h5", rig, name=name).content_digest
               for name, rig in (("a", Weights()), ("b", Weights()), ("c", Elsewhere()))]  # fmt: skip
    assert len(set(digests)) == 1


class Devices(Weights):
    """A rig of two devices: taxels with a clock of their own, half an hour behind the host's, and a polled force."""

    clocks = {  # noqa: RUF012
        "taxels": StreamClock(source="device", delay_ns=(200_000, 300_000), wraps=2),
        "force_torque": StreamClock(source="host"),
    }
    counts = {"pad crc errors": 1}  # noqa: RUF012
    emulation = None
    ended = ""

    def __init__(self, *, stops=None, emulation=None):
        super().__init__()
        self.stops, self.emulation = stops, emulation
        self.stream_counts = {}

    def __iter__(self):
        for number in range(20):
            device = (np.arange(10) + 10 * number) * 1_000_000
            late = self.rng.integers(0, 500_000, 10)
            yield Block("taxels", device + 1_800_000_000_000 + late, np.full((10, 1), number), device_ns=device)
            yield Block("force_torque", device + 1_800_000_000_000, np.full((10, 1), 0.5 * number))
            self.stream_counts = {"taxels": StreamCounts(received=10 * number + 12, dropped=2)}
            if number == 15 and isinstance(self.stops, str):
                self.ended = self.stops
                return
            if number == 15 and self.stops is not None:
                raise self.stops


def test_what_devices_say_is_recorded_and_times_are_the_hosts(tmp_path):
    seen = []
    meta, _ = run(tmp_path / "r.h5", Devices(), simulated=False, watch=seen.append)
    assert [block.stream for block in seen] == ["taxels", "force_torque"] * 20
    with open_recording(tmp_path / "r.h5") as recording:
        recording.verify()
        assert recording.meta == meta
        taxels, force = recording.read("taxels"), recording.read("force_torque")
    assert (meta.clock, meta.simulated, meta.emulation, meta.excluded) == ("host", False, None, "")
    assert meta.streams == {"taxels": StreamCounts(received=202, written=200, dropped=2)}
    assert meta.counts == {"pad crc errors": 1}
    clock = meta.clocks["taxels"]
    assert (clock.source, clock.method, clock.delay_ns, clock.wraps) == ("device", "hull-1way", (200_000, 300_000), 2)
    assert clock.segments[0].points == 200
    true = np.arange(200) * 1_000_000 + 1_800_000_000_000
    # 200 delays up to 0.5 ms: the two lowest on either side of the middle are some microseconds.
    assert np.abs(taxels.t_ns - true).max() < 100_000 <= np.abs(taxels.host_ns - true).max()
    assert np.array_equal(taxels.device_ns, np.arange(200) * 1_000_000)
    assert (force.device_ns, force.host_ns) == (None, None)
    assert np.array_equal(force.t_ns, true)


STOPS = [
    (KeyboardInterrupt(), KeyboardInterrupt, "stopped by hand"),
    (LinkUnplugged("the cable is gone"), LinkUnplugged, "the cable is gone"),
    (ValueError("a bug of the driver"), ValueError, "a bug of the driver"),
    ("the force sensor is unplugged", RigError, "the force sensor is unplugged"),
]


@pytest.mark.parametrize("complete", [True, False])
@pytest.mark.parametrize(("stops", "raised", "says"), STOPS)
def test_what_a_real_rig_had_recorded_is_kept(tmp_path, stops, raised, says, complete):
    """As a recording where that is asked for, or else as a journal that a command makes a recording of."""
    path = tmp_path / "r.h5"
    with pytest.raises(raised) as caught:
        run(path, Devices(stops=stops), simulated=False, complete_interrupted=complete)
    said = " ".join([str(caught.value), *getattr(caught.value, "__notes__", ())])
    if not complete:
        assert [one.name for one in tmp_path.iterdir()] == ["r.h5.partial"]
        assert "r.h5.partial --rescue" in said
        rescue(tmp_path / "r.h5.partial", path)
        (tmp_path / "r.h5.partial").unlink()
    assert [one.name for one in tmp_path.iterdir()] == ["r.h5"]
    with open_recording(path) as recording:
        recording.verify()
        meta = recording.meta
        assert len(recording.stream("taxels")) == 160
    assert meta.excluded.startswith("interrupted: ")
    assert says in meta.excluded
    assert any(says in remark for remark in meta.remarks)
    assert meta.clocks["taxels"].segments
    assert meta.streams["taxels"] == StreamCounts(received=162, written=160, dropped=2)
    assert meta.provenance["acquisition_s"] > 0


class Moving(Devices):
    """Also moves something: `left` is what it says once it was told to stop."""

    def __init__(self, kept, left="", **more):
        super().__init__(**more)
        self.kept, self.left, self.told = kept, left, []

    def stop(self, why):
        self.told.append((why, self.kept.exists()))
        return self.left


@pytest.mark.parametrize(("stops", "raised", "says"), STOPS)
def test_what_moves_is_stopped_before_anything_is_completed(tmp_path, stops, raised, says):
    rig = Moving(tmp_path / "kept.h5", stops=stops)
    with pytest.raises(raised):
        run(rig.kept, rig, simulated=False, complete_interrupted=True)
    ((why, kept),) = rig.told
    assert says in why
    assert not kept
    assert rig.kept.exists()


class Impatient(Moving):
    """Somebody presses Ctrl-C while it is told to stop, and again while its devices are let go of."""

    def stop(self, why):
        os.kill(os.getpid(), signal.SIGINT)
        return super().stop(why)

    @contextmanager
    def open(self, *arguments, **more):
        with super().open(*arguments, **more) as opened:
            yield opened
            os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize("stops", [None, LinkUnplugged("the cable is gone")])
def test_further_interrupts_do_not_cost_what_the_first_one_keeps(tmp_path, stops):
    rig = Impatient(tmp_path / "kept.h5", stops=stops)
    with pytest.raises(KeyboardInterrupt if stops is None else LinkUnplugged):
        run(rig.kept, rig, simulated=False, complete_interrupted=True,
            watch=None if stops else lambda block: os.kill(os.getpid(), signal.SIGINT))  # fmt: skip
    with open_recording(rig.kept) as recording:
        recording.verify()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_after_which_it_still_moves_is_an_error_that_says_so(tmp_path):
    rig = Moving(tmp_path / "kept.h5", "stand clear", stops=KeyboardInterrupt())
    with pytest.raises(RigError, match=r"interrupted, .* stand clear\."):
        run(rig.kept, rig, simulated=False, complete_interrupted=True)
    assert rig.kept.exists()


def test_interrupted_before_the_first_row_there_is_nothing_to_keep(tmp_path):
    with pytest.raises(RigError, match="fell off"):
        run(tmp_path / "r.h5", Weights(fails_at=0), simulated=False, complete_interrupted=True)
    assert list(tmp_path.iterdir()) == []


def test_a_simulation_says_the_same_whatever_number_of_threads_blas_was_started_with(tmp_path):
    digests = set()
    for threads in ("1", "2"):
        path = tmp_path / threads / "press.h5"
        env = {**os.environ, "OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads}
        command = [
            sys.executable,
            "-m",
            "tactbench",
            "record",
            "--sensor",
            "icub",
            "--indenter",
            "cap:radius=5",
            "--profile",
            "ramp:duration=10",
        ]
        subprocess.run([*command, "--out", path], env=env, check=True, capture_output=True)
        digests.add(content_digest(path))
    assert len(digests) == 1
