"""The whole screen, and the files that people read.

``python -m tests.core.leaderboard.test_screens`` writes them anew, to be looked at.
"""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tactbench.core.leaderboard.formats import rendered
from tactbench.core.leaderboard.names import DEFAULT
from tactbench.core.leaderboard.table import build_table
from tactbench.core.statistics.replicates import over_replicates

from .rows import row

HERE = Path(__file__).parent / "screens"
DOCUMENT = r"""\documentclass[twocolumn]{article}
\usepackage{booktabs,graphicx}
\begin{document}
%s
\end{document}
"""
QUESTIONS = {"curvature": "Which of five spherical caps touches the sensor?", "force": "How large is the normal force?"}


def table():
    """Return two questions asked of two sensors in eight campaigns, and a cell that failed."""
    rng = np.random.default_rng(5)
    rows = []
    for task, names, more in (
        ("curvature", {"forest": 0.6, "logistic": 0.35, "chance": 0.2}, {"metric": "macro_f1", "unit": "1"}),
        ("force", {"lasso": 0.7, "boosting": 0.72, "time-index": 0.7, "mean": 1.6}, {"reference_floor": 0.65}),
    ):
        for sensor, worse in (("biotac", 0.1), ("icub", 0.0)):
            for name, score in names.items():
                trivial = name in ("chance", "time-index", "mean")
                sign = -1 if task == "curvature" else 1
                delay = {} if trivial else {"answer_delay_ms": 73.4, "delay_parts_ms": {"link": 73.4}}
                each = score + (0 if trivial else sign * worse + 0.03 * rng.standard_normal(8))
                for seed, one in enumerate(np.broadcast_to(each, 8).tolist(), 1):
                    true = {"true_score": max(0.01, one**2 - 0.65**2) ** 0.5} if task == "force" else {}
                    rows.append(
                        row(sensor, name, one, seed=seed, task=task, is_baseline=trivial,
                            looks_at="time" if name == "time-index" else "features", protocol="karl2016", dagger=True,
                            cell=f"{sensor}/{task}/twin/karl2016/{name}/{seed}", **more, **true, **delay,
                            published={("icub", "forest"): 0.795, ("biotac", "forest"): 0.5}.get((sensor, name)))
                    )  # fmt: skip
    params = {"lambda_": 0.2}
    rows.append(
        row("icub", "lasso", None, status="failed", reason="The plug was pulled.", task="force", protocol="karl2016",
            split=None, params=params, cell="icub/force/twin/karl2016/lasso,lambda_=0.2/1")
    )  # fmt: skip
    return build_table(over_replicates(rows), questions=QUESTIONS)


FILES = {f"{width}.txt": ("table", width) for width in (80, 100, 140)} | {"table.md": ("md",), "table.tex": ("latex",)}


def shown(name):
    shape, *width = FILES[name]
    return rendered(table(), shape, DEFAULT, *width).decode()


@pytest.mark.parametrize("name", FILES)
def test_screens_and_files_are_as_they_were_looked_at(name):
    assert shown(name) == (HERE / name).read_text(encoding="utf-8")


def test_the_latex_compiles_and_no_box_is_overfull(tmp_path):
    if shutil.which("pdflatex") is None:
        pytest.skip("there is no pdflatex")
    (tmp_path / "paper.tex").write_text(DOCUMENT % shown("table.tex"), encoding="utf-8")
    done = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"],
        cwd=tmp_path, capture_output=True, text=True, errors="replace", timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Overfull" not in done.stdout


if __name__ == "__main__":
    for path in FILES:
        (HERE / path).write_text(shown(path), encoding="utf-8")
