"""The study of what the simulated rig cannot know: one draw, its analysis, and the page that has its result."""

import sys

import pytest
import yaml

from tests.conftest import ROOT

sys.path.append(str(ROOT))  # behind everything installed

from studies.calibration.__main__ import DOCUMENT, HERE, RESULTS, calibrate, document
from studies.calibration.draws import parameters_of, read, write

PROCEDURE = yaml.safe_load("""
seed: 3
rig: twin
protocol: karl2016
nuisances:
  - {name: force_noise_n, prior: {kind: uniform, low: 0.2, high: 1.0}}
  - {name: noise, sets: noise_scale, sensors: [ideal], prior: {kind: log-uniform, low: 0.1, high: 10}}
outputs:
  - {name: ramp, sensor: ideal, task: force, estimator: {name: time-index}}
  - {name: ols, sensor: ideal, task: force, estimator: &ols {name: ols}, every: 2}
  - {name: band, sensor: ideal, task: force, estimator: *ols, every: 2, figure: {kind: band, low_n: 1, high_n: 2}}
  - {name: rough, sensor: ideal, task: force, estimator: *ols, every: 2, figure: {kind: roughness, lag: 20}}
  - {name: first, sensor: ideal, task: force, estimator: {name: mean}, only_first: 1}
variations:
  - name: quiet
    outputs: [ramp]
    seeds: 1
    settings: [{given: [{name: force_noise_n, value: 0.1}]}]
""")


def test_draws_and_settings_are_carried_out_written_and_read_back(tmp_path):
    result = calibrate(PROCEDURE, draws=2, jobs=2)
    write(result, tmp_path)
    assert read(tmp_path).draws == result.draws
    assert read(tmp_path).variations == result.variations
    first, second = result.draws
    assert set(first.outputs) - set(second.outputs) == {"first"}
    for draw in result.draws:
        # The error of the time index is the noise of the force sensor, and so is a fit's on a quiet sensor.
        assert draw.outputs["ramp"] == pytest.approx(draw.parameters["force_noise_n"], rel=0.1)
        assert draw.outputs["band"] != draw.outputs["ols"]
        assert 0 <= draw.outputs["rough"] < draw.outputs["ols"]
    (quiet,) = result.variations["quiet", 1]
    assert (quiet.seed, quiet.outputs["ramp"]) == (first.seed, pytest.approx(0.1, rel=0.1))


def test_stored_draws_are_those_of_the_stored_procedure():
    procedure, result = yaml.safe_load((HERE / "calibration.yaml").read_text(encoding="utf-8")), read(RESULTS)
    for draw in result.draws[:20]:
        assert parameters_of(procedure, draw.number) == (draw.seed, draw.parameters)
    assert [one["name"] for one in procedure["outputs"]] == [one["name"] for one in result.procedure["outputs"]]
    assert procedure["nuisances"][0]["reason"] == result.procedure["nuisances"][0]["reason"]


def test_the_page_has_the_tables_of_the_stored_results_and_every_prior():
    assert document() == DOCUMENT.read_text(encoding="utf-8")
    text = (HERE / "README.md").read_text(encoding="utf-8")
    priors = [one["prior"] for one in read(RESULTS).procedure["nuisances"]]
    assert [one for one in priors if f"{one['low']:g} to {one['high']:g}" not in text] == []
