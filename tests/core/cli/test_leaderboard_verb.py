"""The verb ``leaderboard``: a result folder as a table, in any format, from anybody."""

import csv
import io
import json
import os
import pty
import subprocess
import sys

import pytest

from tests.conftest import Verbs

RUN = ("run", "--repeats", "5", "--sensor", "ideal", "--task", "force", "--estimator", "lasso", "--out", "out")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The verbs in the folder of a run."""
    verbs = Verbs(tmp_path_factory.mktemp("ran"), here=True)
    verbs(*RUN)
    return verbs


def test_a_folder_shows_the_same_table_as_its_run(ran):
    again = ran(*RUN, "--format", "json").stdout
    assert ran("leaderboard", "out", "--format", "json").stdout == again
    assert json.loads(again) == json.loads((ran.folder / "out" / "leaderboard.json").read_text())


def test_what_was_just_computed_and_what_is_read_again_give_the_same_files(ran):
    kept = [ran.folder / "out" / f"leaderboard.{ending}" for ending in ("md", "csv", "json")]
    before = [path.read_bytes() for path in kept]
    ran(*RUN)
    assert [path.read_bytes() for path in kept] == before


def test_every_format_goes_to_a_file_named_for_it(ran):
    for suffix, shape in (
        (".md", "md"),
        (".csv", "csv"),
        (".json", "json"),
        (".tex", "latex"),
        (".txt", "table"),
    ):
        ran("leaderboard", "out", "--to", f"table{suffix}")
        assert (ran.folder / f"table{suffix}").read_text() == ran("leaderboard", "out", "--format", shape).stdout
    refused = ran("leaderboard", "out", "--to", "nowhere/table.md", code=2)
    assert "nowhere/table.md cannot be written" in refused.stderr


def test_a_workbook_goes_to_a_file(ran):
    from openpyxl import load_workbook

    ran("leaderboard", "out", "--to", "table.xlsx")
    sheet = load_workbook(ran.folder / "table.xlsx").worksheets[0]
    names, first, *_ = sheet.iter_rows(values_only=True)
    rows = json.loads(ran("leaderboard", "out", "--format", "json").stdout)
    assert dict(zip(names, first, strict=True))["score"] == rows[0]["score"]


@pytest.mark.parametrize("name", ["table.xls", "table", "table.md.bak"])
def test_a_name_that_says_no_format_is_refused_and_not_written(ran, name):
    refused = ran("leaderboard", "out", "--to", name, code=2)
    assert ".xlsx" in refused.stderr
    assert not (ran.folder / name).exists()
    assert "asks for md" in ran("leaderboard", "out", "--to", "table.xlsx", "--format", "md", code=2).stderr


def test_rows_are_chosen_by_name_and_unknown_names_are_refused_with_the_known(ran):
    shown = json.loads(ran("leaderboard", "out", "--estimator", "lasso", "--format", "json").stdout)
    assert [row["estimator"] for row in shown] == ["lasso"]
    assert shown[0]["baseline"] is not None
    for option, given, says in (
        ("--sensor", "ideel", "Did you mean 'ideal'? Known: ideal."),
        ("--task", "forse", "Did you mean 'force'"),
        ("--protocol", "karl2015", "Did you mean 'karl2016'"),
        ("--split", "role", "Known: roles"),
        ("--estimator", "laso", "Known: lasso, mean, time-index"),
        ("--columns", "sensor,scor", "Did you mean 'score'"),
    ):
        assert says in ran("leaderboard", "out", option, given, code=2).stderr
    assert "always holds all columns" in ran("leaderboard", "out", "--columns", "#", "--format", "csv", code=2).stderr


def test_the_best_and_columns_of_ones_own_choice(ran):
    best = ran("leaderboard", "out", "--best", "--columns", "sensor,estimator,cell").stdout.splitlines()
    head = next(place for place, line in enumerate(best) if line.split() == ["sensor", "estimator", "cell"])
    assert best[head + 1].split() == ["ideal", "lasso", "ideal/force/twin/karl2016/lasso"]
    assert best[head + 2] == ""


def test_the_cell_that_a_table_names_is_the_one_that_why_explains(ran):
    shown = ran("leaderboard", "out").stdout
    (command,) = [line for line in shown.splitlines() if " tactbench why " in line]
    name = command.split()[3]
    assert name.count("/") == 2
    why = ran("why", name, "--out", "out").stdout
    sensor, task, estimator = name.split("/")
    assert why.startswith(f"{sensor}/{task}/")
    assert f"/{estimator}/1\n" in why


def test_all_columns_are_shown_on_request(ran):
    assert "latency p50" not in ran("leaderboard", "out").stdout
    assert "latency p50" in ran("leaderboard", "out", "--wide").stdout
    written = (ran.folder / "out" / "leaderboard.md").read_text()
    assert "latency p50" in written
    assert "numpy" in written


def test_parquet_goes_to_a_file_and_into_a_pipe(ran):
    import pyarrow.parquet as pq

    ran("leaderboard", "out", "--to", "table.parquet")
    read = pq.read_table(ran.folder / "table.parquet")
    rows = json.loads(ran("leaderboard", "out", "--format", "json").stdout)
    assert read["cell"].to_pylist() == [row["cell"] for row in rows]
    assert read["score"].to_pylist() == [row["score"] for row in rows]
    assert read["shown_score"].to_pylist() == [row["shown"]["score"] for row in rows]
    piped = subprocess.run(
        [sys.executable, "-m", "tactbench", "leaderboard", "out", "--format", "parquet"],
        cwd=ran.folder, capture_output=True, check=True,
    )  # fmt: skip
    assert piped.stdout == (ran.folder / "table.parquet").read_bytes()


def test_parquet_is_not_written_to_a_terminal(ran):
    ours, theirs = pty.openpty()
    try:
        done = subprocess.run(
            [sys.executable, "-m", "tactbench", "leaderboard", "out", "--format", "parquet"],
            cwd=ran.folder, stdout=theirs, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    finally:
        os.close(theirs)
        os.close(ours)
    assert done.returncode == 2
    assert "--to leaderboard.parquet" in done.stderr


def test_without_times_two_runs_give_the_same_bytes(ran, verbs):
    verbs(*RUN, "--jobs", "2")
    for shape in ("table", "md", "csv", "json", "latex"):
        here, there = (one("leaderboard", "out", "--no-times", "--format", shape).stdout for one in (ran, verbs))
        assert here == there
    with_times = list(csv.DictReader(io.StringIO(ran("leaderboard", "out", "--format", "csv").stdout)))
    without = list(csv.DictReader(io.StringIO(ran("leaderboard", "out", "--no-times", "--format", "csv").stdout)))
    assert [row["score"] for row in without] == [row["score"] for row in with_times]
    assert "fit_s" in with_times[0]
    assert "fit_s" not in without[0]


@pytest.mark.parametrize("content", [None, "", "{}", "not a folder"])
def test_what_is_no_result_folder_is_told_in_a_sentence(verbs, content):
    place = verbs.folder / "there"
    if content == "not a folder":
        place.write_text("x")
    elif content is not None:
        place.mkdir()
        (place / "results.sqlite").write_text(content)
    refused = verbs("leaderboard", "there", code=2)
    assert "Traceback" not in refused.stderr
    assert "tactbench run" in refused.stderr
    assert not (verbs.folder / "there" / "recordings").exists()
