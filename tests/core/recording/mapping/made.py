"""A mapping with one table, and what differs from it."""

import functools

import yaml

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
