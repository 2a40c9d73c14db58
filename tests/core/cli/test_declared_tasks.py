"""A table and a question: a mapping declares a task, and no Python is written."""

import json
import shutil

import numpy as np
import pytest
import yaml

from tests.conftest import Verbs
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
def before(tmp_path_factory):
    """Tables and mapping."""
    folder = tmp_path_factory.mktemp("before")
    tables(folder)
    (folder / "pad.yaml").write_text(PAD)
    return folder


@pytest.fixture(scope="module")
def after(before, tmp_path_factory):
    """The same with what was imported, and what the import said."""
    folder = tmp_path_factory.mktemp("after") / "pad"
    shutil.copytree(before, folder)
    return folder, Verbs(folder, here=True)("import", "pad.yaml", "--out", "rec")


@pytest.fixture
def pad(before, tmp_path):
    shutil.copytree(before, tmp_path, dirs_exist_ok=True)
    return Verbs(tmp_path, here=True)


@pytest.fixture
def imported(after, tmp_path):
    shutil.copytree(after[0], tmp_path, dirs_exist_ok=True)
    return Verbs(tmp_path, here=True)


def test_one_import_and_one_run_answer_a_question_of_a_table(after, imported):
    pad, done = imported, after[1]
    assert "tasks of their own, in rec/tasks.yaml: where" in done.stdout
    assert "x 72, y 72" in done.stdout
    run = ("run", "--recordings", "rec", "--task", "where", "--format", "json")
    rows = {row["estimator"]: row for row in json.loads(pad(*run).stdout)}
    assert set(rows) == {"knn", "mean", "time-index"}
    row = rows["knn"]
    assert (row["metric"], row["unit"], row["split"]) == ("mean_euclidean_error", "mm", "session")
    # Presses of a training day lie 0.5 * 10 mm / sqrt(30) = 0.9 mm away; noise and faint first rows come on top.
    assert row["score"] < 0.75 * rows["mean"]["score"]
    assert row["scores"]["median error"] < row["score"] < row["scores"]["95th percentile of the error"]
    assert json.loads(row["declared_task"])["name"] == "where"
    assert "answers are vectors (x, y): one model per component" in row["remarks"]
    assert "0 computed now" in pad(*run).stderr, "what was declared decides the key as a task does"
    assert "identical" in pad("why", "where/replay/deployable/knn", "--again").stdout
    assert "reuses it" in pad("why", "where/replay/deployable/knn").stdout
    with unrendered():
        pad("report")
    drawn = {path.name for path in (pad.folder / "tactbench-results" / "report" / "figures").iterdir()}
    assert "location-map-where-deployable-session-knn-replay.png" in drawn
    assert "residuals-where-deployable-session-knn-replay.png" in drawn


def test_what_an_answer_costs_is_measured_of_a_declared_task_too(imported):
    pad = imported
    asked = ("--sensor", "pad", "--task", "where", "--recordings", "rec", "--estimator", "knn", "--rounds", "1")
    rows = {row["estimator"]: row for row in json.loads(pad("cost", *asked, "--format", "json").stdout)}
    assert rows["knn"]["score"] < rows["mean"]["score"]
    assert rows["knn"]["fit_s"] > 0


def test_another_question_of_the_same_recordings_is_another_cell(imported):
    pad = imported
    run = ("run", "--recordings", "rec", "--task", "where", "--format", "json")
    before = json.loads(pad(*run).stdout)
    declared = pad.folder / "rec" / "tasks.yaml"
    declared.write_text(declared.read_text().replace("unit: mm", "unit: um"))
    after = json.loads(pad(*run).stdout)
    assert before[0]["key"] != after[0]["key"]
    assert after[0]["score"] == pytest.approx(1e3 * before[0]["score"])


def test_a_task_of_an_installed_ones_name_is_refused(pad):
    (pad.folder / "pad.yaml").write_text(PAD.replace("name: where", "name: force"))
    pad("import", "pad.yaml", "--out", "rec")
    refused = pad("run", "--recordings", "rec", "--task", "force", code=2)
    assert "'force' that tasks.yaml beside the recordings declares has the name of an installed one" in refused.stderr


