"""A mapping with one table, and what differs from it."""

import functools

import pytest
import yaml

from tactbench.core.errors import TactbenchError
from tactbench.core.recording.mapping.importing import import_tables
from tactbench.core.recording.reader import open_recording

BASE = """
version: 1
title: a test
sensor: {name: pad, title: a pad, principle: capacitive, principle_source: {tag: assumed, reference: a test}}
clock: host
tables:
  table: {files: "*.csv", read: {format: csv, header: false}, time: {column: 0, unit: s, epoch: start}}
recording: {name: "{file}", session: "{file}"}
streams:
  taxels: {table: table, channels: [{columns: 1..3, name: "t{column}", kind: taxel, unit: count}]}
  force:
    table: table
    of: reference
    channels: [{columns: 4, name: fz, kind: force, unit: N, given_in: gf, sentinels: [-1]}]
"""


def write_mapping(path, text="", **change):
    """Write the base mapping with the keys of `text` in place of its own, and with `change`, as ``clock="none"``.

    What lies deeper is changed by its path: ``streams__force__channels__0__unit="N"``.
    """
    said = yaml.safe_load(BASE) | (yaml.safe_load(text) or {})
    for place, value in change.items():
        *parents, last = (int(name) if name.isdigit() else name for name in place.split("__"))
        functools.reduce(lambda node, name: node[name], parents, said)[last] = value
    path.write_text(yaml.safe_dump(said, sort_keys=False))
    return path


class Tables:
    """Imports the tables in ``data`` into ``out``, by the base mapping with changes."""

    def __init__(self, folder):
        self.data, self.out, self.mapping = folder / "data", folder / "out", folder / "mapping.yaml"
        self.data.mkdir()

    def put(self, name, text):
        (self.data / name).parent.mkdir(parents=True, exist_ok=True)
        (self.data / name).write_bytes(text if isinstance(text, bytes) else text.encode())

    def run(self, text="", *, replace=None, **change):
        mapping = write_mapping(self.mapping, text, **change)
        options = {} if replace is None else {"replace": replace}
        return import_tables(mapping, root=self.data, out=self.out, **options)

    def refused(self, *says, text="", **change):
        with pytest.raises(TactbenchError) as caught:
            self.run(text, **change)
        assert (caught.value.exit_code, bool(caught.value.hint)) == (2, True)
        assert [text for text in says if text not in str(caught.value)] == []
        assert not list(self.out.rglob("*"))


def rows(n=40, force=lambda row: row * 1.5):
    return "".join(f"{row * 0.01:.2f},{row},{row * 2},{row * 3 % 5},{force(row)}\n" for row in range(n))


def read(report, number=0):
    """Return the meta of a sound recording, and its streams by name."""
    with open_recording(report.recordings[number].path) as recording:
        recording.verify()
        return recording.meta, {name: recording.read(name) for name in recording.stream_names}
