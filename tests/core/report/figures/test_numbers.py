"""Figures carry the numbers of the rows: read back from what was drawn."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from sklearn.metrics import confusion_matrix, f1_score

from tactbench.core.report.figures import (
    confusion,
    prediction_against_time,
    residuals,
    score_by_force,
    validation_curve,
)
from tactbench.core.report.figures.style import COLUMN_IN, ordered, styled
from tactbench.core.report.smoothing import smoothed_force

from .made import group_of


def ignore(_):
    pass


def drawn(make, group):
    with styled():
        return make.draw(group, ignore)


def squares(axes, n):
    """Return the numbers in the squares of a confusion panel, and the counts beside it."""
    inside, beside = np.full((n, n), -1), np.full(n, -1)
    for text in axes.texts:
        x, y = text.get_position()
        if text.get_text() == "n":
            continue
        if x > n - 0.5:
            beside[round(y)] = int(text.get_text())
        else:
            inside[round(y), round(x)] = int(text.get_text())
    return inside, beside


def test_confusion_shows_the_row_s_own_counts(finished):
    group = group_of(finished, "curvature")
    axes = drawn(confusion, group).figure.axes
    for place, panel in enumerate(group.panels):
        table = np.array(panel.row["confusion"])
        for_test = axes[2 * place + 1]
        assert for_test.get_title() == f"{panel.sensor}, test"
        inside, beside = squares(for_test, 5)
        np.testing.assert_array_equal(beside, table.sum(axis=1))
        # Half a per cent: the numbers are whole per cents.
        np.testing.assert_allclose(inside, 100 * table / table.sum(axis=1, keepdims=True), atol=0.5 + 1e-9)
        assert [tick.get_text() for tick in for_test.get_yticklabels()] == ["5", "7.5", "10", "20", "40"]
    assert "cap radius [mm]" in axes[0].get_ylabel()


def test_confusion_on_validation_is_that_of_scikit_learn(finished):
    panel = group_of(finished, "curvature").panels[1]
    asked = panel.answers["validation"]
    np.testing.assert_array_equal(
        confusion.matrices(panel)["validation"], confusion_matrix(asked.y_true, asked.y_pred, labels=range(5))
    )
    assert not np.array_equal(confusion.matrices(panel)["validation"], confusion.matrices(panel)["test"])


def test_a_class_that_never_occurs_has_a_row_of_zeros():
    np.testing.assert_array_equal(confusion.shares(np.array([[1, 3], [0, 0]])), [[0.25, 0.75], [0.0, 0.0]])


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
            assert (dots.get_linestyle(), line.get_linestyle()) == ("None", "-")
            error = np.sqrt(np.mean((answers.y_true - answers.y_pred) ** 2))
            assert here.texts[0].get_text() == f"RMSE {error:.4f} N"
        assert axes[2 * place].get_title() == f"{panel.sensor}, training"
    assert axes[-1].get_xlabel() == "time [s]"


def test_recordings_of_a_set_stand_end_to_end(finished):
    answers = group_of(finished, "curvature").panels[0].answers["test"]
    time = prediction_against_time.end_to_end(answers)
    assert len(np.unique(answers.recording)) == 5
    assert (np.diff(time) >= 0).all()
    for one in np.unique(answers.recording):
        mine = answers.recording == one
        np.testing.assert_allclose(np.diff(time[mine]), np.diff(answers.time_s[mine]), atol=1e-9)


def test_residuals_show_every_test_answer_and_the_line_of_perfect_ones(finished):
    group = group_of(finished, "force")
    axes = drawn(residuals, group).figure.axes
    for here, panel in zip(axes, group.panels, strict=True):
        dots, line = here.get_lines()
        np.testing.assert_array_equal(dots.get_xdata(), panel.answers["test"].y_true)
        np.testing.assert_array_equal(dots.get_ydata(), panel.answers["test"].y_pred)
        np.testing.assert_array_equal(line.get_xdata(), line.get_ydata())


def test_the_validation_curve_holds_every_candidate_and_rings_the_chosen_one(finished):
    group = group_of(finished, "force")
    axes = drawn(validation_curve, group).figure.axes
    for here, panel in zip(axes, group.panels, strict=True):
        lines = {line.get_label(): line for line in here.get_lines()}
        shown = {
            (x, int(name.removeprefix("k = ")), y)
            for name, line in lines.items()
            if name != "chosen"
            for x, y in zip(*line.get_data(), strict=True)
        }
        assert shown == {(one["lambda_"], one["k"], one["score"]) for one in panel.row["search"]}
        (at,), (score,) = lines["chosen"].get_data()
        assert at == panel.row["chosen"]["lambda_"]
        assert score == min(one["score"] for one in panel.row["search"])
        assert here.get_xscale() == "log"


SEARCH = [
    {"a": a, "b": b, "k": k, "fold": fold, "score": 100 * a + 10 * b + k + (1 if fold == "y" else 0)}
    for a in (0.0, 1.0) for b in (1.0, 2.0) for k in (0, 3) for fold in ("x", "y")
]  # fmt: skip


@pytest.mark.parametrize(("higher", "expected"), [(True, [20.5, 120.5]), (False, [10.5, 110.5])])
def test_a_curve_is_the_mean_over_folds_and_the_best_over_other_parameters(higher, expected):
    assert validation_curve.searched(SEARCH) == ["a", "b"]
    assert validation_curve.curve(SEARCH, "a", 0, higher) == ([0.0, 1.0], expected)


def test_k_is_shown_where_nothing_else_was_searched():
    assert validation_curve.searched([{"p": "x", "k": k, "score": 0.0, "fold": "f"} for k in (0, 5)]) == ["k"]
    assert validation_curve.searched([{"p": "x", "k": 0, "score": 0.0, "fold": "f"}]) == []


def test_banded_scores_are_those_of_scikit_learn_on_the_same_rows(finished):
    group = group_of(finished, "curvature")
    shown = drawn(score_by_force, group).figure.axes[0].containers
    for panel, container in zip(group.panels, shown, strict=True):
        test = panel.answers["test"]
        force = smoothed_force(test)
        bands = score_by_force.banded(group, panel)
        masks = (force < 1.5, (force >= 1.5) & (force < 3.0), force >= 3.0)
        assert sum(band.rows for band in bands) == len(test)
        for band, mask, drawn_at in zip(bands, masks, container.lines[0].get_ydata(), strict=True):
            expected = f1_score(
                test.y_true[mask], test.y_pred[mask], labels=range(5), average="macro", zero_division=0.0
            )
            assert band.rows == mask.sum() > 0
            # Sums of whole counts: only the order of a mean of five differs.
            assert band.score == pytest.approx(expected, rel=1e-12)
            assert drawn_at == band.score
            assert band.low <= band.score <= band.high


def test_every_interval_of_a_band_narrows_where_all_answers_are_right(finished):
    from dataclasses import replace

    group = group_of(finished, "curvature")
    panel = group.panels[0]
    test = panel.answers["test"]
    right = replace(panel, answers={"test": replace(test, y_pred=test.y_true)})
    # Not one error still leaves room for half of one: in log-odds, 2 sqrt(2) below it, a factor of 17 of 1 / (2 n).
    for band in score_by_force.banded(group, right):
        assert (band.score, band.high) == (1.0, 1.0)
        assert 1 - 10 / band.rows < band.low < 1.0


@pytest.mark.parametrize("task", ["force", "curvature"])
def test_text_is_legible_at_a_column_s_width(finished, task):
    from tactbench.core.report.figures.drawing import FIGURES

    group = group_of(finished, task)
    made = 0
    for draw in FIGURES[group.task.kind]:
        try:
            with styled():
                figure = draw(group, ignore).figure
        except ValueError:
            continue  # what does not apply here
        assert figure.get_figwidth() <= COLUMN_IN
        assert min(text.get_fontsize() for text in figure.findobj(Text)) >= 7.0
        made += 1
    assert made == 3


def test_ordered_colours_are_ordered_in_grey_too():
    weights = np.array([0.2126, 0.7152, 0.0722])  # relative luminance, ITU-R BT.709
    grey = [float(weights @ to_rgb(colour)) for colour in ordered(6)]
    assert all(dark + 0.02 < light for dark, light in itertools.pairwise(grey))
    assert max(grey) < 0.85
