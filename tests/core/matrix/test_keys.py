"""Keys: everything that may change a number changes them, and nothing else does."""

import subprocess
import sys
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.matrix.keys import cell_key, keys_of, recording_key, versions
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.source import SourceDigests
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.scene import Simulation

CELL = Cell("ideal", "force", "twin", "deployable", "session", "lasso", (("lambda_", 0.2),), False, 1, 3, 5)
DATA = ("d1", "d2")


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    return SourceDigests(tmp_path_factory.mktemp("keys") / "memory.json")


def key(sources, cell=CELL, data=DATA):
    return cell_key(cell, data, installed(), sources)


@pytest.mark.parametrize(
    "change",
    [
        {"sensor": "icub"}, {"task": "shear-force"}, {"protocol": "karl2016"}, {"split": None}, {"estimator": "ridge"},
        {"params": ()}, {"params": (("lambda_", 0.3),)}, {"params": (("lambda_", 1),)}, {"seed": 6},
    ],
    ids=str,
)  # fmt: skip
def test_every_part_of_the_configuration_counts(sources, change):
    assert key(sources, replace(CELL, **change)) != key(sources)


@pytest.mark.parametrize(
    "change", [{"repeat": 2}, {"repeats": 9}, {"rig": "replay"}, {"simulation": Simulation(rung="fine")}]
)
def test_what_the_recordings_say_themselves_does_not_count(sources, change):
    assert key(sources, replace(CELL, **change)) == key(sources)


def test_what_an_estimator_does_before_it_is_timed_does_not_count(sources):
    ridge = keys_of(installed(), sources).answer(replace(CELL, estimator="ridge")).sections["estimator"]
    assert "grid" in ridge
    assert "rehearsal" not in ridge


@given(st.lists(st.sampled_from([0, 1, 0.0, 1.0, -0.0, True, False, None, "1", "", 1e-300, float("inf")]), min_size=2,
                max_size=2))  # fmt: skip
def test_parameters_that_are_written_differently_have_different_keys(sources, pair):
    one, other = (key(sources, replace(CELL, params=(("lambda_", value),))) for value in pair)
    assert (one == other) == (repr(pair[0]) == repr(pair[1]))


@given(
    st.lists(st.text("ab\n", min_size=1, max_size=3), max_size=4),
    st.lists(st.text("ab", min_size=1, max_size=3), max_size=4),
)
def test_other_data_or_another_order_have_another_key(sources, one, other):
    digests = [text.encode().hex() for text in one], [text.encode().hex() for text in other]
    assert (key(sources, data=digests[0]) == key(sources, data=digests[1])) == (digests[0] == digests[1])


def test_a_recording_counts_who_makes_it_of_what_in_which_role(sources):
    scene = installed().tasks["force"].spec.scenes[0].scene
    found = {
        recording_key(sensor, "twin", one, role, seed, installed(), sources)
        for sensor in ("ideal", "icub")
        for one in (scene, scene.model_copy(update={"simulation": Simulation(effects=("-drift",))}))
        for role in ("train", "test")
        for seed in (1, 2)
    }
    assert len(found) == 16


def test_keys_are_the_same_in_another_process(sources, tmp_path):
    text = f"""
from pathlib import Path
from tactbench.core.matrix.keys import cell_key
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.source import SourceDigests
from tactbench.core.plugins.registry import installed
cell = Cell("ideal", "force", "twin", "deployable", "session", "lasso", (("lambda_", 0.2),), False, 1, 3, 5)
print(cell_key(cell, ("d1", "d2"), installed(), SourceDigests(Path({str(tmp_path / "other.json")!r}))))
"""
    found = {
        subprocess.run([sys.executable, "-c", text], env={"PYTHONHASHSEED": seed}, capture_output=True, text=True,
                       check=True).stdout.strip()
        for seed in ("1", "2")
    }  # fmt: skip
    assert found == {key(sources)}


def test_versions_of_what_computes_are_there_and_missing_ones_say_so():
    found = versions(("no-such-distribution",))
    assert set(found) == {"python", "numpy", "scipy", "scikit-learn", "no-such-distribution"}
    assert found["no-such-distribution"] == "missing"
    import numpy

    assert found["numpy"] == numpy.__version__


def test_one_registry_and_one_set_of_sources_have_one_set_of_keys(sources, tmp_path):
    assert keys_of(installed(), sources) is keys_of(installed(), sources)
    assert keys_of(installed(), SourceDigests(tmp_path / "other")) is not keys_of(installed(), sources)
