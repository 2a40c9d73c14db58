"""Recordings of slips and of disturbances, made by hand in real files."""

import numpy as np

from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import Block, ChannelSpec, SensorSpec, Source, StreamSpec

REFERENCE = StreamSpec(
    name="reference",
    rate_hz=500.0,
    channels=(
        ChannelSpec(name="normal", kind="force", unit="N"),
        ChannelSpec(name="tangential", kind="force", unit="N"),
        ChannelSpec(name="slip", kind="position", unit="m"),
    ),
)
ONSET_S, END_S = 2.0, 4.0


def sensor(vibration=True):
    taxels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(2))
    streams = [StreamSpec(name="taxels", rate_hz=100.0, channels=taxels)]
    if vibration:
        streams.append(StreamSpec(name="pac", rate_hz=2000.0, channels=(ChannelSpec(name="pac", kind="ac_pressure"),)))
    return SensorSpec(
        name="made", title="Made by hand", principle="none",
        principle_source=Source(tag="assumed", reference="a test"), streams=tuple(streams),
    )  # fmt: skip


def clock(rate_hz, length_s=END_S):
    return np.round(np.arange(0.0, length_s, 1 / rate_hz) * 1e9).astype(np.int64)


def record(path, *, slips, seed, vibration=True, reference=True, loud=5.0, mu=0.5, **meta):
    """Write a recording that slips at 10 mm/s from 2 s on, or is tapped; vibration rises `loud`-fold while it slips."""
    rng = np.random.default_rng(seed)
    streams = (REFERENCE,) if reference else ()
    labels = {"event": "slip" if slips else "disturbance", "friction_coefficient": mu, **meta.pop("labels", {})}
    about = RecordingMeta(
        name=path.stem, sensor=sensor(vibration), reference=streams, rig="made", clock="device", labels=labels, **meta
    )
    with RecordingWriter(path, about) as writer:
        for name, rate_hz, width in (("taxels", 100.0, 2), *((("pac", 2000.0, 1),) if vibration else ())):
            t_ns = clock(rate_hz)
            size = 1.0 + (loud - 1.0) * (slips & (t_ns >= ONSET_S * 1e9))
            writer.append(Block(name, t_ns, rng.normal(size=(len(t_ns), width)) * size[:, None]))
        if reference:
            t_ns = clock(500.0)
            slipping = np.maximum(t_ns * 1e-9 - ONSET_S, 0.0) * slips
            normal = np.full(len(t_ns), 1.0)
            tangential = np.where(slipping > 0, 0.499, np.minimum(0.5 * t_ns * 1e-9 / ONSET_S, 0.45) * slips)
            writer.append(Block("reference", t_ns, np.column_stack([normal, tangential, 0.01 * slipping])))
    return path


def campaign(folder, roles=("train", "validation", "test"), number=3, **more):
    paths = []
    for order, role in enumerate(roles):
        for place in range(number):
            for slips in (True, False):
                name = f"{role}-{place}-{'slip' if slips else 'tap'}.h5"
                seed = 1000 * order + 10 * place + slips
                about = {"role": role, "session": role, **more}
                paths.append(record(folder / name, slips=slips, seed=seed, **about))
    return paths
