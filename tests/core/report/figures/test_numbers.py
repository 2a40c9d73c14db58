"""Figures carry the numbers of the rows: read back from what was drawn."""

import numpy as np
import pytest
from sklearn.metrics import confusion_matrix, f1_score

from tactbench.core.report.figures import (
    confusion,
    prediction_against_time,
    score_by_force,
)
from tactbench.core.report.figures.style import styled

from .conftest import group_of


def drawn(make, group):
    with styled():
        return make.draw(group)


def test_confusion_shows_the_row_s_own_counts_and_those_of_the_validation_set(finished):
    group = group_of(finished, "curvature")
    axes = drawn(confusion, group).figure.axes
    for place, panel in enumerate(group.panels):
        asked = panel.answers["validation"]
        validation = confusion_matrix(asked.y_true, asked.y_pred, labels=range(5))
        for here, role, table in zip(
            axes[2 * place :], ("validation", "test"), (validation, np.array(panel.row["confusion"])), strict=False
        ):
            assert here.get_title() == f"{panel.sensor}, {role}"
            shown = np.reshape([int(text.get_text()) for text in here.texts], (5, 5))
            # Half a per cent: the numbers are whole per cents.
            np.testing.assert_allclose(shown, 100 * table / table.sum(axis=1, keepdims=True), atol=0.5 + 1e-9)
            assert [tick.get_text() for tick in here.get_yticklabels()] == ["5", "7.5", "10", "20", "40"]


def test_prediction_against_time_shows_every_answer(finished):
    group = group_of(finished, "force")
    axes = drawn(prediction_against_time, group).figure.axes
    for place, panel in enumerate(group.panels):
        for column, role in enumerate(("train", "test")):
            here, answers = axes[2 * place + column], panel.answers[role]
            dots, line = here.get_lines()
            np.testing.assert_array_equal(dots.get_ydata(), answers.y_true)
            np.testing.assert_array_equal(line.get_ydata(), answers.y_pred)
            np.testing.assert_array_equal(line.get_xdata(), answers.time_s)
            error = np.sqrt(np.mean((answers.y_true - answers.y_pred) ** 2))
            assert here.texts[0].get_text() == f"RMSE {error:.4f} N"


def test_banded_scores_are_those_of_scikit_learn_on_the_same_rows(finished):
    group = group_of(finished, "curvature")
    lines = {line.get_label(): line for line in drawn(score_by_force, group).figure.axes[0].get_lines()}
    for panel in group.panels:
        test = panel.answers["test"]
        force = score_by_force.smoothed_force(test)
        scores, rows = score_by_force.banded(group, panel)
        masks = (force < 1.5, (force >= 1.5) & (force < 3.0), force >= 3.0)
        expected = [
            f1_score(test.y_true[mask], test.y_pred[mask], labels=range(5), average="macro", zero_division=0.0)
            for mask in masks
        ]
        assert rows == [mask.sum() for mask in masks]
        # Sums of whole counts: only the order of a mean of five differs.
        assert scores == pytest.approx(expected, rel=1e-12)
        assert list(lines[panel.sensor].get_ydata()) == scores
