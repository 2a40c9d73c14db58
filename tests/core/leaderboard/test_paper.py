"""The LaTeX of a table in a two-column paper: it compiles, and nothing is wider than a column."""

import re
import shutil
import subprocess

import pytest

from tactbench.core.leaderboard.formats import COLUMN_PT, latex
from tactbench.core.leaderboard.table import build_table
from tactbench.core.leaderboard.view import WHOLE
from tactbench.core.tables.latex import points

from .rows import row
from .test_force import KNOWN
from .tex import untex

DOCUMENT = r"""\documentclass[twocolumn]{article}
\usepackage{booktabs,graphicx}
\begin{document}
\typeout{COLUMN \the\columnwidth}
%s
\end{document}
"""
PLACES = {"lasso": 0.6, "ols": 0.63, "boosting": 0.7, "time-index": 1.1}


def table():
    """Force and curvature by both sensors, names and marks of usual length."""
    rows = [
        row(sensor, name, score=score, is_baseline=name == "time-index", published=0.7307, dagger=True,
            protocol="karl2016", ci_method="block bootstrap in time within 1 recording (blocks of 17 rows)", **more,
            params={"lambda_": 0.2} if name == "lasso" else {})
        for sensor in ("biotac", "icub") for name, score in PLACES.items()
        for more in ({**KNOWN, "task": "force"}, {"task": "curvature", "metric": "macro_f1", "unit": "1"})
    ]  # fmt: skip
    for number, one in enumerate(rows):
        one["cell"] = str(number)
    return build_table(rows, [{"host": "h", "cpu": "c", "cores": 2}])


def test_a_table_of_one_column_is_labelled_captioned_and_holds_what_a_paper_prints():
    text = latex(table())
    assert text.count("\\begin{table}[t]\n\\centering\n") == 2
    assert re.findall(r"\\label\{(.*)\}", text) == ["tab:tactbench-curvature-1", "tab:tactbench-force-2"]
    first, second = (untex(said) for said in re.findall(r"\\caption\{(.*)\}$", text, re.MULTILINE))
    for said in ("macro F1, higher is better", "n = 4\u202f400 test samples", "95 % interval by block bootstrap"):
        assert said in first
    assert "RMSE [N]" in second
    head = text.split(r"\toprule")[1].splitlines()[1]
    assert head.split(" & ")[:3] == ["sensor", "estimator", "macro"]  # F1 stands in the next line
    assert "published" in head
    assert r"Below the rule: trivial answers" in first


def test_its_lines_are_no_wider_than_a_column_by_the_widths_of_the_letters():
    for body in re.findall(r"\\toprule\n(.*?)\\bottomrule", latex(table()), re.DOTALL):
        lines = [line.removesuffix(r" \\").split(" & ") for line in body.splitlines() if line != r"\midrule"]
        widths = [max(points(untex(cell)) for cell in column) for column in zip(*lines, strict=True)]
        assert sum(widths) + 5 * len(widths) <= COLUMN_PT


@pytest.mark.parametrize("view", [None, WHOLE])
def test_it_compiles_and_no_box_is_overfull(tmp_path, view):
    if shutil.which("pdflatex") is None:
        pytest.skip("there is no pdflatex; the widths of the letters are checked above")
    text = latex(table(), view) if view else latex(table())
    (tmp_path / "paper.tex").write_text(DOCUMENT % text)
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"],
        cwd=tmp_path, capture_output=True, text=True, errors="replace", timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Overfull" not in done.stdout
    assert float(re.search(r"COLUMN ([0-9.]+)pt", done.stdout)[1]) == pytest.approx(COLUMN_PT, abs=1.0)


@pytest.mark.parametrize(
    "text", ["0.6928 †", "0.0000 … 0.2208", "lasso (lambda_=0.2)", "biotac SIM", "RMSE [N]", "WMmw", "Ünïcode µ 中"]
)
def test_widths_are_those_that_latex_sets(tmp_path, text):
    from tactbench.core.tables.latex import tex

    if shutil.which("pdflatex") is None:
        pytest.skip("there is no pdflatex")
    box = r"\documentclass{article}\begin{document}\footnotesize\setbox0\hbox{%s}\typeout{WIDE \the\wd0}\end{document}"
    (tmp_path / "box.tex").write_text(box % tex(text))
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "box.tex"], cwd=tmp_path, capture_output=True, text=True,
        errors="replace", timeout=60, check=False,
    )  # fmt: skip
    found = float(re.search(r"WIDE ([0-9.]+)pt", done.stdout)[1])
    # Letters are set closer in pairs than alone, by less than half a point each; never wider apart.
    assert found <= points(text) + 0.05
    assert points(text) <= found + 0.5 * len(text)


def test_a_letter_that_is_set_by_its_number_is_as_wide_as_that():
    assert points("Å") == points("U+00C5")
