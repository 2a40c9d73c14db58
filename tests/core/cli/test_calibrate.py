"""``tactbench calibrate`` as a person meets it."""

import json
import os
import signal
import subprocess
import sys

import pytest

from tests.conftest import Verbs
from tests.core.cli.test_screens import assert_one_clear_screen
from tests.core.pool.patience import ending
from tests.core.report.unrendered import unrendered

PROCEDURE = """
title: Small
seed: 3
draws: 11
rig: twin
protocol: karl2016
nuisances:
  - {name: force_noise_n, reason: r, source: assumed,
     prior: {kind: uniform, low: 0.2, high: 1.0}}
  - {name: noise, sets: noise_scale, sensors: [ideal], reason: r, source: assumed,
     prior: {kind: log-uniform, low: 0.1, high: 10}}
outputs:
  - {name: ramp, title: Time index, sensor: ideal, task: force, unit: N, estimator: {name: time-index}}
  - {name: ols, title: OLS, sensor: ideal, task: force, unit: N, estimator: {name: ols}}
published:
  - {output: ramp, value: 0.6, scale: 0.15, scale_reason: s, use: fitted, source: {tag: assumed, reference: x}}
  - {output: ols, value: 0.6, scale: 0.15, scale_reason: s, use: held out, source: {tag: assumed, reference: x}}
tolerance: 2
findings:
  - {name: bound, statement: Time is the bound, reason: r, source: {tag: assumed, reference: x},
     all_of: [{above: ols, below: ramp, margin: -0.01}]}
"""
CALIBRATE = ("calibrate", "--config", "small.yaml", "--format", "json")


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    verbs = Verbs(tmp_path_factory.mktemp("calibrate"), here=True)
    (verbs.folder / "small.yaml").write_text(PROCEDURE)
    with unrendered():
        return verbs, verbs(*CALIBRATE, "--out", "whole")


def test_tables_on_stdout_progress_on_stderr(calibrated):
    _, done = calibrated
    lines = json.loads(done.stdout)
    assert {line["table"] for line in lines} == {"parameters", "published", "findings", "sensitivity"}
    ramp = next(line for line in lines if line.get("output") == "ramp" and line["table"] == "published")
    # Accepted means within two scales of the published .6: what is fitted lies there, and the noise drawn is the RMSE.
    assert 0.3 <= ramp["accepted_low"] <= ramp["accepted_high"] <= 0.9
    noise = next(line for line in lines if line["name"] == "force_noise_n")
    assert noise["accepted_median"] == pytest.approx(ramp["accepted_median"], rel=0.05)
    assert "drawing" in done.stderr


def test_the_files_of_a_calibration(calibrated):
    verbs, _ = calibrated
    folder = verbs.folder / "whole" / "calibration"
    assert {path.name for path in folder.iterdir()} == {
        *("draws.jsonl", "draws.csv", "run.json", "ranges.json", "findings.json", "sensitivity.json"),
        *("draws.png", "draws.pdf", "sensitivity.png", "sensitivity.pdf"),
    }
    assert json.loads((folder / "ranges.json").read_text())["draws"] == 11
    assert len((folder / "draws.csv").read_text().splitlines()) == 12
    assert json.loads((folder / "run.json").read_text())["made_by"]["numpy"]


def test_it_goes_on_after_an_interruption_to_the_same_draws(calibrated):
    verbs, _ = calibrated
    env = {**os.environ, "PYTHONWARNINGS": "error", "OMP_NUM_THREADS": "1"}
    journal = verbs.folder / "cut" / "calibration" / "draws.jsonl"
    with ending(
        [sys.executable, "-m", "tactbench", *CALIBRATE, "--out", "cut", "--jobs", "2"],
        cwd=verbs.folder, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as running:  # fmt: skip
        # Its progress tells when the first draws are down: no clock and no busy waiting.
        first = next(line for line in running.stderr if "/11" in line)
        assert "done" in first
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=60)
    assert running.returncode == 130, said
    assert "goes on from there" in said
    kept = journal.read_text().count("\n") - 1
    assert 1 <= kept < 11
    with unrendered():
        rest = verbs(*CALIBRATE, "--out", "cut")
    assert f"{kept} of 11 draws were found finished" in rest.stderr
    whole = verbs.folder / "whole" / "calibration"
    for name in ("draws.csv", "ranges.json", "findings.json", "sensitivity.json"):
        assert (journal.parent / name).read_bytes() == (whole / name).read_bytes()


def test_what_is_there_is_shown_again_as_a_table(calibrated):
    verbs, _ = calibrated
    shown = verbs("calibrate", "--show", "--out", "whole")
    assert "the calibration in whole/calibration" in shown.stderr
    for text in ("Small (SIM)", "held out", "Time is the bound", "Partial rank correlations", "11 draws"):
        assert text in shown.stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--show", "--draws", "3"), "--show draws nothing"),
        (("--config", "missing.yaml"), "cannot be read"),
        (("--config", "small.yaml", "--out", "whole", "--seed", "4"), "another procedure or seed"),
    ],
)
def test_wrong_words_are_answered_with_the_next_step(calibrated, arguments, says):
    verbs, _ = calibrated
    assert_one_clear_screen(verbs("calibrate", *arguments, code=2), says)


def test_a_misspelt_procedure_is_answered_with_its_line(calibrated):
    verbs, _ = calibrated
    (verbs.folder / "wrong.yaml").write_text(PROCEDURE.replace("below: ramp", "below: rampe"))
    assert_one_clear_screen(verbs("calibrate", "--config", "wrong.yaml", code=2), "did you mean 'ramp'")
