"""Whoever finds a leak, the leaderboard names it: in every format, through a run as a person does it."""

import json

import numpy as np
import pytest

import tactbench
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import installed
from tactbench.core.report.page import make_page
from tactbench.core.report.results import open_results
from tests.conftest import Verbs
from tests.core.evaluation.made import ramp, record
from tests.here import make_here


@pytest.fixture(autouse=True)
def here(monkeypatch, tmp_path):
    """Runs carry out cells in this process, in a folder of their own."""
    monkeypatch.chdir(tmp_path)
    make_here(monkeypatch)


def squared(X, force):
    X[:, 1] = force**2


def lagged(X, force):
    X[2:, 1] = force[:-2]


def repeated(X, force):
    X[::6], force[::6] = ramp(9, n=20)  # the same in every session


PLANTED = {squared: "t1 ", lagged: "t1 ", repeated: "17%"}
"""Beginning of the stamp of each leak."""


@pytest.mark.parametrize("plant", [None, *PLANTED])
def test_a_planted_leak_is_named_in_the_main_table(tmp_path, plant):
    for n in range(3):
        X, force = ramp(n, n=120, label_noise=0.1)
        if plant:
            plant(X, force)
        t_ns = None if plant is repeated else "regular"
        record(tmp_path / "in" / f"{n}.h5", X, force, t_ns=t_ns, session=str(n))
    found = tactbench.run(task="force", recordings=tmp_path / "in", estimator="ols", split="session")
    (line,) = [line for line in repr(found).splitlines() if " ols " in line and " made " in line]
    notes = [" ".join(note.split()) for note in repr(found).split("\n\n") if "‡  leaks" in note]
    assert ("‡" in line) == bool(notes) == (plant is not None)
    assert all(f"leaks: {PLANTED[plant]}" in note for note in notes)


def test_what_the_first_frame_gives_away_is_said_in_every_format(tmp_path):
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
