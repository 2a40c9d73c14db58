"""``--set``: a nuisance under one name, from the option or the matrix file to the recording, the row and the tables."""

import json

import pytest

from tests.conftest import Verbs
from tests.core.cli.test_screens import assert_one_clear_screen

RUN = ("run", "--sensor", "icub", "--task", "force", "--estimator", "ols", "--repeats", "1")
SET = ("--set", "placement_scatter_mm=0.3", "--set", "taxel_white_count=2")
CELL = "icub/force/twin/karl2016/ols/1"


def rows_of(done):
    return {row["estimator"]: row for row in json.loads(done.stdout)}


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """A folder with the same cells as they are, and with two nuisances set."""
    verbs = Verbs(tmp_path_factory.mktemp("set"), here=True)
    verbs.usual = rows_of(verbs(*RUN, "--format", "json"))
    verbs.set = rows_of(verbs(*RUN, *SET, "--format", "json"))
    return verbs


def test_what_was_set_is_in_row_recording_score_and_why_and_is_found_again(here):
    usual, row = here.usual["ols"], here.set["ols"]
    assert usual["assumptions"]["placement_scatter_mm"] == 0.1
    assert row["assumptions"] == {**usual["assumptions"], "placement_scatter_mm": 0.3, "taxel_white_count": 2.0}
    assert usual["recordings"] != row["recordings"]
    assert usual["score"] != row["score"]
    for more in ((), SET):
        assert "0 computed now; 0 recordings made now" in here(*RUN, *more).stderr
    facts = json.loads(here("why", CELL, "--format", "json").stdout)
    assert facts["simulation"] == {"nuisances": {"placement_scatter_mm": 0.3, "taxel_white_count": 2.0}}
    assert "bit for bit" in here("why", CELL, "--again").stdout


def test_a_matrix_file_says_the_same(here):
    matrix = {
        "sensors": ["icub"], "tasks": [{"name": "force", "estimators": ["ols"]}], "latency": False, "repeats": 1,
        "simulation": {"nuisances": {"placement_scatter_mm": 0.2, "taxel_white_count": 2}},
    }  # fmt: skip
    (here.folder / "set.yaml").write_text(json.dumps(matrix))
    done = here("run", "--config", "set.yaml", *SET[:2], "--format", "json")
    assert "0 recordings made now" in done.stderr  # the option goes over the file, whose other values stay
    assert rows_of(done)["ols"]["score"] == here.set["ols"]["score"]


def test_a_recording_says_it(here):
    here("record", "--sensor", "icub", "--out", "a.h5", "--profile", "ramp:duration=1", *SET)
    assert "placement_scatter_mm = 0.3" in here("inspect", "a.h5").stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--set", "placement_scater_mm=0.3"), "Did you mean 'placement_scatter_mm'"),
        (("--set", "placement_scatter_mm=0.3mm"), "'placement_scatter_mm=0.3mm' is not a name and a number"),
        (("--set", "placement_scatter_mm"), "is not a name and a number"),
        (("--set", "noise_scale=inf"), "is not a name and a number"),
        (("--set", "noise_scale=1", "--set", "noise_scale=2"), "gives noise_scale twice"),
        (("--set", "noise_scale=-1"), "noise_scale = -1 is below 0"),
        (("--set", "taxel_white_count=-1"), "taxel_white_count = -1 is below 0"),
        (("--set", "drive_delay_ms=1"), "drive_delay_ms: the scene has no drive"),
        (("--sensor", "icub", "--set", "dc_pressure_white_count=1"), "no nuisance called 'dc_pressure_white_count'"),
        (("--rig", "replay", "--recordings", ".", "--set", "noise_scale=2"), "for simulated rigs"),
    ],
)
def test_what_cannot_be_set_is_answered_with_the_next_step(verbs, arguments, says):
    assert_one_clear_screen(verbs("run", *arguments, code=2), says)


def test_a_matrix_file_is_held_to_the_same_names(verbs):
    matrix = "tasks: [force]\nsensors: [icub]\nsimulation:\n  nuisances: {placement_scater_mm: 0.3}\n"
    (verbs.folder / "wrong.yaml").write_text(matrix)
    assert_one_clear_screen(verbs("run", "--config", "wrong.yaml", code=2), "Did you mean 'placement_scatter_mm'")
