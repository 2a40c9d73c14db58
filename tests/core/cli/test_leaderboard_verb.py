"""The verb ``leaderboard``: a result folder as a table, in any format."""

import json

import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import Verbs
from tests.core.cli.terminals import on_terminal
from tests.core.matrix import made

CELL = "icub/force/twin/karl2016/"


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The verbs in the folder of results: an answer and a trivial one, of five campaigns."""
    verbs = Verbs(tmp_path_factory.mktemp("ran"))
    with Store(verbs.folder / "out").hold() as store:
        for seed in range(1, 6):
            of_it = {"seed": seed, "repeat": seed, "repeats": 5, "fit_s": 1.0}
            made.kept(store, f"{CELL}lasso/{seed}", estimator="lasso", score=0.5 + 0.01 * seed, **of_it)
            made.kept(store, f"{CELL}mean/{seed}", is_baseline=True, score=1.5, **of_it)
    return verbs


def test_every_format_goes_to_a_file_named_for_it(ran):
    for suffix, shape in ((".md", "md"), (".csv", "csv"), (".json", "json"), (".tex", "latex"), (".txt", "table")):
        ran("leaderboard", "out", "--to", f"table{suffix}")
        assert (ran.folder / f"table{suffix}").read_text() == ran("leaderboard", "out", "--format", shape).stdout
    for suffix, begins in ((".xlsx", b"PK"), (".parquet", b"PAR1")):
        ran("leaderboard", "out", "--to", f"table{suffix}")
        assert (ran.folder / f"table{suffix}").read_bytes().startswith(begins)
    assert ".xlsx" in ran("leaderboard", "out", "--to", "table.xls", code=2).stderr
    assert not (ran.folder / "table.xls").exists()
    assert "nowhere/table.md" in ran("leaderboard", "out", "--to", "nowhere/table.md", code=2).stderr


def test_bytes_are_not_written_to_a_terminal(ran):
    with on_terminal(["-m", "tactbench", "leaderboard", "out", "--format", "parquet"], cwd=ran.folder) as terminal:
        assert "--to leaderboard.parquet" in terminal.read_until(None)
        assert terminal.process.wait(30) == 2


def test_rows_are_chosen_by_name_and_unknown_names_are_refused_with_the_known(ran):
    shown = json.loads(ran("leaderboard", "out", "--estimator", "lasso", "--format", "json").stdout)
    assert [row["estimator"] for row in shown] == ["lasso"]
    assert shown[0]["baseline"] is not None
    for option, given, says in (("--sensor", "icup", "Known: icub"), ("--columns", "sensor,scor", "'score'")):
        assert says in ran("leaderboard", "out", option, given, code=2).stderr
    assert "always holds all columns" in ran("leaderboard", "out", "--columns", "#", "--format", "csv", code=2).stderr


def test_the_best_and_columns_of_ones_own_choice(ran):
    best = ran("leaderboard", "out", "--best", "--columns", "sensor,estimator,cell").stdout.splitlines()
    head = next(place for place, line in enumerate(best) if line.split() == ["sensor", "estimator", "cell"])
    assert best[head + 1].split() == ["icub", "lasso", "icub/force/twin/karl2016/lasso"]
    assert best[head + 2] == ""


def test_times_are_left_out_on_request(ran):
    for more, there in (((), True), (("--no-times",), False)):
        assert ("fit_s" in ran("leaderboard", "out", *more, "--format", "csv").stdout) == there