def test_two_files_may_not_mean_different_tasks_by_one_name(pad):
    pad("import", "pad.yaml", "--out", "rec/a")
    (pad.folder / "pad.yaml").write_text(PAD.replace("[session, recording]", "[recording]"))
    pad("import", "pad.yaml", "--out", "rec/b")
    refused = pad("run", "--recordings", "rec", "--task", "where", code=2)
    assert "'where' is not the same in rec/a/tasks.yaml and in rec/b/tasks.yaml" in refused.stderr
    assert pad("run", "--recordings", "rec/b", "--task", "where", "--format", "csv").stdout


def test_importing_again_keeps_the_tasks_and_other_ones_are_refused(imported):
    pad = imported
    before = (pad.folder / "rec" / "tasks.yaml").read_bytes()
    pad("import", "pad.yaml", "--out", "rec")
    assert (pad.folder / "rec" / "tasks.yaml").read_bytes() == before
    (pad.folder / "pad.yaml").write_text(PAD.replace("[session, recording]", "[recording]"))
    assert "declares other tasks" in pad("import", "pad.yaml", "--out", "rec", code=2).stderr
    assert (pad.folder / "rec" / "tasks.yaml").read_bytes() == before
    pad("import", "pad.yaml", "--out", "rec", "--replace")
    assert yaml.safe_load((pad.folder / "rec" / "tasks.yaml").read_text())["tasks"][0]["splits"] == ["recording"]


def test_a_file_of_a_stranger_names_no_code(imported):
    pad = imported
    declared = pad.folder / "rec" / "tasks.yaml"
    declared.write_text(declared.read_text() + "  features_by: os:system\n")
    refused = pad("run", "--recordings", "rec", "--task", "where", code=2)
    assert "the key 'features_by' is not known" in refused.stderr
    assert f"tasks.yaml:{len(declared.read_text().splitlines())}" in refused.stderr


LINE = 1 + PAD.splitlines().index("tasks:")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("names: [x, y]", "names: []", "target.names"),
        (
            "names: [x, y]",
            "names: [x, z]",
            "asks for the position channel z, which the mapping does not have. It has x, y",
        ),
        (
            "kind: position, names",
            "kind: force, names",
            "task 'where' asks for a target of kind force",
        ),
        ("[session, recording]", "[sesion]", "asks for the split sesion"),
        ("[session, recording]", "[]", f"pad.yaml:{LINE + 4}"),
        ("estimators: [knn]", "metric: rmse", f"pad.yaml:{LINE + 1}"),
        ("estimators: [knn]", "metric: rmsee", f"pad.yaml:{LINE + 5}"),
        ("estimators: [knn]", "features: [ac_pressure]", "asks for features of kind ac_pressure"),
        ("estimators: [knn]", "answer_per: recording", "needs either summaries"),
        ("estimators: [knn]", "features_by: os:system", f"pad.yaml:{LINE + 5}: the key 'features_by' is not known"),
        ("source: vector, kind: position, names: [x, y], unit: mm", "source: label, name: colour", "the label colour"),
        ("source: vector, ", "", f"pad.yaml:{LINE + 3}"),
    ],
)
def test_what_a_mapping_declares_wrongly_is_refused_with_its_line(pad, old, new, says):
    assert old in PAD
    (pad.folder / "pad.yaml").write_text(PAD.replace(old, new))
    refused = pad("import", "pad.yaml", "--out", "rec", code=2)
    assert says in " ".join(refused.stderr.split())
    assert not (pad.folder / "rec").exists()


def test_labels_are_classes_or_numbers_and_groups(pad):
    label = "source: label, name: finger"
    said = PAD.replace("source: vector, kind: position, names: [x, y], unit: mm", label)
    said = said.replace("[session, recording]", "[recording]").replace("[knn]", "[forest-10]")
    (pad.folder / "pad.yaml").write_text(said)
    pad("import", "pad.yaml", "--out", "rec")
    run = ("run", "--recordings", "rec", "--task", "where", "--format", "json")
    rows = json.loads(pad(*run).stdout)
    assert {row["metric"] for row in rows} == {"macro_f1"}
    assert rows[0]["classes"] == sorted(DAYS)
    assert {row["estimator"] for row in rows if row["is_baseline"]} == {"majority", "chance"}
