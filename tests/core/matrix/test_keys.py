"""Keys: everything that may change a number changes them, and nothing else does."""

from dataclasses import replace
from pathlib import Path

import pytest

from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import Cell
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.scene import Simulation

CELL = Cell("ideal", "force", "twin", "deployable", "session", "lasso", (("lambda_", 0.2),), False, 5)
DATA = {Path("flat.h5"): "d1", Path("round.h5"): "d2"}


@pytest.fixture(scope="module")
def keys():
    return Keys(installed())


def key(keys, cell=CELL, data=DATA):
    return keys.of_cell(cell, data)[0]


@pytest.mark.parametrize(
    "change",
    [
        {"sensor": "icub"}, {"task": "shear-force"}, {"protocol": "karl2016"}, {"split": None}, {"estimator": "ridge"},
        {"params": ()}, {"seed": 6}, {"timed": False},
    ],
    ids=str,
)  # fmt: skip
def test_every_part_of_the_configuration_counts(keys, change):
    assert key(keys, replace(CELL, **change)) != key(keys)


@pytest.mark.parametrize("change", [{"rig": "replay"}, {"simulation": Simulation(rung="fine")}], ids=str)
def test_what_the_recordings_say_themselves_does_not_count(keys, change):
    assert key(keys, replace(CELL, **change)) == key(keys)


def test_parameters_that_are_written_differently_have_different_keys(keys):
    values = [0, 1, 0.0, 1.0, -0.0, True, False, None, "1", "", 1e-300, float("inf")]
    assert len({key(keys, replace(CELL, params=(("lambda_", value),))) for value in values}) == len(values)


def test_other_data_or_another_order_have_another_key_and_their_names_do_not_count(keys):
    every = [(), ("a",), ("b",), ("a", "b"), ("b", "a"), ("ab",), ("a", "a", "b")]
    found = [[key(keys, data={Path(f"{name}{n}"): text for n, text in enumerate(one)}) for one in every]
             for name in "xy"]  # fmt: skip
    assert found[0] == found[1]
    assert len(set(found[0])) == len(every)


def test_a_recording_counts_who_makes_it_of_what_in_which_role(keys):
    scene = installed().tasks["force"].spec.scenes[0].scene
    found = {
        keys.of_recording(sensor, "twin", one, role, seed)
        for sensor in ("ideal", "icub")
        for one in (scene, scene.model_copy(update={"simulation": Simulation(effects=("-drift",))}))
        for role in ("train", "test")
        for seed in (1, 2)
    }
    assert len(found) == 16


def test_a_recording_of_real_devices_counts_its_rig_file_and_no_code(keys, monkeypatch):
    monkeypatch.setattr("tactbench.core.matrix.keys.sources_of", None)
    scene = installed().tasks["force"].spec.scenes[0].scene
    files = [RigFile.model_validate({"version": 1, "rig": "bench", "sensors": {"icub": {"link": link}}})
             for link in ("/dev/ttyUSB0", "/dev/ttyUSB1")]  # fmt: skip
    assert len({keys.of_recording("icub", "bench", scene, "train", 1, file) for file in files}) == 2
