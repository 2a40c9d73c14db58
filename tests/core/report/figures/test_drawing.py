"""All figures of a folder: which there are, what stops none of them, and that bytes do not depend on the day."""

import shutil

import pytest
from matplotlib import rc_context

from tactbench.core.matrix.progress import Progress
from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.report.figures import embedding_map
from tactbench.core.report.figures.drawing import draw_figures
from tactbench.core.spec.matrix import MatrixSpec
from tests.core.report.unrendered import unrendered
from tests.here import IN_THIS_PROCESS

from .conftest import opened

PUBLISHED = ["published-and-ours"]
FORCE = ["prediction-against-time", "residuals"]
CURVATURE = ["confusion", "score-by-force", "embedding"]
LOST = ("curvature", "forest", "ideal")


def draw(folder, out):
    said = []
    out.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:  # t-SNE takes most of the time of figures
        patch.setattr(embedding_map, "ITERATIONS", 250)
        patch.setattr(embedding_map, "AT_MOST", 100)
        return draw_figures(opened(folder), out, Progress(), said.append), said


def kinds(drawn):
    return [next((kind for kind in FORCE + CURVATURE if one.name.startswith(kind)), one.name) for one in drawn]


@pytest.fixture(scope="module")
def all_of_it(finished, tmp_path_factory):
    out = tmp_path_factory.mktemp("figures")
    return *draw(finished, out), out


def test_the_paper_s_figures_are_drawn_as_pdf_and_png_and_nothing_else(all_of_it):
    drawn, said, out = all_of_it
    assert kinds(drawn) == PUBLISHED + CURVATURE + FORCE
    assert {path for one in drawn for path in (one.png, one.png.with_suffix(".pdf"))} == set(out.iterdir())
    for one in drawn:
        assert one.png.read_bytes().startswith(b"\x89PNG")
        assert one.png.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
        assert "SIM: simulated" in one.caption
        assert "†: each set, the test set too, is scaled by its own mean" in one.caption
    assert [one.partition(";")[2] for one in said] == [" not shown: forest (max_depth=6, n_estimators=3)."]


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
    assert kinds(drawn) == [*PUBLISHED, *CURVATURE[:-1], FORCE[1]]
    assert any(one.startswith("No prediction against time of force") for one in said)
    assert any(f"{lost['key']}.h5" in one for one in said)


def test_folds_have_figures_of_their_test_sets(finished, tmp_path):
    trees = {"name": "forest", "params": {"n_estimators": 3, "max_depth": 6}}
    asked = {"protocol": "deployable", "split": "shuffled", "estimators": [trees]}
    tasks = [{"name": name, **asked} for name in ("curvature", "force")]
    matrix = MatrixSpec.model_validate({"rig": "replay", "sensors": ["icub"], "tasks": tasks, "latency": False})
    run_matrix(matrix, Store(tmp_path / "folds"), choice=IN_THIS_PROCESS, recordings=finished / "recordings")
    with unrendered():
        drawn, said = draw(tmp_path / "folds", tmp_path / "figures")
    assert kinds(drawn) == ["confusion", "score-by-force", "residuals"]
    assert all("‡: leaks" in one.caption for one in drawn)
    assert len(said) == 2, "of training sets and of an embedding there are several"
