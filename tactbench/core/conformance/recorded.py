"""Checks of recordings, of a sensor or made by a data set's mapping. They run no code of a plugin."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import (
    Recorded,
    good,
    limits_of,
    pressing_force,
    rate_is_right,
    read_back,
    within_limits,
)
from tactbench.core.recording.datasets import DataSet, copy_in
from tactbench.core.recording.mapping import model
from tactbench.core.recording.mapping.importing import import_tables
from tactbench.core.samples import StreamData
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import LabelTarget, TaskSpec, VectorTarget

MOST_N = 100.0  # median force while loaded
LOADED = 0.2  # share of the largest force from which a sample counts as loaded
FAR = 0.25  # largest distance of a stated rest from the readings, of the range, unless their span is larger
CLEAR = 0.5  # correlation of a taxel with the force that determines its sign
MOST_READ = 40  # recordings that are looked at, evenly over all
LONE, LONE_SHARE = 2.0, 0.02  # a sentinel stands so many ranges apart from all others, in such a share of rows


@cache
def _read(subject: Subject) -> Recorded:
    if subject.recording is None:
        skip("no recording is given: `--recording FILE` reads one")
    with code_of(str(subject.recording), subject):
        return read_back(subject.recording)


@check("sensor")
def recording_fits_the_spec(subject: Subject) -> None:
    """A real unit shows another rate, range, sign or force than stated if the spec or the decoding is wrong.

    Give a healthy recording of this sensor (`tactbench inspect FILE`). Correct rate_hz, lower, upper and sign of the
    spec, the type and byte order of the decoding, how the device is set up, or the force's unit in the mapping (1 gf is
    0.00981 N).
    """
    meta, data, wrong = _read(subject)
    spec = subject.registry.sensors[subject.name].spec
    unknown = {one.name for one in meta.sensor.channels()} - {one.name for one in spec.channels()}
    if meta.sensor.name != spec.name or unknown:
        fail("meta.sensor", f"it is for {meta.sensor.name!r}, with unknown channels: {', '.join(sorted(unknown))}")
    if wrong:
        fail("file", wrong)
    fits(meta, data, spec)


def fits(meta: RecordingMeta, data: Mapping[str, StreamData], spec: SensorSpec) -> None:
    """Fail if a recording has forces beyond a finger's, or another rate, range, rest level or sign than `spec`."""
    pressing = None
    known = [one for each in meta.reference if each.name in data for one in each.channels]
    if any(one.kind == "force" and one.name in ("fz", "normal") for one in known):
        pressing, force_n = pressing_force(data, meta.reference)
        size_n = np.abs(force_n[np.isfinite(force_n)])
        if size_n.any() and (loaded_n := np.median(size_n[size_n > LOADED * size_n.max()])) > MOST_N:
            fail("reference", f"the median force while loaded is {loaded_n:.4g} N: are these gram-force?")
    for stated in spec.streams:
        if stated.name not in data:
            continue
        stream, limits = data[stated.name], {one.name: one for one in stated.channels}
        own_rate = stated.name in meta.own_rates_hz or (meta.simulated and meta.emulation is None)
        rate_is_right(f"spec.streams[{stated.name}]", stream, None if own_rate else stated.rate_hz)
        load = np.full(len(stream.data), np.nan)
        if stream.t_ns is not None and pressing is not None and pressing.t_ns is not None:
            load = np.interp(stream.t_ns, pressing.t_ns, force_n)
        for channel, values in zip(stream.spec.channels, good(stream).T, strict=True):
            own, where = limits[channel.name], f"spec.streams[{stated.name}].channels[{channel.name}]"
            within_limits(where, own, values)
            there = values[np.isfinite(values)]
            if own.rest is not None and len(there):
                rest, low, high = own.rest.to(own.unit), there.min(), there.max()
                ends = [one for one in limits_of(own) if np.isfinite(one)]
                near = max(high - low, FAR * np.ptp(ends or [low]))
                if not low - near <= rest <= high + near:
                    fail(f"{where}.rest", f"{rest:g} is stated, but unloaded readings are {low:g} to {high:g}")
            whole = np.isfinite(values) & np.isfinite(load)
            if channel.kind == "taxel" and whole.any() and np.ptp(values[whole]) and np.ptp(load[whole]):
                correlation = float(np.corrcoef(values[whole], load[whole])[0, 1])
                if correlation * own.sign < -CLEAR:
                    text = f"{own.sign:+d} is stated, its correlation with the force is {correlation:+.2f}"
                    fail(f"{where}.sign", text)


