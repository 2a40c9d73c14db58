"""All figures of a folder: which there are, what stops none of them, and that bytes do not depend on the day."""

import os
import subprocess
import sys

import matplotlib
import pytest

from tactbench.core.errors import UsageError
from tactbench.core.report.figures import draw_figures
from tests.core.report.unrendered import unrendered

from .made import opened, results

PUBLISHED = ["published-and-ours", "published-and-ours-column"]
FORCE = ["prediction-against-time", "residuals", "validation-curve"]
CURVATURE = ["confusion", "score-by-force", "embedding"]


class Told:
    """A progress that remembers."""

    def __init__(self):
        self.total, self.steps = 0, []

    def begin(self, stage, total, *, alone=True):
        self.total += total

    def advance(self, what):
        self.steps.append(what)

    def working(self, what):
        pass


def draw(folder, out, told=None):
    said = []
    drawn = draw_figures(opened(folder), out, told, said.append)
    return drawn, said


def kinds(drawn):
    return [next((kind for kind in FORCE + CURVATURE if one.name.startswith(kind)), one.name) for one in drawn]


@pytest.fixture(scope="module")
def all_of_it(finished, tmp_path_factory):
    out, told = tmp_path_factory.mktemp("figures"), Told()
    drawn, said = draw(finished, out, told)
    assert len(told.steps) == told.total == 7  # six figures, and one that does not apply
    return drawn, said, out


@pytest.fixture(scope="module")
def one_failed(tmp_path_factory):
    """Results of one question, in which the second sensor's cells have failed."""
    return results(tmp_path_factory.mktemp("failed"), tasks=("force",), dead=("flat-test",))


def test_the_paper_s_figures_are_drawn_as_pdf_and_png_and_nothing_else(all_of_it):
    drawn, said, out = all_of_it
    assert kinds(drawn) == PUBLISHED + CURVATURE + FORCE
    assert len({one.name for one in drawn}) == 8
    assert {path for one in drawn for path in (one.png, one.pdf)} == set(out.iterdir())
    for one in drawn:
        assert one.png.read_bytes().startswith(b"\x89PNG")
        assert one.pdf.read_bytes().startswith(b"%PDF")
        assert one.pdf.stat().st_size < 500_000
        assert one.title
        assert one.caption.endswith(".")
        assert len(one.keys) == 2
    assert said == [
        "No validation curve of curvature under karl2016, split roles: nothing was chosen on validation data"
    ]


def test_marks_are_explained(all_of_it):
    for one in all_of_it[0]:
        assert "SIM: simulated" in one.caption
        assert "†: each set, the test set too, is scaled by its own mean" in one.caption


def test_the_embedding_says_what_it_is(all_of_it):
    (caption,) = (one.caption for one in all_of_it[0] if one.name.startswith("embedding"))
    for words in ("points (all of ", "perplexity 30", "distances between clusters", "mean little", "seed 1"):
        assert words in caption


def test_the_same_bytes_in_another_process_whatever_the_user_s_style(all_of_it, finished, tmp_path):
    (tmp_path / "matplotlibrc").write_text("font.size: 30\npdf.compression: 0\nlines.linewidth: 9\n")
    script = (
        "import sys; from pathlib import Path\n"
        "from tactbench.core.matrix.store import Store\n"
        "from tactbench.core.plugins.registry import load_registry\n"
        "from tactbench.core.report.figures import draw_figures\n"
        "from tactbench.core.report.results import open_results\n"
        "draw_figures(open_results(Store(Path(sys.argv[1])), load_registry()), Path(sys.argv[2]))\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
        "assert 'sklearn' not in sys.modules, 'embeddings are stored'\n"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "7", "MATPLOTLIBRC": str(tmp_path / "matplotlibrc")}
    subprocess.run(
        [sys.executable, "-W", "error", "-c", script, str(finished), str(tmp_path / "again")],
        check=True, env=environment, timeout=120,
    )  # fmt: skip
    first = {path.name: path.read_bytes() for path in all_of_it[2].iterdir()}
    assert {path.name: path.read_bytes() for path in (tmp_path / "again").iterdir()} == first
    assert matplotlib.rcParams["font.size"] == matplotlib.rcParamsDefault["font.size"]


def test_a_failed_cell_is_named_and_the_others_are_drawn(one_failed, tmp_path):
    with unrendered():
        drawn, said = draw(one_failed, tmp_path / "figures")
    assert kinds(drawn) == PUBLISHED + FORCE
    assert all(len(one.keys) == 1 for one in drawn)
    (reason,) = (one for one in said if one.startswith("beta/force"))
    assert "is in no figure: failed: In recording 'flat-test', t0 has no sample at all." in reason


def test_a_figure_that_cannot_be_written_stops_no_other(one_failed, tmp_path, all_of_it):
    (name,) = (one.png.name for one in all_of_it[0] if one.name.startswith(FORCE[0]))
    blocked = tmp_path / "figures" / name
    blocked.mkdir(parents=True)
    with unrendered():
        drawn, said = draw(one_failed, tmp_path / "figures")
    assert kinds(drawn) == PUBLISHED + FORCE[1:]
    assert any(one.startswith("No prediction against time of force") for one in said)


def test_an_unreadable_cell_costs_its_own_panel_and_where_it_is_all_its_figures(folder, tmp_path):
    lost = [
        row for row in opened(folder).rows
        if row["estimator"] == "forest" or (row["sensor"] == "beta" and row["estimator"] == "lasso")
    ]  # fmt: skip
    for row, content in zip(lost, (b"", b"no HDF5", b"\x89HDF\r\n\x1a\n"), strict=True):
        (folder / "cells" / f"{row['key']}.h5").write_bytes(content)
    with unrendered():
        drawn, said = draw(folder, tmp_path / "figures")
    assert kinds(drawn) == PUBLISHED + FORCE
    assert [len(one.keys) for one in drawn[len(PUBLISHED) :]] == [1, 1, 1]
    for row in lost:
        assert any(f"{row['key']}.h5" in one for one in said)
    assert any("No figures of curvature" in one for one in said)


def test_one_sensor_fills_its_row_and_missing_recordings_cost_the_embedding_only(tmp_path):
    folder = results(tmp_path, sensors=("alpha",))
    (tmp_path / "recordings").rename(tmp_path / "elsewhere")
    with unrendered():
        drawn, said = draw(folder, tmp_path / "figures")
    assert kinds(drawn) == PUBLISHED + CURVATURE[:-1] + FORCE
    assert all(len(one.keys) == 1 for one in drawn)
    assert any(
        one.startswith("No embedding of alpha/curvature") and str(tmp_path / "recordings") in one for one in said
    )


def test_folds_have_figures_of_their_test_sets(tmp_path):
    folder = results(tmp_path, protocol="deployable", split="shuffled", simulated=False, sensors=("alpha",), kept=40)
    with unrendered():
        drawn, said = draw(folder, tmp_path / "figures")
    assert kinds(drawn) == ["confusion", "score-by-force", "residuals", "validation-curve"]
    assert all("SIM" not in one.caption and "‡: leaks" in one.caption for one in drawn)
    assert any("has a training set a fold" in one for one in said)
    assert any("a test set a fold" in one for one in said)


def test_an_empty_folder_has_no_figures_and_a_file_is_no_folder(finished, tmp_path):
    assert draw(tmp_path / "empty", tmp_path / "figures") == ([], [])
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot be made"):
        draw(finished, tmp_path / "file")
