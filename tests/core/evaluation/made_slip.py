"""Recordings of slips and of disturbances, made by hand in real files."""

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec

from .made import sensor_of, write

FORCES = tuple(ChannelSpec(name=name, kind="force", unit="N") for name in ("normal", "tangential"))
SLIP = ChannelSpec(name="slip", kind="position", unit="m")
REFERENCE = StreamSpec(name="reference", rate_hz=500.0, channels=(*FORCES, SLIP))
ONSET_S, END_S = 2.0, 4.0


def sensor(vibration=True):
    taxels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(2))
    pac = StreamSpec(name="pac", rate_hz=2000.0, channels=(ChannelSpec(name="pac", kind="ac_pressure"),))
    return sensor_of(StreamSpec(name="taxels", rate_hz=100.0, channels=taxels), *([pac] if vibration else []))


def clock(rate_hz, length_s=END_S):
    return np.round(np.arange(0.0, length_s, 1 / rate_hz) * 1e9).astype(np.int64)


def record(path, *, slips, seed, vibration=True, reference=True, loud=5.0, tapped=1.0, friction=0.5, **meta):
    """Write a recording that slips at 10 mm/s from 2 s on, or is tapped at 3 s.

    Vibration rises `loud`-fold while it slips, `tapped`-fold for 0.2 s when it is tapped.
    """
    rng = np.random.default_rng(seed)
    labels = {"event": "slip" if slips else "disturbance", "friction_coefficient": friction}
    blocks = []
    for stream in sensor(vibration).streams:
        t_ns = clock(stream.rate_hz)
        size = 1.0 + (loud - 1.0) * (slips & (t_ns >= ONSET_S * 1e9))
        size += (tapped - 1.0) * ((not slips) & (np.abs(t_ns * 1e-9 - 3.1) < 0.1))
        noise = rng.normal(size=(len(t_ns), len(stream.channels)))
        blocks.append(Block(stream.name, t_ns, noise * size[:, None]))
    if reference:
        t_ns = clock(500.0)
        slipping = np.maximum(t_ns * 1e-9 - ONSET_S, 0.0) * slips
        tangential = np.where(slipping > 0, 0.499, np.minimum(0.5 * t_ns * 1e-9 / ONSET_S, 0.45) * slips)
        blocks.append(Block("reference", t_ns, np.column_stack([np.ones(len(t_ns)), tangential, 0.01 * slipping])))
    streams = (REFERENCE,) if reference else ()
    return write(path, sensor(vibration), *blocks, reference=streams, labels=labels, **meta)


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
