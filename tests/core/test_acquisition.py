"""One scene on a rig into one file: everything the rig says is kept, and a rig that fails leaves nothing."""

import os
import signal
from contextlib import contextmanager

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from tactbench.core.acquisition import acquire
from tactbench.core.errors import LinkUnplugged, RigError, UnwritableError
from tactbench.core.plugins.interfaces import RecordingRequest
from tactbench.core.recording.partial import rescue
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Block
from tactbench.core.spec.recording import INCOMPLETE, PlanEntry, StreamCounts
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import DeviceEntry, RigFile
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tests.core.evaluation.made import FORCE, ticking
from tests.core.pool.patience import files_up_to
from tests.core.recording.conftest import sensor

TAXELS = StreamSpec(name="taxels", dtype="uint16", rate_hz=1e3, channels=(ChannelSpec(name="t1", kind="taxel"),))
SOUND = StreamSpec(name="sound", channels=(ChannelSpec(name="pac", kind="ac_pressure"),))
FASTER = TAXELS.model_copy(update={"rate_hz": 2e3})
SENSOR = SensorDescriptor(spec=sensor().model_copy(update={"streams": (FASTER, SOUND)}))
SCENE = Scene(name="cap", session="b", labels={"cap_radius_mm": 5.0})


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


def run(path, rig, *, simulated=True, rig_file=None, **more):
    descriptor = RigDescriptor(name="weights", title="weights", where="x:y", simulated=simulated)
    request = RecordingRequest(SENSOR, descriptor, SCENE, path, 7, "train", rig_file, provenance={"tactbench": "1"})
    return acquire(rig, request, clock=ticking(), **more)


def opened(path):
    """Return the meta of a sound recording, its taxels and its force."""
    with open_recording(path) as recording:
        recording.verify()
        return recording.meta, recording.read("taxels"), recording.read("force_torque")


def test_everything_the_rig_says_is_kept(tmp_path):
    rig = Weights()
    meta = run(tmp_path / "r.h5", rig)
    read, taxels, force = opened(tmp_path / "r.h5")
    assert read == meta
    assert force.data[:, 0].tolist() == [0.0] * 10 + [0.5] * 10 + [1.0] * 10
    assert np.array_equal(taxels.data, np.random.default_rng(7).integers(0, 100, (30, 1)))
    assert (meta.name, meta.session, meta.role, meta.seed) == ("cap", "b", "train", 7)
    assert (meta.rig, meta.simulated, meta.scene, meta.labels) == ("weights", True, SCENE, {"cap_radius_mm": 5.0})
    assert (meta.plan, meta.assumptions, meta.drawn) == (Weights.plan, {"weight_n": 0.5}, {"offset_mm": 0.25})
    assert (meta.sensor.streams, meta.own_rates_hz) == ((TAXELS,), {"taxels": 2e3})  # as it was recorded
    assert (meta.clock, meta.clocks, meta.streams, meta.emulation) == ("simulated", {}, {}, None)
    assert rig.closed


@pytest.mark.parametrize(("fails_at", "simulated"), [(0, True), (2, True), (0, False)])
def test_a_simulation_that_fails_or_a_rig_before_its_first_row_leaves_nothing(tmp_path, fails_at, simulated):
    rig = Weights(fails_at)
    with pytest.raises(RigError, match="fell off"):
        run(tmp_path / "r.h5", rig, simulated=simulated, complete_interrupted=True)
    assert list(tmp_path.iterdir()) == []
    assert rig.closed


