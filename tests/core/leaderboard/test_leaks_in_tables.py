"""A leak is named in every format, through a run as a person does it."""

import json

import numpy as np

import tactbench
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import installed
from tactbench.core.report.page import make_page
from tactbench.core.report.results import open_results
from tests.conftest import Verbs
from tests.core.evaluation.made import record
from tests.here import make_here


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
