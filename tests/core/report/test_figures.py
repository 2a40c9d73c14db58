"""All figures of a folder: which there are, what stops none of them, and that they carry the numbers of its rows."""

import shutil

import numpy as np
import pytest
from matplotlib import rc_context
from sklearn.metrics import confusion_matrix

from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.progress import Progress
from tactbench.core.report.figures import answers
from tactbench.core.report.figures.answers import confusion, prediction_against_time
from tactbench.core.report.figures.group import groups, styled
from tactbench.core.report.page import draw_figures
from tactbench.core.report.results import open_results
from tactbench.core.spec.matrix import MatrixSpec
from tests.here import IN_THIS_PROCESS

from .results import make_results
from .unrendered import unrendered

FORCE = ["prediction-against-time", "residuals"]
CURVATURE = ["confusion", "embedding"]
LOST = ("curvature", "forest", "ideal")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A result folder of two sensors that nobody may change."""
    return make_results(tmp_path_factory.mktemp("finished") / "results", "icub", "ideal")


@pytest.fixture
def folder(finished, tmp_path):
    """A result folder of one's own."""
    return shutil.copytree(finished, tmp_path / "results")


def opened(folder):
    return open_results(Store(folder), load_registry())


def group_of(folder, task):
    (found,) = [group for group in groups(opened(folder), [].append) if group.task.name == task]
    return found


def draw(folder, out):
    said = []
    out.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:  # t-SNE takes most of the time of figures
        patch.setattr(answers, "ITERATIONS", 250)
        patch.setattr(answers, "AT_MOST", 100)
        return draw_figures(opened(folder), out, Progress(), said.append), said


def kinds(drawn):
    return [next((kind for kind in FORCE + CURVATURE if one.name.startswith(kind)), one.name) for one in drawn]


@pytest.fixture(scope="module")
def all_of_it(finished, tmp_path_factory):
    out = tmp_path_factory.mktemp("figures")
    return *draw(finished, out), out


def test_the_paper_s_figures_are_drawn_as_pdf_and_png_and_nothing_else(all_of_it):
    drawn, said, out = all_of_it
    assert kinds(drawn) == CURVATURE + FORCE
    assert {path for one in drawn for path in (one.png, one.png.with_suffix(".pdf"))} == set(out.iterdir())
    for one in drawn:
        content = one.png.read_bytes()
        assert content.startswith(b"\x89PNG")
        assert int.from_bytes(content[16:20]) == 700, "3.5 inches of 200 dots"
        assert one.png.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
        assert "†: " in one.caption
    assert ["forest" in one for one in said] == [True], "what is not shown"


def test_the_same_bytes_again_whatever_the_user_s_style(all_of_it, finished, tmp_path):
    with rc_context({"font.size": 30, "pdf.compression": 0, "lines.linewidth": 9}):
        draw(finished, tmp_path / "again")
    first = {path.name: path.read_bytes() for path in all_of_it[2].iterdir()}
    assert {path.name: path.read_bytes() for path in (tmp_path / "again").iterdir()} == first


def test_what_cannot_be_drawn_stops_no_other_figure(folder, tmp_path, all_of_it):
    (name,) = (one.png.name for one in all_of_it[0] if one.name.startswith(FORCE[0]))
    (tmp_path / "figures" / name).mkdir(parents=True)  # cannot be written
    (lost,) = (r for r in opened(folder).rows if (r["task"], r["estimator"], r["sensor"]) == LOST)
    (folder / "cells" / f"{lost['key']}.h5").write_bytes(b"no HDF5")
    shutil.rmtree(folder / "recordings")  # those of the embedding
    with unrendered():
        drawn, said = draw(folder, tmp_path / "figures")
    assert kinds(drawn) == [*CURVATURE[:-1], FORCE[1]]
    assert any("prediction against" in one for one in said)
    assert any(f"{lost['key']}.h5" in one for one in said)


@pytest.fixture(scope="module")
def folds(finished, tmp_path_factory):
    """Results of shuffled folds of the same recordings, two estimators of force."""
    trees = {"name": "forest", "params": {"n_estimators": 3, "max_depth": 6}}
    asked = {"protocol": "deployable", "split": "shuffled"}
    poor = {"name": "lasso", "params": {"lambda_": 50.0}}
    tasks = [
        {"name": "curvature", "estimators": [trees], **asked},
        {"name": "force", "estimators": [poor, "ols"], **asked},
    ]
    matrix = MatrixSpec.model_validate({"rig": "replay", "sensors": ["icub"], "tasks": tasks, "latency": False})
    folder = tmp_path_factory.mktemp("folds")
    run_matrix(matrix, Store(folder), choice=IN_THIS_PROCESS, recordings=finished / "recordings")
    return folder


def test_folds_have_figures_of_their_test_sets(folds, tmp_path):
    with unrendered():
        drawn, said = draw(folds, tmp_path / "figures")
    assert kinds(drawn) == ["confusion", "residuals"]
    assert all("‡: leaks" in one.caption for one in drawn)
    assert len(said) == 3, "of training sets and of an embedding there are several; one estimator is not shown"


def test_without_a_published_number_the_best_estimator_is_shown(folds):
    assert group_of(folds, "force").row["estimator"] == "ols"


def drawn(make, group):
    with styled():
        return make(group)


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
            shown = np.reshape([int(text.get_text().removesuffix("%")) for text in here.texts], (5, 5))
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
            assert here.get_title() == f"{panel.sensor}, {role}\nRMSE {error:.4f} N"
