"""A table and a question: a mapping declares a task, and no Python is written."""

import json
import re
import shutil

import numpy as np
import pytest
import yaml

from tests.conftest import Verbs
from tests.core.cli.terminals import computed
from tests.core.report.unrendered import unrendered

PAD = """
version: 1
title: a pad pressed at many places
sensor: {name: pad, title: a pad, principle: magnetic, principle_source: {tag: assumed, reference: test}}
clock: device
tables:
  presses:
    files: "*.csv"
    path: '(?P<day>[a-z]+)_(?P<number>[0-9]+)'
    read: {format: csv, header: true, no_sample: [""]}
    time: {column: t, unit: s, epoch: start}
recording: {name: "{day}-{number}", session: "{day}", labels: {finger: "{day}"}}
streams:
  taxels: {table: presses, channels: [{columns: t1..6, name: "{column}", kind: taxel, unit: count}]}
  place:
    table: presses
    of: reference
    channels:
      - {columns: x_mm, name: x, kind: position, unit: mm}
      - {columns: y_mm, name: y, kind: position, unit: mm}
tasks:
  - name: where
    question: Where is it pressed?
    target: {source: vector, kind: position, names: [x, y], unit: mm}
    splits: [session, recording]
    estimators: [knn]
"""
DAYS, PRESSES, ROWS = ("mon", "tue", "wed", "thu", "fri", "sat"), 3, 30
TAXELS_MM = np.array([[x, y] for x in (-4, 0, 4) for y in (-3, 3)])


def tables(folder):
    """Write a file a press: six taxels feel how near it is; while nothing presses the place is empty."""
    rng = np.random.default_rng(0)
    for day in DAYS:
        for number in range(PRESSES):
            place = rng.uniform(-5, 5, 2)
            force = np.clip(np.linspace(-0.5, 4, ROWS), 0, None)
            X = 100 * force[:, None] * np.exp(-((TAXELS_MM - place) ** 2).sum(axis=1) / 8) + rng.normal(0, 3, (ROWS, 6))
            lines = ["t,t1,t2,t3,t4,t5,t6,x_mm,y_mm"]
            for row in range(ROWS):
                where = ",".join(f"{one:.3f}" if force[row] > 0 else "" for one in place)
                lines.append(f"{row / 20},{','.join(f'{one:.0f}' for one in X[row])},{where}")
            (folder / f"{day}_{number}.csv").write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Tables and mapping."""
    folder = tmp_path_factory.mktemp("pad")
    tables(folder)
    (folder / "pad.yaml").write_text(PAD)
    return folder


@pytest.fixture
def pad(made, tmp_path):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return Verbs(tmp_path, here=True)


def test_one_import_and_one_run_answer_a_question_of_a_table(pad):
    assert re.search("declared +where", pad("import", "pad.yaml", "--out", "rec").stdout)
    run = ("run", "--recordings", "rec", "--task", "where", "--format", "json")
    rows = {row["estimator"]: row for row in json.loads(pad(*run).stdout)}
    assert set(rows) == {"knn", "mean", "time-index"}
    row = rows["knn"]
    assert (row["metric"], row["unit"], row["split"]) == ("mean_euclidean_error", "mm", "session")
    # Presses of a training day lie 0.5 * 10 mm / sqrt(30) = 0.9 mm away; noise and faint first rows come on top.
    assert row["score"] < 0.75 * rows["mean"]["score"]
    assert json.loads(row["declared_task"])["name"] == "where"
    assert computed(pad(*run))[2] == 0, "what was declared decides the key as a task does"
    pad("why", "where/replay/deployable/knn", "--again")
    with unrendered():
        pad("report")
    drawn = {path.name for path in (pad.folder / "tactbench-results" / "report" / "figures").iterdir()}
    assert "residuals-where-deployable-session-knn-replay.png" in drawn
    # Another question of the same recordings is another cell.
    declared = pad.folder / "rec" / "tasks.yaml"
    declared.write_text(declared.read_text().replace("unit: mm", "unit: um"))
    (after_it,) = [row for row in json.loads(pad(*run).stdout) if row["estimator"] == "knn"]
    assert row["key"] != after_it["key"]
    assert after_it["score"] == pytest.approx(1e3 * row["score"])


def test_an_import_replaces_no_other_declaration_unasked(pad):
    imports = ("import", "pad.yaml", "--out", "rec")
    pad(*imports)
    declared = pad.folder / "rec" / "tasks.yaml"
    before = declared.read_bytes()
    pad(*imports)
    (pad.folder / "pad.yaml").write_text(PAD.replace("[session, recording]", "[recording]"))
    pad(*imports, code=2)
    assert declared.read_bytes() == before
    pad(*imports, "--replace")
    assert yaml.safe_load(declared.read_text())["tasks"][0]["splits"] == ["recording"]