@check("sensor", needs="recording-fits-the-spec")
def recording_is_of_a_real_unit(subject: Subject) -> None:
    """Only a recording of a real unit shows the sensor's true behaviour; a simulation shows assumptions about it.

    Record a real unit, or import recordings of one.
    """
    if _read(subject).meta.simulated:
        skip("the recording is simulated, or its devices are emulated")


def _mapping(subject: Subject) -> model.Mapping:
    with code_of(subject.module, subject):
        return DataSet(Path(subject.module)).mapping


@check("dataset")
def tasks_can_be_answered(subject: Subject) -> None:
    """Tasks and the data they need are looked up only after all files have been fetched and imported.

    Name tasks of `tactbench list tasks`, or of the mapping, under `source.tasks`: the mapping must have their target
    and features. A session holds several trials, recorded without mounting anew.
    """
    mapping = _mapping(subject)
    streams = mapping.streams.values()
    sensed = {channel.kind for one in streams if one.of == "sensor" for channel in one.channels}
    known = {channel.kind for one in streams if one.of == "reference" for channel in one.channels}
    labels = {*mapping.recording.labels, *(label for one in streams for label in one.annotations)}
    own = {one.name: one.spec for one in mapping.tasks}
    for name in () if mapping.source is None else mapping.source.tasks:
        with code_of("source.tasks", subject):
            spec: TaskSpec = own[name] if name in own else subject.registry.tasks[name].spec
        target = spec.target
        there: set[str] = {*known, *(sensed if isinstance(target, VectorTarget) else ())}
        asked = getattr(target, "kind", None)
        if isinstance(target, LabelTarget):
            asked, there = target.name, labels
        if not sensed & {*spec.features, *spec.optional_features} or (asked is not None and asked not in there):
            text = f"{name} predicts {asked} from {' or '.join(spec.features)}"
            fail("source.tasks", f"{text}; recorded: {', '.join(sorted(there)) or 'no target'}; {', '.join(sensed)}")
    names = mapping.recording.session, mapping.recording.trial
    session, trial = (set(re.findall(r"\{(\w+)", name)) for name in names)
    if trial and trial <= session:
        fail("recording.session", "each trial is a session of its own: a split by session holds out single trials")


@check("dataset", needs="tasks-can-be-answered")
def readings_are_as_stated(subject: Subject) -> None:
    """Wrong statements in a mapping are stored with the recordings, and readers of the recordings rely on them.

    Check columns, units (`given_in`), sentinels, `sign`, `lower`, `upper`, `rest` and `rate_hz` of the channels that
    are named, and at the unit of the time.
    """
    mapping, file = _mapping(subject), Path(subject.module)
    first = "" if mapping.source is None else next(iter(mapping.source.files))
    folders = (copy_in(subject.root, first), DataSet(file).files, file.parent)
    root = next((one for one in folders if one is not None and first and (one / first).is_file()), None)
    if first and root is None:
        skip("the data set's files are missing, and checks fetch none: give `--root DIR`, a folder with a copy")
    roles: Counter[str | None] = Counter()
    with TemporaryDirectory() as folder:
        with code_of(subject.module, subject):
            report = import_tables(file, root=root or subject.root, out=Path(folder))
        for imported in report.recordings[:: max(1, len(report.recordings) // MOST_READ)]:
            made = read_back(imported.path)
            roles[made.meta.role] += 1
            leaks = [one.message for one in imported.findings if one.check == "target-among-features"]
            if made.wrong or leaks:
                fail(imported.meta.name, "; ".join((made.wrong, *leaks)))
            fits(made.meta, made.came, made.meta.sensor)
            for name, stream in made.came.items():
                for channel, column in zip(stream.spec.channels, good(stream).T, strict=True):
                    values = column[np.isfinite(column)]
                    if channel.kind not in ("force", "torque") or len(values) < 1 / LONE_SHARE:
                        continue
                    low, high = np.quantile(values, (LONE_SHARE, 1 - LONE_SHARE))
                    apart = np.unique(values[np.abs(values - (low + high) / 2) > (LONE + 0.5) * (high - low)])
                    if len(apart) == 1 and high > low:
                        text = f"{apart[0]:g} {channel.unit} in {imported.meta.name} is far from all others: no sample?"
                        fail(f"streams.{name}.channels[{channel.name}].sentinels", text)
    lacking = [one for one in ("train", "test") if set(roles) != {None} and one not in roles]
    if lacking:
        fail("recording.role", f"no recording has the role {lacking[0]}")
