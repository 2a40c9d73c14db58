"""What stands together, in what order, in which columns."""

import json
import random

import pytest

from tactbench.core.errors import UnknownNameError
from tactbench.core.leaderboard.formats import ALL, best, grids, known_columns, rendered
from tactbench.core.leaderboard.names import (
    OF_ROWS,
    answer_name,
    direction,
    hardware_name,
    metric_name,
    sensor_name,
    split_name,
)
from tactbench.core.leaderboard.table import build_table
from tactbench.core.tables.text import Entry

from .rows import hostile_rows, row

FLOOR = {"reference_floor": 0.6875, "score_beyond_floor": 0.1234, "beyond_floor_ci_low": 0.0,
         "beyond_floor_ci_high": 0.2, "true_score": 0.0512}  # fmt: skip


def over_sessions(sensor, estimator="lasso", score=0.5, spread=(0.0, 0.01, 0.02, 0.03, 0.04, 0.05), **more):
    """A row over six sessions; `spread` is added to its errors."""
    sums = [[10 * (score + one) ** 2, 10.0] for one in spread]
    kept = {"unit": "session", "names": list("abcdef"), "strata": None, "sums": sums}
    more |= {"replicates": kept, "n_replicates": 6, "replicate_unit": "session", "simulated": False}
    return row(sensor, estimator, score, **more)


@pytest.mark.parametrize(
    ("scores", "more", "found"),
    [
        ((0.7, 0.5), {}, [("1", "b"), ("2", "a")]),
        ((0.5, 0.5, 0.9), {}, [("1=", "a"), ("1=", "b"), ("3", "c")]),
        ((0.7, 0.9), {"metric": "macro_f1", "unit": "1", "replicates": {}, "ci_low": None}, [("", "b"), ("", "a")]),
    ],
)
def test_the_best_stands_first_and_equal_scores_share_a_place(scores, more, found):
    rows = [over_sessions(name, score=value) | more for name, value in zip("abc", scores, strict=False)]
    for order in (rows, rows[::-1]):
        (block,) = build_table(order).blocks
        assert [(line.texts["place"], line.texts["sensor"]) for line in block.lines] == found
        for one, (place, _) in zip(json.loads(rendered(build_table(order), "json")), found, strict=True):
            assert (one["shown"]["rank"], str(one["rank"] or "")) == (place, place.rstrip("="))
            assert one["rank_tied"] == (place.endswith("=") if place else None)
            assert not place or (one["rank_low"], one["rank_high"]) == ((1, 2) if place == "1=" else (one["rank"],) * 2)


@pytest.mark.parametrize(("spread", "mark"), [((0.2,) * 6, ""), ((-0.2, 0.4, -0.1, 0.4, -0.2, 0.4), "*")])
def test_an_answer_is_marked_whose_difference_from_the_trivial_one_may_be_0(spread, mark):
    rows = [over_sessions("a"), over_sessions("a", "mean", spread=spread, is_baseline=True) | {"score": 0.6}]
    (block,) = build_table(rows).blocks
    assert (block.lines[0].kind, block.lines[0].texts["notes"]) == ("result", mark)


def test_every_row_is_one_line_in_whatever_order_they_come_and_no_block_mixes_what_is_not_comparable():
    rows = hostile_rows()
    blocks = build_table(rows).blocks
    assert sorted(line.row["cell"] for block in blocks for line in block.lines) == sorted(one["cell"] for one in rows)
    for block in blocks:
        done = [line.row for line in block.lines if line.row["status"] == "done"]
        assert len({(one["task"], one["protocol"], one["split"], one["simulated"]) for one in done}) <= 1
        assert len({one["rig"] for one in done if not one["simulated"]}) <= 1
    assert rendered(build_table(rows), "json") == rendered(build_table(rows[::-1]), "json")


def test_a_cell_that_was_not_begun_stands_with_those_of_its_rig_where_these_agree():
    stopped = row("c", status="failed", score=None, simulated=False, split=None, reason="no")
    (block,) = build_table([row(), stopped]).blocks
    assert block.origin.startswith("SIMULATED")
    assert [line.kind for line in block.lines] == ["result", "failed"]
    assert [len(one.lines) for one in build_table([row(), row("b", split="roles"), stopped]).blocks] == [1, 1, 1]


def test_shuffled_rows_and_probes_come_after_what_is_kept_apart():
    rows = [row(split="shuffled"), row(protocol="first-frame"), row(split="trial"), row(task="another", split="z")]
    random.Random(1).shuffle(rows)
    blocks = build_table(rows, questions={"another": "Which?"}).blocks
    assert [block.title for block in blocks] == ["Another: which?", *["Question"] * 3]
    for block, name in zip(blocks[1:], ("trial", "first-frame", "shuffled"), strict=True):
        assert name in block.setting


