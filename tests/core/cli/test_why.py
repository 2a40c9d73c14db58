"""``tactbench why``: hit or miss, what changed in words, and how a stopped cell ended."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from tests.conftest import ROOT, Verbs
from tests.core.matrix.plugin_packages import write_acme

RUN = ("run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "acme", "--estimator",
       "acme-raises")  # fmt: skip
ACME = "ideal/force/twin/karl2016/acme/1"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a plugin and the results of a run with it; one cell of it failed."""
    folder = tmp_path_factory.mktemp("why")
    write_acme(folder / "site")
    Verbs(folder, here=True)(*RUN, "--out", "results", plugins=(str(folder / "site"),), code=1)
    return folder


@pytest.fixture
def here(made, tmp_path):
    """A copy to be changed, and the command line in it with the plugin on the path."""
    shutil.copytree(made, tmp_path / "copy")
    folder = tmp_path / "copy"

    def call(*arguments, code=0):
        ask = Verbs(folder, here=True)
        return ask(*arguments, "--out", "results", plugins=(str(folder / "site"),), code=code)

    call.folder = folder
    call.acme = folder / "site" / "acme"
    return call


def why(here, cell="acme/1", *options):
    return json.loads(here("why", cell, *options, "--format", "json").stdout)


def test_a_finished_cell_is_a_hit_and_says_where_it_lies(here):
    found = why(here)
    assert (found["cell"], found["answer"], found["reasons"], found["status"]) == (ACME, "hit", [], "done")
    assert (here.folder / found["file"]).is_file()
    assert all((here.folder / "results" / path).is_file() for path in found["recordings"])
    assert found["try"] == f"tactbench why {ACME} --again --out results"
    text = here("why", ACME).stdout
    assert text.startswith(f"{ACME}\nstatus ")
    assert "tactbench run             reuses it" in text
    assert found["file"] in text


def test_the_words_and_the_run_agree(here):
    filters = here.acme / "filters.py"
    original = filters.read_text()
    assert "3 of 4 answers were found finished" in here(*RUN, code=1).stderr
    filters.write_text("LAW = 0.5\n")
    found = why(here)
    assert found["answer"] == "miss"
    (reason,) = found["reasons"]
    assert reason.startswith("source: acme ")
    assert "2 of 4 answers were found finished" in here(*RUN, code=1).stderr
    assert why(here)["answer"] == "hit"
    filters.write_text(original + "# a comment\n")
    assert why(here)["answer"] == "miss", "every byte counts"
    # Back as it was: the first result is still there.
    filters.write_text(original)
    assert why(here)["answer"] == "hit"


def test_a_recording_that_was_removed_or_replaced_is_named(here):
    (flat,) = (here.folder / "results" / "recordings" / "ideal").glob("flat-test-*.h5")
    (other,) = (here.folder / "results" / "recordings" / "ideal").glob("flat-train-*.h5")
    flat.unlink()
    (reason,) = why(here)["reasons"]
    assert reason.startswith(f"1 of 3 recordings have to be made, {flat.stem} first")
    shutil.copy(other, flat)
    (reason,) = why(here)["reasons"]
    assert reason.startswith(f"data: {flat.stem} ")


def test_a_stopped_cell_shows_its_reason_its_traceback_and_what_to_try(here):
    found = why(here, "acme-raises")
    assert (found["answer"], found["status"]) == ("miss", "failed")
    assert "the pad came off" in found["reason"]
    assert "acme/answers.py" in found["traceback"]
    text = here("why", "acme-raises").stdout
    assert "failed: RuntimeError: the pad came off" in text
    assert "raise RuntimeError" in text
    assert "Try: tactbench why ideal/force/twin/karl2016/acme-raises/1 --again --out results" in text


def test_a_part_of_the_name_will_do_and_what_is_unclear_is_refused(here):
    several = here("why", "ideal/force", code=2).stderr
    assert "part of the names of 4 cells" in several
    assert ACME in several
    assert "Did you mean" in here("why", ACME.replace("karl", "carl"), code=2).stderr


def test_a_folder_that_is_not_there_is_refused(here):
    assert "There is no folder" in Verbs(here.folder)("why", "acme", "--out", "nowhere", code=2).stderr
    assert not (here.folder / "nowhere").exists()


def test_a_cached_run_loads_no_numerical_library(here):
    text = (
        "import sys\nfrom tactbench.core.cli import main\n"
        f"sys.argv = ['tactbench', *{RUN[:-2]!r}, '--out', 'results', '--format', 'csv']\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "print(sorted({'numpy', 'h5py', 'scipy', 'sklearn', 'matplotlib', 'pandas'} & set(sys.modules)))\n"
    )
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(here.folder / "site"), str(ROOT)])}
    # The copied recordings are read once: they are other files than those that the run remembered.
    here(*RUN[:-2], "--format", "csv")
    done = subprocess.run([sys.executable, "-c", text], cwd=here.folder, env=env, capture_output=True, text=True,
                          check=True)  # fmt: skip
    assert done.stdout.splitlines()[-1] == "[]"