class Devices(Weights):
    """A rig of two devices that move: taxels with a clock of their own, half an hour behind the host's, and a force.

    When it is told to stop it notes whether `kept` is there already, and says what is `left` to do.
    """

    counts = {"pad crc errors": 1}  # noqa: RUF012
    ended = ""
    identity = {}  # noqa: RUF012

    def __init__(self, kept, stops=None, left=""):
        super().__init__()
        self.kept, self.stops, self.left = kept, stops, left
        self.stream_counts, self.told = {}, []

    def __iter__(self):
        for number in range(20):
            device = (np.arange(10) + 10 * number) * 1_000_000
            late = self.rng.integers(0, 500_000, 10)
            yield Block("taxels", device + 1_800_000_000_000 + late, np.full((10, 1), number), device_ns=device)
            yield Block("force_torque", device + 1_800_000_000_000, np.full((10, 1), 0.5 * number))
            self.stream_counts = {"taxels": StreamCounts(received=10 * number + 12, dropped=2)}
            self.drawn = dict(self.identity)
            if number == 15 and isinstance(self.stops, str):
                self.ended = self.stops
                return
            if number == 15 and self.stops is not None:
                raise self.stops

    def stop(self, why):
        self.told.append((why, self.kept.exists()))
        return self.left


def test_what_devices_say_is_recorded_and_times_are_the_hosts(tmp_path):
    path = tmp_path / "r.h5"
    run(path, Devices(path), simulated=False)
    meta, taxels, force = opened(path)
    assert (meta.clock, meta.simulated, meta.emulation, meta.excluded) == ("host", False, None, "")
    assert meta.streams == {"taxels": StreamCounts(received=202, written=200, dropped=2)}
    assert meta.counts == {"pad crc errors": 1}
    clock = meta.clocks["taxels"]
    assert (clock.source, clock.method, set(meta.clocks)) == ("device", "hull-1way", {"taxels"})
    true = np.arange(200) * 1_000_000 + 1_800_000_000_000
    # 200 delays up to 0.5 ms: the two lowest on either side of the middle are some microseconds.
    assert np.abs(taxels.t_ns - true).max() < 100_000 <= np.abs(taxels.host_ns - true).max()
    assert np.array_equal(force.t_ns, true)


@pytest.mark.parametrize(
    ("stops", "left", "raised", "says", "complete"),
    [
        (KeyboardInterrupt(), "", KeyboardInterrupt, "by hand", True),
        (KeyboardInterrupt(), "stand clear", RigError, "by hand", False),  # it still moves
        (LinkUnplugged("cable gone"), "", LinkUnplugged, "cable gone", True),
        (ValueError("driver bug"), "", ValueError, "driver bug", False),
    ],
)
def test_a_real_rig_is_stopped_and_then_what_it_had_recorded_is_kept(tmp_path, stops, left, raised, says, complete):
    """As a recording where that is asked for, or else as a journal that a command makes a recording of."""
    path, journal = tmp_path / "r.h5", tmp_path / "r.h5.partial"
    rig = Devices(path, stops, left)
    with pytest.raises(raised) as caught:
        run(path, rig, simulated=False, complete_interrupted=complete)
    assert left in str(caught.value)
    ((why, there_before),) = rig.told
    assert (says in why, there_before) == (True, False)
    assert list(tmp_path.iterdir()) == [path if complete else journal]
    if not complete:
        assert "--rescue" in f"{caught.value} {getattr(caught.value, '__notes__', '')}"
        rescue(journal, path)
    meta, taxels, _ = opened(path)
    assert len(taxels.data) == 160
    assert meta.excluded.startswith("interrupted: ")
    assert says in meta.excluded
    assert any(says in remark for remark in meta.remarks)
    assert meta.clocks["taxels"].segments
    assert meta.streams["taxels"] == StreamCounts(received=162, written=160, dropped=2)
    assert meta.provenance["acquisition_s"] > 0