def test_columns_that_say_nothing_are_left_out_and_others_shown_if_asked_for():
    (grid,) = grids(build_table([row()]))
    assert grid.columns == ("place", "sensor", "estimator", "score", "interval", "training")
    (grid,) = grids(build_table([row(**FLOOR)]), ALL)
    assert {"beyond floor", "test samples", "latency p50", "cell"} <= set(grid.columns)
    (grid,) = grids(build_table([row(cell="a/b")]), known_columns(["cell", "score", "rank", "cell"]))
    assert grid.lines == (("a/b", "0.5000", "1"),)
    with pytest.raises(UnknownNameError, match=r"'score'.*cell"):
        known_columns(["scor"])


def test_a_trivial_answer_that_was_skipped_stands_in_the_note_alone():
    ended = {"status": "skipped", "score": None, "reason": "Why."}
    rows = [row(), row(estimator="time-index", is_baseline=True, **ended), row("b", **ended)]
    table = build_table(rows)
    assert [[line[1] for line in grid.lines] for grid in grids(table)] == [["a", "b"]]
    assert any("a/time-index, b/lasso" in note and "Why." in note for note in table.blocks[0].notes)
    assert len(grids(build_table(rows[1:2]))[0].lines) == 1


def test_names_and_the_values_that_columns_are_sorted_by():
    real = {"simulated": False, "rig": "arm", "metric": "true_mae", "unit": "1", "params": {"b": 2, "a": 1}}
    names = [[name(row(**more)) for name in (sensor_name, hardware_name, metric_name, answer_name, direction)]
             for more in ({}, {"emulated": True}, real)]  # fmt: skip
    assert names == [
        ["a SIM", "SIM", "RMSE [N]", "lasso", "lower is better"],
        ["a EMULATED", "EMULATED (rig twin)", "RMSE [N]", "lasso", "lower is better"],
        ["a", "rig arm", "true MAE", "lasso (a=1, b=2)", "lower is better"],
    ]
    assert metric_name(row(metric="own (x)")) == "own [N]"
    assert list(map(split_name, ("roles", "few-shot-2", "object"))) == [
        "tested on recordings apart from training", "split few-shot-2", "split by object",
    ]  # fmt: skip
    ends = {"beyond_floor_ci_low": 0.125, "beyond_floor_ci_high": 0.25, "score_beyond_floor": 0.2}
    (line,) = build_table([row(answer_delay_ms=2.0, sim_s=3.0, score_min=0.4, **ends)]).lines
    values = {name: text.value for name, text in line.texts.items() if isinstance(text, Entry)}
    assert values == pytest.approx({
        "place": 1, "score": 0.5, "interval": 0.4, "beyond floor": 0.2, "interval beyond floor": 0.125,
        "test samples": 4400.0,
        "delay after touch": 2e-3, "training": 0.5, "simulation": 3.0, "latency p50": 2e-5, "latency p95": 3e-5,
    })  # fmt: skip
    assert (line.texts["score"].cell, line.texts["range"]) == (line.row["cell"], "")


def test_scores_of_units_stand_where_there_are_too_few_for_an_interval():
    few = {"ci_low": None, "ci_high": None, "score_min": 0.1, "score_max": 0.4, "replicate_unit": "replicate"}
    found = [
        OF_ROWS["range"].text(row(**few | {"replicate_scores": scores} | more))
        for scores, more in (([0.1], {}), ([0.1, 0.4], {}), ([0.1, 0.2, 0.3, 0.4], {"replicate_unit": "session"}),
                             ([0.1, 0.2, 0.2, 0.3, 0.4], {}), ([0.1, 0.4], {"ci_low": 0.1}))
    ]  # fmt: skip
    assert found == ["–", "0.1000, 0.4000", "0.1000, 0.2000, 0.3000, 0.4000 by session", "0.1000 … 0.4000", "–"]


def test_events_have_a_table_of_their_own():
    known = {"events": 7.0, "alarms": 2.0, "misses": 3.0, "recall": 4 / 7, "bound of false alarms per minute": 1.0,
             "area up to false alarms per minute": 20.0, "false alarms per minute": 0.123456}  # fmt: skip
    rows = [row(events=known), row("b", "mean", events=known | {"alarms": 0}, is_baseline=True), row("c")]
    (table,) = build_table(rows).sections
    assert dict(zip(table.columns, table.lines[0], strict=True)) == {
        "task": "question", "sensor": "a", "estimator": "lasso", "recall": "0.571", "misses": "3", "events": "7",
        "latency p50 [ms]": "–", "false alarms/min": "0.123",
    }  # fmt: skip
    assert (table.lines[1][-2], table.kinds) == ("never alarms", ("result", "baseline"))
    assert "at most 1 false" in table.title
    assert "to 20." in table.notes[0]
    assert build_table(rows[2:]).sections == ()


def test_the_best_of_each_sensor_keep_the_places_they_have_among_all():
    rows = [over_sessions(name, estimator, score) for name, estimator, score in (
        ("a", "lasso", 0.5), ("a", "ols", 0.6), ("b", "lasso", 0.7), ("b", "mean", 1.4),
    )]  # fmt: skip
    (block,) = best(build_table(rows), 1).blocks
    assert [(line.texts["place"], line.texts["sensor"]) for line in block.lines] == [("1", "a"), ("3", "b")]
