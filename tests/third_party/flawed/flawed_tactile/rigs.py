"""Rigs that ramp a force, with one flaw each."""

from contextlib import contextmanager

import numpy as np

from tactbench.plugin import Block, ChannelSpec, PlanEntry, RigDescriptor, StreamSpec, hookimpl

TACTBENCH_API = 2
RATE_HZ = 100.0
FORCE = StreamSpec(
    name="force_torque", rate_hz=RATE_HZ, channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1),)
)
FLAWS = (
    "that-is-none", "that-breaks", "with-a-column-too-many", "whose-clock-goes-back", "at-another-rate", "of-nan",
    "beyond-the-limits", "with-a-generator-of-its-own", "deaf-to-the-seed", "whose-force-has-no-kind", "in-grams",
    "that-pulls", "that-changes-the-scene", "without-reasons", "that-gives-fractions",
)  # fmt: skip


class Ramp:
    """A sound acquisition."""

    def __init__(self, sensor, scene, seed, flaw):
        self.flaw = flaw
        rate = RATE_HZ if flaw != "at-another-rate" else 2 * RATE_HZ
        self.streams = tuple(stream.model_copy(update={"rate_hz": rate}) for stream in sensor.spec.streams)
        channels = FORCE.channels
        if flaw == "whose-force-has-no-kind":
            channels = (channels[0].model_copy(update={"kind": "other"}),)
        self.reference = (FORCE.model_copy(update={"channels": channels}),)
        reason = "" if flaw == "without-reasons" else "it is all there is"
        self.plan = (PlanEntry(effect="ramp", included=True, reason=reason),)
        self.assumptions = {}
        self.drawn = {}
        if flaw == "that-changes-the-scene":
            scene.labels["changed"] = 1
        profile = scene.profile
        self.t_s = np.arange(round(profile.duration.to("s") * RATE_HZ)) / RATE_HZ
        self.force_n = np.interp(self.t_s, *profile.corners)
        self.seed = 0 if flaw == "deaf-to-the-seed" else seed

    def __iter__(self):
        flaw = self.flaw
        rng = np.random.default_rng(None if flaw == "with-a-generator-of-its-own" else self.seed)
        t_ns = (self.t_s * 1e9).astype(np.int64)
        if flaw == "whose-clock-goes-back":
            t_ns = t_ns - 200_000_000 * (self.t_s > 0.5)
        noise = rng.normal(0.0, 0.002, len(t_ns))
        force = {"in-grams": 101.972, "that-pulls": -1.0}.get(flaw, 1.0) * (self.force_n + noise)
        if flaw == "that-breaks":
            raise OSError("no such port: /dev/ttyFLAW0")
        for stream in self.streams:
            rest = np.array([0.0 if one.rest is None else one.rest.value for one in stream.channels])
            data = rest - np.outer(10.0 * self.force_n, np.linspace(0.5, 1.0, len(rest)))
            data = data if flaw == "that-gives-fractions" else np.round(data)
            if flaw == "of-nan":
                data[3, 0] = np.nan
            if flaw == "beyond-the-limits":
                data[5] = -50.0
            if flaw == "with-a-column-too-many":
                data = np.hstack([data, data[:, :1]])
            yield Block(stream.name, t_ns, data)
        yield Block("force_torque", t_ns, force[:, None])


class Rig:
    def __init__(self, flaw):
        self.flaw = flaw

    @contextmanager
    def open(self, sensor, scene, *, seed):
        yield Ramp(sensor, scene, seed, self.flaw)


def build(flaw):
    return (lambda context: 7) if flaw == "that-is-none" else (lambda context: Rig(flaw))


sound = build("")
globals().update({flaw.replace("-", "_"): build(flaw) for flaw in FLAWS})


@hookimpl
def tactbench_rigs():
    def rig(name, code="sound", **changes):
        where = f"flawed_tactile.rigs:{code.replace('-', '_')}"
        return RigDescriptor(**{"name": name, "title": "A ramp", "where": where, "simulated": True, **changes})

    return [
        rig("sound-rig"),
        rig("rig-of-no-code", where="flawed_tactile.rigs:no_such_rig"),
        rig("rig-with-a-rung-twice", rungs=("fine", "fine")),
        rig("rig-whose-file-is-a-number", file="flawed_tactile.rigs:sound"),
        *(rig(f"rig-{flaw}", flaw) for flaw in FLAWS),
    ]
