"""The verb ``leaderboard``: a result folder as a table, in any format, from anybody."""

import csv
import io
import json

import pyarrow.parquet as pq
import pytest
from openpyxl import load_workbook

from tests.conftest import Verbs
from tests.core.cli.terminals import on_terminal

RUN = ("run", "--repeats", "5", "--sensor", "ideal", "--task", "force", "--estimator", "lasso", "--out", "out")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The verbs in the folder of a run."""
    verbs = Verbs(tmp_path_factory.mktemp("ran"), here=True)
    verbs(*RUN)
    return verbs


def test_a_folder_shows_the_table_of_its_run_and_every_format_goes_to_a_file_named_for_it(ran):
    shown = ran("leaderboard", "out", "--format", "json").stdout
    assert shown == ran(*RUN, "--format", "json").stdout
    rows = json.loads(shown)
    for suffix, shape in ((".md", "md"), (".csv", "csv"), (".json", "json"), (".tex", "latex"), (".txt", "table")):
        ran("leaderboard", "out", "--to", f"table{suffix}")
        assert (ran.folder / f"table{suffix}").read_text() == ran("leaderboard", "out", "--format", shape).stdout
    ran("leaderboard", "out", "--to", "table.xlsx")
    sheet = load_workbook(ran.folder / "table.xlsx").worksheets[0]
    names, first, *_ = sheet.iter_rows(values_only=True)
    assert dict(zip(names, first, strict=True))["score"] == rows[0]["score"]
    ran("leaderboard", "out", "--to", "table.parquet")
    assert pq.read_table(ran.folder / "table.parquet")["score"].to_pylist() == [row["score"] for row in rows]
    for name in ("table.xls", "table", "table.md.bak"):
        assert ".xlsx" in ran("leaderboard", "out", "--to", name, code=2).stderr
        assert not (ran.folder / name).exists()
    assert "nowhere/table.md" in ran("leaderboard", "out", "--to", "nowhere/table.md", code=2).stderr


def test_bytes_are_not_written_to_a_terminal(ran):
    with on_terminal(["-m", "tactbench", "leaderboard", "out", "--format", "parquet"], cwd=ran.folder) as terminal:
        assert "--to leaderboard.parquet" in terminal.read_until(None)
        assert terminal.process.wait(30) == 2


def test_rows_are_chosen_by_name_and_unknown_names_are_refused_with_the_known(ran):
    shown = json.loads(ran("leaderboard", "out", "--estimator", "lasso", "--format", "json").stdout)
    assert [row["estimator"] for row in shown] == ["lasso"]
    assert shown[0]["baseline"] is not None
    for option, given, says in (("--sensor", "ideel", "Known: ideal"), ("--columns", "sensor,scor", "'score'")):
        assert says in ran("leaderboard", "out", option, given, code=2).stderr
    assert "always holds all columns" in ran("leaderboard", "out", "--columns", "#", "--format", "csv", code=2).stderr


def test_the_best_and_columns_of_ones_own_choice_and_the_name_that_why_takes(ran):
    best = ran("leaderboard", "out", "--best", "--columns", "sensor,estimator,cell").stdout.splitlines()
    head = next(place for place, line in enumerate(best) if line.split() == ["sensor", "estimator", "cell"])
    assert best[head + 1].split() == ["ideal", "lasso", "ideal/force/twin/karl2016/lasso"]
    assert best[head + 2] == ""
    (command,) = [line for line in ran("leaderboard", "out").stdout.splitlines() if " tactbench why " in line]
    assert "ideal/force/twin/karl2016/lasso/1" in ran("why", command.split()[3], "--out", "out").stdout


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
