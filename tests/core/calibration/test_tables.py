"""Tables and figures of a calibration: everything that is known is there, and nothing that is not."""

import numpy as np

from tactbench.core.calibration.draw import finished
from tactbench.core.calibration.figure import draws_figure, save, sensitivity_figure
from tactbench.core.calibration.result import CalibrationResult
from tactbench.core.calibration.sensitivity import sensitivities
from tactbench.core.calibration.summary import summary
from tactbench.core.calibration.tables import markdown, text_tables
from tests.core.calibration.toy import draws, procedure


def _result(n, **more):
    return CalibrationResult(procedure(**more), 5, tuple(draws(n)), {"commit": "c"}, 90.0)


def test_the_document_has_every_table_and_who_made_the_draws():
    result = _result(60, at_least=20)
    told = summary(result)
    said = markdown(result, told)
    assert said.startswith("## Toy\n\nSIM. 60 draws with seed 5; 2 minutes of processor time; commit c.")
    for table in text_tables(result, told):
        assert f"### {table.title}" in said.replace("\\*", "*")
    for words in ("| narrow | fitted | 0.740818 |", "| both | held out |", "placement_scatter_mm", "tall exceeds both"):
        assert words in said
    assert f"{told.n_near} of 60 draws lie within 1 scales of every fitted number" in said
    assert "the 20 nearest are accepted" in said


def test_too_few_draws_are_said_to_be_too_few():
    result = _result(4)
    said = markdown(result, summary(result))
    assert "| too few |" in said
    assert "Partial rank correlations" not in said


def _figures(n):
    result = _result(n)
    some = finished(result.draws)
    found = sensitivities(result.spec, some, np.random.default_rng(0))
    return sensitivity_figure(result.spec, found), draws_figure(result.spec, some)


def test_figures_of_many_draws_are_saved(tmp_path):
    paths = [tmp_path / "a.png", tmp_path / "a.pdf", tmp_path / "b.png", tmp_path / "b.pdf"]
    sensitivity, draws = _figures(60)
    save(sensitivity, paths[:2])
    save(draws, paths[2:])
    for path in paths:
        assert path.stat().st_size > 1000


def test_figures_of_few_draws_show_what_there_is_and_say_what_is_not():
    sensitivity, draws = _figures(3)
    assert [text.get_text() for text in sensitivity.texts] == ["no correlations:\ntoo few draws, or nothing varies"]
    assert all(axes.has_data() for axes in draws.axes)
    for figure in (sensitivity, draws):
        figure.draw_without_rendering()