@pytest.mark.skipif(os.name != "posix", reason="limits of files are POSIX")
@pytest.mark.parametrize(
    ("complete", "emulated", "left"), [(True, False, ""), (False, True, ""), (False, False, "stand clear")]
)
def test_a_full_disk_in_the_ramp_keeps_what_came_before(tmp_path, complete, emulated, left):
    path, journal = tmp_path / "r.h5", tmp_path / "r.h5.partial"
    entry = DeviceEntry(link="emulated")
    file = RigFile(rig="weights", sensors={SENSOR.name: entry}) if emulated else None
    rig = Devices(path, left=left)
    with files_up_to(12_000), pytest.raises(RigError if left else UnwritableError, match=left or "cannot be") as caught:
        run(path, rig, simulated=False, rig_file=file, complete_interrupted=complete)
    assert len(rig.told) == 1  # it was stopped
    assert "--rescue" in str(caught.value)
    assert list(tmp_path.iterdir()) == [journal]
    rescue(journal, path)
    meta, taxels, _ = opened(path)
    assert 0 < len(taxels.data) < 200
    assert meta.excluded.startswith("interrupted")


def test_a_scene_that_a_device_ended_is_kept_as_incomplete(tmp_path):
    path = tmp_path / "r.h5"
    rig = Devices(path, "force unplugged")
    made = run(path, rig, simulated=False)
    assert made.excluded.startswith(INCOMPLETE)
    assert made.excluded.endswith(": force unplugged")
    assert rig.told == [(made.excluded.removeprefix(INCOMPLETE), False)]  # stopped before it is written
    meta, taxels, _ = opened(path)
    assert (meta, len(taxels.data)) == (made, 160)
    with pytest.raises(RigError, match="stand clear"):
        run(tmp_path / "moving.h5", Devices(path, "force unplugged", "stand clear"), simulated=False)
    assert (tmp_path / "moving.h5").exists()


def test_what_is_emulated_is_marked_by_the_rig_file_or_the_identity_of_a_device(tmp_path):
    """A rig of others says nothing of emulation: over emulators its recordings were taken for real ones."""
    late = {SENSOR.name: DeviceEntry(link="emulated", faults=("late",)), "other": DeviceEntry(link="emulated")}
    virtual = RigFile(rig="weights", sensors=late, devices={"motor": {"device": "faulhaber", "link": "emulated"}})
    rig = Devices(tmp_path / "r.h5")
    made = run(tmp_path / "virtual.h5", rig, simulated=False, rig_file=virtual)
    assert (made.simulated, made.emulation.time) == (True, "virtual")
    assert made.emulation.faults == (f"{SENSOR.name}: late",)
    assert set(made.emulation.devices) == {SENSOR.name, "motor"}
    real = RigFile(rig="weights", sensors={SENSOR.name: DeviceEntry(link="can://virtual/there")})
    made = run(tmp_path / "real.h5", rig, simulated=False, rig_file=real)
    assert (made.simulated, made.emulation) == (False, None)
    rig.identity = {f"{SENSOR.name} adapter": "tactbench emulator"}
    made = run(tmp_path / "said.h5", rig, simulated=False, rig_file=real)
    assert made.emulation.devices == (SENSOR.name,)


class Impatient(Devices):
    """Somebody presses Ctrl-C while it is told to stop, and again while its devices are let go of."""

    def stop(self, why):
        os.kill(os.getpid(), signal.SIGINT)
        return super().stop(why)

    @contextmanager
    def open(self, *arguments, **more):
        with super().open(*arguments, **more) as opened:
            yield opened
            os.kill(os.getpid(), signal.SIGINT)


def test_further_interrupts_do_not_cost_what_the_first_one_keeps(tmp_path):
    path = tmp_path / "kept.h5"
    with pytest.raises(LinkUnplugged):
        run(path, Impatient(path, LinkUnplugged("the cable is gone")), simulated=False, complete_interrupted=True)
    opened(path)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_simulation_has_one_thread_whatever_number_blas_was_started_with(tmp_path):
    """Several threads sum in another order: the same seed would make other bytes on a machine with other processors."""

    class Counting(Weights):
        def __iter__(self):
            self.threads = {pool["num_threads"] for pool in threadpool_info()}
            return super().__iter__()

    rig = Counting()
    with threadpool_limits(2):
        run(tmp_path / "r.h5", rig)
    assert rig.threads == {1}
