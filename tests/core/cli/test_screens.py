"""What a person sees: screens as kept in screens/, and wrong words answered in one clear screen, exit code 2."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCREENS = Path(__file__).parent / "screens"
SHOWN = {
    "show": ("show", "force", "lasso", "edge"),
    "show-sensors": ("show", "biotac", "icub"),
    "list-devices": ("list", "devices"),
    "explain": ("twin", "explain", "--sensor", "icub", "--task", "force", "--rounds", "0"),
}


@pytest.mark.parametrize("name", SHOWN)
def test_a_screen_is_as_it_is_kept(verbs, name):
    """Where a screen is meant to differ, look at what the verb prints and put that into the file."""
    shown = verbs(*SHOWN[name]).stdout
    assert [line.rstrip() for line in shown.splitlines()] == (SCREENS / f"{name}.txt").read_text().splitlines()


def assert_one_clear_screen(done, says=""):
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ") or "Usage:" in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.splitlines()) <= 6
    assert says in done.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("runn",), "'run'"),
        (("run", "--sensor", "biotak", "--task", "force"), "'biotac'"),
        (("run", "--config", "beyong"), "beyond"),
        (("run", "--effects", "drift"), "+drift"),
        (("run", "--set", "rung=defaut"), "'default'"),
        (("run", "--set", "placement_scater_mm=0.3"), "'placement_scatter_mm'"),
        (("run", "--set", "placement_scatter_mm=0.3mm"), "'placement_scatter_mm=0.3mm'"),
        (("run", "--set", "noise_scale=-1"), "noise_scale"),
        (("run", "--rig", "replay", "--recordings", ".", "--set", "noise_scale=2"), "simulated rig"),
        (("leaderboard", os.devnull), os.devnull),
        (("record", "--sensor", "icub", "--rig", "replay", "--out", "press.h5"), "replay"),
        (("record", "--sensor", "ideal", "--indenter", "knob", "--out", "no.h5"), "cylinder"),
        (("choose", "--task", "shear-force"), "shear-force"),
        (("cost",), "--twin"),
        (("twin", "explain", "--sensor", "icub", "--task", "grasp-stability"), "scenes"),
        (("new", "sensor", "My Pad"), "'My Pad'"),
    ],
)  # fmt: skip
def test_wrong_words_are_answered_with_the_next_step(verbs, arguments, says):
    assert_one_clear_screen(verbs(*arguments, code=2), says)
    assert [path for path in verbs.folder.rglob("*") if path.is_file() and path.name != ".lock"] == []


@pytest.mark.parametrize("words", ["list", "datasets", "show force biotac", "choose --task force"])
def test_a_list_for_programs_is_one_json_document(verbs, words):
    found = json.loads(verbs(*words.split(), "--format", "json").stdout)
    assert found
    if words == "list":
        assert found["sensors"]["icub"] == "iCub fingertip"
    if words == "datasets":
        assert {one["name"]: one["MB"] for one in found}["biotac-slide"] == 115.3
    if words.startswith("show"):
        assert [one["spec"]["name"] for one in found] == ["force", "biotac"]


def test_help_imports_no_verb_and_listing_loads_no_numerics():
    heavy = {"h5py", "sklearn", "scipy", "matplotlib", "serial", "can", "rich"}
    script = (
        "import sys, tactbench\n"
        "from tactbench.core.cli import cli\n"
        "try: cli.main(['--help'], prog_name='tactbench')\n"
        "except SystemExit: pass\n"
        f"print('HELP', sorted(({heavy!r} | {{'numpy', 'pydantic', 'pluggy'}}) & set(sys.modules)))\n"
        "from tactbench.core.plugins.registry import load_registry\n"
        "assert not load_registry().failures, load_registry().failures\n"
        f"print('LIST', sorted({heavy!r} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60,
                          env={**os.environ, "PYTHONWARNINGS": "error"})  # fmt: skip
    assert "  emulate " in done.stdout  # by its entry point
    assert "HELP []" in done.stdout
    assert "LIST []" in done.stdout
