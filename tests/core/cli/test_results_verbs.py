"""``leaderboard``, ``compare`` and ``choose``: what they make of a result folder."""

import csv
import io
import json

import numpy as np
import pytest

from tactbench.core.matrix.store import Store
from tests.conftest import Verbs
from tests.core.matrix import made

WISH = ("--task", "force", "--max-delay-ms", "2", "--range-n", "5", "--rate-hz", "10")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The verbs beside results of two sensors, one worse than the other: two answers and a trivial one, five times."""
    verbs, rng = Verbs(tmp_path_factory.mktemp("ran")), np.random.default_rng(0)
    with Store(verbs.folder / "out").hold() as store:
        for sensor, worse in (("biotac", 0.2), ("icub", 0.0)):
            for estimator, score in (("ols", 0.52), ("lasso", 0.5), ("mean", 1.5)):
                for seed, one in enumerate((score + worse + 0.02 * rng.standard_normal(5)).tolist(), 1):
                    named = {"sensor": sensor, "estimator": estimator, "is_baseline": estimator == "mean"}
                    of_it = {"protocol": "deployable", "seed": seed, "fit_s": 1.0}
                    cell = f"{sensor}/force/twin/deployable/{estimator}/{seed}"
                    made.kept(store, cell, score=one, **named, **of_it)
    return verbs


def test_every_format_goes_to_a_file_named_for_it(ran):
    for suffix, shape in ((".md", "md"), (".csv", "csv"), (".json", "json"), (".tex", "latex"), (".txt", "table")):
        ran("leaderboard", "out", "--to", f"table{suffix}")
        assert (ran.folder / f"table{suffix}").read_text() == ran("leaderboard", "out", "--format", shape).stdout
    assert ".csv" in ran("leaderboard", "out", "--to", "table.xls", code=2).stderr
    assert not (ran.folder / "table.xls").exists()


def test_rows_and_columns_are_chosen_by_name_and_unknown_names_are_refused_with_the_known(ran):
    lasso = json.loads(ran("leaderboard", "out", "--estimator", "lasso", "--format", "json").stdout)
    assert [(row["sensor"], row["estimator"]) for row in lasso] == [("icub", "lasso"), ("biotac", "lasso")]
    assert lasso[0]["baseline"] is not None
    best = ran("leaderboard", "out", "--best", "--columns", "sensor,estimator,cell").stdout
    assert "icub/force/twin/deployable/lasso\n" in best
    assert "  ols  " not in best
    for option, given, says in (("--sensor", "icup", "names: biotac, icub"), ("--columns", "sensor,scor", "'score'")):
        assert says in ran("leaderboard", "out", option, given, code=2).stderr
    ran("leaderboard", "out", "--columns", "sensor", "--format", "csv", code=2)


def test_two_sensors_are_compared_in_every_format(ran):
    asked = ("compare", "biotac", "icub", "--out", "out")
    records = json.loads(ran(*asked, "--format", "json").stdout)
    assert {record["of"] for record in records} == {"ols", "lasso"}
    assert all(record["p_holm"] >= record["p"] for record in records)
    assert all(record["low"] <= record["difference"] <= record["high"] for record in records)
    lines = list(csv.DictReader(io.StringIO(ran(*asked, "--format", "csv").stdout)))
    assert [float(line["difference"]) for line in lines] == [record["difference"] for record in records]
    first = f"{abs(records[0]['difference']):.4f}"
    for shape in ("table", "md", "latex"):
        assert first in ran(*asked, "--format", shape).stdout


def test_a_folder_against_itself_differs_nowhere_and_what_is_not_there_is_named(ran):
    records = json.loads(ran("compare", "out", "out", "--format", "json").stdout)
    assert {(record["difference"], record["p"], record["paired"]) for record in records} == {(0.0, 1.0, True)}
    for words, nearest in (("biotack", "icub"), "biotac"), (("biotac", "icub", "--task", "forse"), "force"):
        assert nearest in ran("compare", *words, "--out", "out", code=2).stderr


def test_folders_are_merged_with_their_tables_and_what_is_not_theirs_is_named(ran):
    done = ran("merge", "out", "out", "--out", "both")
    assert done.stdout == "both\n"
    assert "30 cells, 0 recordings" in done.stderr
    assert (ran.folder / "both" / "leaderboard.json").read_text() == ran(
        "leaderboard", "out", "--format", "json"
    ).stdout
    ran("merge", "out", "--out", "both", code=2)


def test_results_of_ones_own_are_chosen_from_before_those_that_came_along(verbs):
    shipped = verbs("choose", *WISH)
    assert "came with" in shipped.stderr
    assert "unknown" in shipped.stdout, "the force range of the iCub"
    with Store(verbs.folder / "tactbench-results").hold() as store:
        made.kept(store, "icub/force/twin/karl2016/ols/1", estimator="ols", dagger=True)
    shown = verbs("choose", *WISH)
    assert "karl2016" in shown.stdout
    verbs("choose", "--task", "force", "--max-delay-ms", "0", code=2)
    (best,) = json.loads(verbs("choose", *WISH, "--format", "json").stdout)
    assert (best["task"], best["protocol"]) == ("force", "karl2016")
    verbs("choose", *WISH, "--protocol", "deployable", code=2)
    assert "tactbench-results" in shown.stderr
    # A task of which the folder has nothing is answered from what came along, unless the folder was asked for.
    assert "came with" in verbs("choose", "--task", "curvature").stderr
    assert "curvature" in verbs("choose", "tactbench-results", "--task", "curvature", code=2).stderr
