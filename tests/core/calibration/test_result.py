"""A finished calibration can be read back, and one says which is shown."""

import json

import pytest

from tactbench.core.calibration.draw import Draw
from tactbench.core.calibration.result import CalibrationResult, load_result, write_result
from tactbench.core.calibration.summary import records, summary
from tactbench.core.errors import FormatError
from tests.core.calibration.toy import draws, procedure


def _result(n=40):
    failed = Draw(n, 3, draws(n + 1)[n].parameters, {}, "failed", 'no "way", at all')
    return CalibrationResult(procedure(), 5, (*draws(n), failed), {"commit": "c"}, 12.0)


def test_what_is_written_is_read_back_to_the_last_bit(tmp_path):
    write_result(_result(), tmp_path / "calibration")
    found = load_result(tmp_path)
    assert (found.spec, found.draws, found.seed) == (_result().spec, _result().draws, 5)
    assert str(tmp_path) in found.shown


def test_without_one_of_its_own_a_folder_gets_the_one_that_came_along(tmp_path):
    found = load_result(tmp_path)
    assert found is None or "came with tactbench" in found.shown


@pytest.mark.parametrize("break_it", [("run.json", "{"), ("draws.csv", "draw,seed\n1,2\n"), ("run.json", "{}")])
def test_damaged_files_are_refused_with_the_next_step(tmp_path, break_it):
    write_result(_result(), tmp_path / "calibration")
    (tmp_path / "calibration" / break_it[0]).write_text(break_it[1])
    with pytest.raises(FormatError, match="not a finished calibration"):
        load_result(tmp_path)


def test_a_summary_is_plain_data_and_leaves_failed_draws_out():
    told = summary(_result())
    assert (len(told.draws), told.failed) == (40, 1)
    tables = records(told)
    assert json.loads(json.dumps(tables, allow_nan=False)) == tables
    assert {line["output"] for line in tables["published"]} == {"narrow", "tall", "both"}
    assert tables["findings"][0]["prior_n"] == 40


def test_a_cheap_answer_is_held_against_the_dear_one():
    outputs = [one.model_dump(mode="json") for one in procedure().outputs]
    dear = [{**outputs[0], "name": name + "_dear", "only_first": 12, "stands_for": name} for name in ("tall", "both")]
    spec = procedure(outputs=[*outputs, *dear])
    some = [
        Draw(one.number, one.seed, one.parameters,
             {**one.outputs, "tall_dear": one.outputs["tall"] - 0.5, "both_dear": -one.outputs["both"]}
             if one.number < 12 else one.outputs)
        for one in draws(40)
    ]  # fmt: skip
    told = summary(CalibrationResult(spec, 5, tuple(some), {}, 0.0))
    tall, both = told.agreements
    assert (tall.n, tall.rank_correlation) == (12, pytest.approx(1.0))
    assert (tall.mean_difference, tall.largest_difference) == (pytest.approx(0.5), pytest.approx(0.5))
    assert both.rank_correlation == pytest.approx(-1.0)
    (verdict,) = told.verdicts
    by_hand = [
        (one.outputs["tall"] - one.outputs["both"] > 3) == (one.outputs["tall"] - 0.5 + one.outputs["both"] > 3)
        for one in draws(12)
    ]
    assert (verdict.alike.hits, verdict.alike.n) == (sum(by_hand), 12)
