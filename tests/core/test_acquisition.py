"""One scene on a rig into one file: everything the rig says is kept, and a rig that fails leaves nothing."""

import itertools
from contextlib import contextmanager

import numpy as np
import pytest

from tactbench.core.acquisition import acquire
from tactbench.core.errors import RigError
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Block
from tactbench.core.spec.quantity import Source, assumed
from tactbench.core.spec.recording import PlanEntry
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import ForceRamp, Indenter, Scene
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


def run(path, rig, *, simulated=True, clock=None):
    descriptor = RigDescriptor(name="weights", title="weights", where="x:y", simulated=simulated)
    ticks = itertools.count()
    return acquire(rig, SENSOR, descriptor, SCENE, role="train", seed=7, path=path,
                   clock=clock or (lambda: float(next(ticks))), provenance={"tactbench": "1"})  # fmt: skip


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
    assert rig.closed


def test_what_a_rig_remarks_is_shown_with_every_score(tmp_path):
    class Remarks(Weights):
        def __iter__(self):
            yield from super().__iter__()
            self.drawn = {"remark load": "50 N is too much", "remarkable": 1.0, "offset_mm": 0.25}

    meta, _ = run(tmp_path / "r.h5", Remarks())
    assert meta.remarks == ("50 N is too much",)


def test_the_cost_is_the_rigs_alone(tmp_path):
    """Time passes only inside the rig here: opening takes 1 s, each of six blocks 10 s, writing none."""
    now = [0.0]

    class Slow(Weights):
        @contextmanager
        def open(self, sensor, scene, *, seed):
            now[0] += 1
            with super().open(sensor, scene, seed=seed) as acquisition:
                yield acquisition

        def __iter__(self):
            for block in super().__iter__():
                now[0] += 10
                yield block

    assert run(tmp_path / "a.h5", Slow(), clock=lambda: now[0]).meta.provenance == {"tactbench": "1", "sim_s": 61.0}
    made = run(tmp_path / "b.h5", Slow(), clock=lambda: now[0], simulated=False)
    assert made.meta.provenance["acquisition_s"] == 61.0


@pytest.mark.parametrize("fails_at", [0, 2])
def test_a_rig_that_fails_leaves_nothing(tmp_path, fails_at):
    rig = Weights(fails_at)
    with pytest.raises(RigError, match="fell off"):
        run(tmp_path / "r.h5", rig)
    assert list(tmp_path.iterdir()) == []
    assert rig.closed


def test_the_same_seed_says_the_same(tmp_path):
    for name in ("a", "b"):
        run(tmp_path / f"{name}.h5", Weights())
    with open_recording(tmp_path / "a.h5") as a, open_recording(tmp_path / "b.h5") as b:
        assert a.content_digest() == b.content_digest()
