"""Keys: everything that may change a number changes them, and nothing else does."""

import subprocess
import sys
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import Cell
from tactbench.core.plugins.registry import installed, load_registry
from tactbench.core.provenance.source import versions
from tactbench.core.spec.scene import Indenter, Scene, Simulation

CELL = Cell("ideal", "force", "twin", "deployable", "session", "lasso", (("lambda_", 0.2),), False, 1, 3, 5)
DATA = ("d1", "d2")


@pytest.fixture(scope="module")
def keys():
    return Keys(installed())


def key(keys, cell=CELL, data=DATA):
    return keys.of_cell(cell, data)


@pytest.mark.parametrize(
    "change",
    [
        {"sensor": "icub"}, {"task": "shear-force"}, {"protocol": "karl2016"}, {"split": None}, {"estimator": "ridge"},
        {"params": ()}, {"params": (("lambda_", 0.3),)}, {"params": (("lambda_", 1),)}, {"seed": 6},
    ],
    ids=str,
)  # fmt: skip
def test_every_part_of_the_configuration_counts(keys, change):
    assert key(keys, replace(CELL, **change)) != key(keys)


@pytest.mark.parametrize(
    "change", [{"repeat": 2}, {"repeats": 9}, {"rig": "replay"}, {"simulation": Simulation(rung="fine")}]
)
def test_what_the_recordings_say_themselves_does_not_count(keys, change):
    assert key(keys, replace(CELL, **change)) == key(keys)


def test_what_an_estimator_does_before_it_is_timed_does_not_count(keys):
    ridge = keys.shared_by_cells(replace(CELL, estimator="ridge")).sections["estimator"]
    assert "grid" in ridge
    assert "rehearsal" not in ridge


@given(st.lists(st.sampled_from([0, 1, 0.0, 1.0, -0.0, True, False, None, "1", "", 1e-300, float("inf")]), min_size=2,
                max_size=2))  # fmt: skip
def test_parameters_that_are_written_differently_have_different_keys(keys, pair):
    one, other = (key(keys, replace(CELL, params=(("lambda_", value),))) for value in pair)
    assert (one == other) == (repr(pair[0]) == repr(pair[1]))


@given(
    st.lists(st.text("ab\n", min_size=1, max_size=3), max_size=4),
    st.lists(st.text("ab", min_size=1, max_size=3), max_size=4),
)
def test_other_data_or_another_order_have_another_key(keys, one, other):
    digests = [text.encode().hex() for text in one], [text.encode().hex() for text in other]
    assert (key(keys, data=digests[0]) == key(keys, data=digests[1])) == (digests[0] == digests[1])


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


def test_keys_are_the_same_in_another_process(keys):
    text = """
from tactbench.core.matrix.keys import Keys
from tactbench.core.matrix.plan import Cell
from tactbench.core.plugins.registry import installed, load_registry
cell = Cell("ideal", "force", "twin", "deployable", "session", "lasso", (("lambda_", 0.2),), False, 1, 3, 5)
print(Keys(installed()).of_cell(cell, ("d1", "d2")))
"""
    found = {
        subprocess.run([sys.executable, "-c", text], env={"PYTHONHASHSEED": seed}, capture_output=True, text=True,
                       check=True).stdout.strip()
        for seed in ("1", "2")
    }  # fmt: skip
    assert found == {key(keys)}


def test_versions_of_what_computes_are_there_and_missing_ones_say_so():
    found = versions(("no-such-distribution",))
    assert set(found) == {"python", "numpy", "scipy", "scikit-learn", "no-such-distribution"}
    assert found["no-such-distribution"] == "missing"
    import numpy

    assert found["numpy"] == numpy.__version__


def test_the_code_of_a_tasks_own_features_is_in_the_key(tmp_path, monkeypatch):
    """In a package of its own: a changed feature is computed again."""
    monkeypatch.syspath_prepend(tmp_path)
    code = tmp_path / "features_of_a_stranger.py"
    registry = load_registry()
    owned = registry.tasks.owned(CELL.task)
    spec = owned.descriptor.spec.model_copy(update={"features_by": "features_of_a_stranger:crest"})
    named = replace(owned, descriptor=owned.descriptor.model_copy(update={"spec": spec}))
    monkeypatch.setattr(registry.tasks, "owned", lambda _: named)
    keys = []
    for body in ("1.0", "2.0"):
        code.write_text(f"def crest(streams):\n    return {{'crest': {body}}}\n")
        keys.append(key(Keys(registry)))
    assert keys[0] != keys[1] == key(Keys(registry))


def test_who_brings_the_indenter_counts_where_a_scene_names_it(keys):
    def maker(shape=None):
        return keys.maker("ideal", "twin", "", Scene(name="s", indenter=Indenter(shape=shape)))

    plain, line = maker(), maker("cylinder")
    assert "indenter" not in plain.sections
    assert line.sections["indenter"]["where"] == "tactbench.rigs.twin.shapes:cylinder"
    assert maker("nobody-has-it").digest == plain.digest
