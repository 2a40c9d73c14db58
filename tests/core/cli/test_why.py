"""``tactbench why``: hit or miss, what changed, how a stopped cell ended, and the same once more, bit for bit."""

import json
import shutil

import pytest

from tests.conftest import Verbs
from tests.core.cli.terminals import computed
from tests.core.matrix.plugin_packages import write_acme

RUN = ("run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "acme", "--estimator",
       "acme-raises", "--effects", "-drift", "--seed", "3")  # fmt: skip
ACME, MEAN = (f"ideal/force/twin/karl2016/{name}/3" for name in ("acme", "mean"))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a plugin and the results of a run with it; one cell of it failed."""
    folder = tmp_path_factory.mktemp("why")
    write_acme(folder / "site")
    verbs = Verbs(folder, here=True)
    verbs(*RUN, "--out", "results", plugins=(str(folder / "site"),), code=1)
    return folder


@pytest.fixture
def here(made, tmp_path):
    """A copy to be changed, and the command line in it with the plugin on the path."""
    folder = tmp_path / "copy"
    shutil.copytree(made, folder)

    def call(*arguments, code=0):
        return Verbs(folder, here=True)(*arguments, "--out", "results", plugins=(str(folder / "site"),), code=code)

    call.folder = folder
    return call


def why(here, cell="acme/3", *options, **how):
    return json.loads(here("why", cell, *options, "--format", "json", **how).stdout)


def test_a_finished_cell_is_a_hit_and_says_where_it_lies(here):
    found = why(here)
    assert (found["cell"], found["answer"], found["reasons"], found["status"]) == (ACME, "hit", [], "done")
    assert (here.folder / found["file"]).is_file()
    assert all((here.folder / "results" / path).is_file() for path in found["recordings"])
    assert found["try"].split()[2:4] == [ACME, "--again"]
    for part in ("ideal/force", ACME.replace("karl", "carl")):  # a part of several names, a misspelt one
        assert ACME in here("why", part, code=2).stderr


def test_the_words_and_the_run_agree(here):
    filters = here.folder / "site" / "acme" / "filters.py"
    original = filters.read_text()
    assert computed(here(*RUN, code=1))[:2] == [3, 4]
    filters.write_text("LAW = 0.5\n")
    found = why(here)
    assert found["answer"] == "miss"
    (reason,) = found["reasons"]
    assert reason.startswith("source: acme ")
    again = why(here, ACME, "--again", code=1)
    assert any(difference.startswith("score ") for difference in again["differences"])
    assert again["circumstances"] == [reason]
    assert computed(here(*RUN, code=1))[:2] == [2, 4]
    assert why(here)["answer"] == "hit"
    filters.write_text(original)  # back as it was: the first result is still there
    assert why(here)["answer"] == "hit"


def test_a_recording_that_was_removed_or_replaced_is_named(here):
    (flat,) = (here.folder / "results" / "recordings" / "ideal").glob("flat-test-*.h5")
    (other,) = (here.folder / "results" / "recordings" / "ideal").glob("flat-train-*.h5")
    flat.unlink()
    (reason,) = why(here)["reasons"]
    assert flat.stem in reason
    shutil.copy(other, flat)
    (reason,) = why(here)["reasons"]
    assert reason.startswith(f"data: {flat.stem} ")
    assert why(here, MEAN, "--again")["answer"] == "identical", "it is made anew, as the cell had it"


def test_a_stopped_cell_shows_where_and_fails_again(here):
    found = why(here, "acme-raises")
    assert (found["answer"], found["status"]) == ("miss", "failed")
    assert "came off" in found["reason"]
    assert "raise RuntimeError" in here("why", "acme-raises").stdout
    again = why(here, "acme-raises", "--again", code=1)
    assert (again["status"], again["differences"]) == ("failed", [])
    assert "acme/answers.py" in again["traceback"]


def test_a_cell_comes_out_the_same_and_nothing_in_the_folder_changes(here):
    def every_file():  # but the index, which notes where recordings lie
        files = (here.folder / "results").rglob("*")
        return {path: path.read_bytes() for path in files if path.is_file() and path.suffix != ".sqlite"}

    before = every_file()
    found = why(here, ACME, "--again")
    assert (found["answer"], found["differences"], found["recordings_made"]) == ("identical", [], 3)
    assert every_file() == before
