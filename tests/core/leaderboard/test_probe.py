"""The leakage probe, each of its conditions seen to go both ways; a leak is named in every format."""

import json

import numpy as np
import pytest

import tactbench
from tactbench.core.leaderboard.table import with_leaks
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import installed
from tactbench.core.report.page import make_page
from tactbench.core.report.results import open_results
from tests.conftest import Verbs
from tests.core.evaluation.made import record
from tests.core.leaderboard.rows import row
from tests.here import make_here


def classed(score, protocol="deployable", split="recording", **more):
    """A row of a task with four classes, by accuracy; the trivial answer has 0.25."""
    n, right = 40, round(40 * score)
    confusion = np.zeros((4, 4), dtype=int)
    for place in range(n):
        confusion[place % 4, place % 4 if place < right else (place + 1) % 4] += 1
    return row(
        score=score, metric="accuracy", unit="1", protocol=protocol, split=split, n_test=n,
        **({"baseline": 0.25, "confusion": confusion.tolist()} | more),
    )  # fmt: skip


def erring(score, protocol="deployable", split="session", **more):
    """A row of a regression in newtons; the trivial answer errs by 10 N."""
    more = {"ci_low": score - 0.2, "ci_high": score + 0.2, "n_test": 20, "baseline": 10.0} | more
    return row(score=score, metric="rmse", unit="N", protocol=protocol, split=split, **more)


@pytest.mark.parametrize(
    ("rows", "leaks"),
    [
        # Half of the skill of 0.7 over the trivial 0.25, on either side.
        ([classed(0.95), classed(0.60, "first-frame")], True),
        ([classed(0.95), classed(0.575, "first-frame")], False),
        # Of 40 guesses of four, 16 or more are right in 2.6 % of the cases, 17 or more in 1.2 %: the line is 2.5 %.
        ([classed(0.50), classed(0.425, "first-frame")], True),
        ([classed(0.50), classed(0.40, "first-frame")], False),
        ([erring(1.0), erring(5.5, "first-frame", n_test=5)], True),
        ([erring(1.0), erring(5.5, "first-frame", n_test=4)], False),
        ([erring(1.0), erring(5.5, "first-frame", ci_high=10.0)], False),
        ([erring(1.0), erring(5.5, "first-frame", ci_high=None)], False),
        ([erring(1.0), erring(5.6, "first-frame")], False),
        ([erring(9.9, baseline=None), erring(1.0, "first-frame")], False),
        ([classed(0.95), classed(0.90, "first-frame", sensor="b")], False),
        ([classed(0.95), classed(0.90, "first-frame", split="session")], False),
        ([classed(0.95, split="shuffled"), classed(0.90, "first-frame", split="shuffled")], False),
        ([classed(0.95, is_baseline=True), classed(0.90, "first-frame")], False),
        ([classed(0.95, status="failed"), classed(0.90, "first-frame")], False),
        ([classed(0.95, "karl2016"), classed(0.90, "first-frame")], False),
        ([classed(0.95), classed(0.90, "first-frame", status="skipped")], False),
        ([classed(1.0, baseline=0.9), classed(1.0, "first-frame", confusion=[[40]])], False),
        ([classed(0.1), classed(0.0, "first-frame")], False),
    ],
)
def test_a_score_that_the_first_frame_explains_is_stamped(rows, leaks):
    rows[0]["stamps"] = ["1 of 5 recordings left out"]
    found, first = with_leaks(rows)
    assert first == rows[1]
    assert found["stamps"][:1] == rows[0]["stamps"]
    assert [text.startswith("leaks: first frame alone") for text in found["stamps"][1:]] == [True] * leaks


def test_what_the_first_frame_gives_away_is_said_in_every_format(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_here(monkeypatch)
    rng = np.random.default_rng(1)
    for n in range(24):
        X = n % 4 + 0.1 * rng.standard_normal((12, 3))
        record(tmp_path / "in" / f"{n}.h5", X, session="s", trial=str(n // 4), labels={"object": f"thing {n % 4}"})
    tactbench.run(task="object-identity", recordings=tmp_path / "in", estimator="logistic", split="trial", probe=True)
    says = "logistic: leaks: first frame alone 1.000 of 1.000"
    printed = {shape: Verbs(tmp_path, here=True)("leaderboard", "--protocol", "deployable", "--format", shape).stdout
               for shape in ("table", "md", "latex", "json")}  # fmt: skip
    for shape, mark in (("table", "‡"), ("md", "‡"), ("latex", r"$\ddagger$")):
        marked = [line.split(mark)[0] for line in printed[shape].splitlines() if mark in line]
        assert any("logistic" in before for before in marked), shape
        assert says in printed[shape], shape
    marks = {(row["estimator"], row["split"]): row["shown"]["marks"] for row in json.loads(printed["json"])}
    assert [marks[name, "trial"] for name in ("logistic", "majority", "chance")] == ["‡", "", ""]
    page = make_page(open_results(Store(tmp_path / "tactbench-results"), installed())).html
    assert says in page
