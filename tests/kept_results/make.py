"""How ``v1`` beside this file was made: once, by tactbench 0.1.0. It is never written anew.

Three cells over five sessions of a made-up pad, by way of a mapping; of the folder, what tables and merging read.

Usage: python tests/kept_results/make.py FOLDER
"""

import contextlib
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

from tactbench.core.cli import main

MAPPING = """\
version: 1
title: presses made for a test
sensor: {name: pad, title: a pad, principle: capacitive, principle_source: {tag: assumed, reference: made for a test}}
clock: host
tables:
  presses:
    files: "presses/*.csv"
    path: "/(?P<session>[a-e])[.]csv$"
    read: {format: csv, header: true}
    time: {column: time, unit: s, epoch: start}
recording: {name: "{session}", session: "{session}"}
streams:
  taxels:
    table: presses
    channels: [{columns: t1..3, name: "{column}", kind: taxel, unit: count, lower: 0, upper: 4095}]
  scale: {table: presses, of: reference, channels: [{columns: fz, name: fz, kind: force, unit: N, sentinels: []}]}
"""
KEPT = ("index.jsonl", "run.json", "scores.json", "cells", "provenance")


def write_presses(folder: Path) -> None:
    """Write a table a session: 120 rows in 6 s."""
    rng = np.random.default_rng(20260901)
    gains = rng.uniform(20, 60, 3)
    t_s = np.arange(120) / 20
    for session in "abcde":
        force_n = np.interp(t_s, (0, 2, 6), (0, 0, 5))
        counts = np.rint(100 + force_n[:, None] * gains + rng.normal(0, 2, (120, 3)))
        rows = np.column_stack([t_s, force_n + rng.normal(0, 0.01, 120), counts])
        np.savetxt(folder / f"{session}.csv", rows, "%.4f", ",", header="time,fz,t1,t2,t3", comments="")


def run(*words: str) -> None:
    """Carry out a command."""
    try:
        main(list(words))
    except SystemExit as ended:
        if ended.code:
            raise


if __name__ == "__main__":
    target = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("presses").mkdir()
        write_presses(Path("presses"))
        Path("mapping.yaml").write_text(MAPPING)
        run("import", "mapping.yaml", "--out", "recordings")
        answers = ("--task", "force", "--estimator", "ols", "--protocol", "deployable", "--split", "session")
        run("run", "--rig", "replay", "--recordings", "recordings", *answers, "--out", "results")
        for name in KEPT:
            place = Path("results") / name
            shutil.copytree(place, target / name) if place.is_dir() else shutil.copy(place, target / name)
