"""Checks of a data set: what its mapping states, against its own files; nothing is fetched."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.recorded import fits
from tactbench.core.conformance.streams import good, read_back
from tactbench.core.errors import nearest
from tactbench.core.recording.datasets import DataSet
from tactbench.core.recording.mapping.importing import import_tables
from tactbench.core.recording.mapping.model import Mapping
from tactbench.core.spec.task import LabelTarget, TaskSpec, VectorTarget

MOST_READ = 40  # recordings that are looked at, evenly over all
LONE, LONE_SHARE = 2.0, 0.02  # a sentinel stands so many ranges apart from all others, in such a share of rows


def _mapping(subject: Subject) -> Mapping:
    with code_of(subject.module, subject):
        return DataSet(Path(subject.module)).mapping


@check("dataset")
def tasks_can_be_answered(subject: Subject) -> None:
    """A task is looked up, and what it asks for, when everything has been fetched and imported.

    Name tasks of `tactbench list tasks`, or of the mapping, under `source.tasks`: the mapping must have their target
    and features. A session is what was recorded without mounting anew, and holds several trials.
    """
    mapping = _mapping(subject)
    streams = mapping.streams.values()
    sensed = {channel.kind for one in streams if one.of == "sensor" for channel in one.channels}
    known = {channel.kind for one in streams if one.of == "reference" for channel in one.channels}
    labels = {*mapping.recording.labels, *(label for one in streams for label in one.annotations)}
    own = {one.name: one.spec for one in mapping.tasks}
    for name in () if mapping.source is None else mapping.source.tasks:
        if name not in own and name not in subject.registry.tasks:
            close = nearest(name, {*own, *subject.registry.tasks.names()})
            fail("source.tasks", f"there is no task {name!r}{f'; did you mean {close[0]}?' if close else ''}")
        spec: TaskSpec = own[name] if name in own else subject.registry.tasks[name].spec
        if isinstance(spec.target, LabelTarget) and spec.target.name not in labels:
            there = ", ".join(labels) or "none"
            fail("source.tasks", f"{name} asks for the label {spec.target.name}; there is {there}")
        kind = getattr(spec.target, "kind", None)
        if kind is not None and kind not in known | (sensed if isinstance(spec.target, VectorTarget) else set()):
            fail("source.tasks", f"{name} asks for a {kind}, which no reference stream has")
        if not sensed & {*spec.features, *spec.optional_features}:
            fail("source.tasks", f"{name} looks at {', '.join(spec.features)}; there is {', '.join(sorted(sensed))}")
    words = [set(re.findall(r"\{(\w+)", text)) for text in (mapping.recording.session, mapping.recording.trial)]
    if words[1] and words[1] <= words[0]:
        fail("recording.session", "each trial is a session of its own: a split by session holds out single trials")


@check("dataset", needs="tasks-can-be-answered")
def readings_are_as_stated(subject: Subject) -> None:
    """What a mapping states wrongly is stored, and believed by everybody who reads the recordings.

    Look at columns, units (`given_in`), sentinels, `sign`, `lower`, `upper`, `rest` and `rate_hz` of the channels that
    are named, and at the unit of the time.
    """
    mapping, data_set = _mapping(subject), DataSet(Path(subject.module))
    first = "" if mapping.source is None else next(iter(mapping.source.files))
    own = (subject.root, *subject.root.iterdir()) if subject.root else ()
    places = (*own, data_set.files, Path(subject.module).parent)
    root = next((one for one in places if one is not None and first and (one / first).is_file()), None)
    if first and root is None:
        skip("its files are not here, and none is fetched: `--root DIR` names a folder that holds a copy")
    roles: Counter[str | None] = Counter()
    with TemporaryDirectory() as folder:
        with code_of(subject.module, subject):
            report = import_tables(Path(subject.module), root=root or subject.root, out=Path(folder))
        for imported in report.recordings[:: max(1, len(report.recordings) // MOST_READ)]:
            for finding in imported.findings:
                if finding.check == "target-among-features":
                    fail("streams", f"{imported.meta.name}: {finding.message}")
            made = read_back(imported.path)
            roles[made.meta.role] += 1
            if made.wrong:
                fail(imported.meta.name, made.wrong)
            fits(made.meta, made.came, made.meta.sensor)
            for name, stream in made.came.items():
                for column, channel in enumerate(stream.spec.channels):
                    values = good(stream)[:, column]
                    values = values[np.isfinite(values)]
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
