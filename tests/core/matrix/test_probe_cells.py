"""``--probe`` adds cells; what was asked for stays as it was."""

from pathlib import Path

import pytest

from tactbench.core.matrix.plan import plan_cells
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.matrix import MatrixSpec
from tactbench.core.spec.yaml_file import load_yaml

MATRICES = sorted((Path(__file__).parents[3] / "examples" / "matrices").glob("real-*.yaml"))


@pytest.fixture(scope="module")
def registry():
    return load_registry()


def plan(registry, probe=True, **choice):
    matrix = MatrixSpec.model_validate({"tasks": [{"name": "curvature", **choice}], "probe": probe, "repeats": 1})
    return plan_cells(matrix, ["icub"], registry)


def ways(cells, estimator="forest"):
    return [(cell.protocol, cell.split) for cell in cells if cell.estimator == estimator]


def test_three_more_ways_after_those_asked_for(registry):
    asked, probed = plan(registry, probe=False), plan(registry)
    assert probed[: len(asked)] == asked
    assert ways(probed) == [
        ("karl2016", None), ("deployable", "roles"), ("first-frame", "roles"), ("deployable", "shuffled"),
    ]  # fmt: skip
    assert ways(probed, "chance") == ways(probed), "the trivial answers stand beside each"
    assert ways(probed, "majority") == ways(probed)
    assert len({cell.name for cell in probed}) == len(probed)


def test_what_is_asked_under_both_protocols_is_probed_once(registry):
    assert ways(plan(registry, protocol=["karl2016", "deployable"])) == [
        ("karl2016", None), ("deployable", None), ("first-frame", None), ("deployable", "shuffled"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("split", "expected"),
    [
        ("session", [("deployable", "session"), ("first-frame", "session"), ("deployable", "shuffled")]),
        ("shuffled", [("deployable", "shuffled"), ("deployable", None), ("first-frame", None)]),
    ],
)
def test_probes_keep_apart_what_the_cell_keeps_apart(registry, split, expected):
    assert ways(plan(registry, protocol="deployable", split=split)) == expected


def test_a_split_in_time_keeps_nothing_apart_and_is_not_probed(registry):
    assert ways(plan(registry, protocol="deployable", split="in-session")) == [("deployable", "in-session")]


def test_a_probe_may_be_asked_of_any_task_by_name(registry):
    assert "first-frame" not in registry.tasks["curvature"].spec.protocols
    assert ways(plan(registry, probe=False, protocol="first-frame")) == [("first-frame", None)]
    assert ways(plan(registry, protocol="first-frame")) == [("first-frame", None)], "a probe is not probed"


@pytest.mark.parametrize("path", MATRICES, ids=lambda path: path.stem)
def test_a_ready_matrix_of_real_recordings(registry, path):
    matrix = load_yaml(path, MatrixSpec)
    cells = plan_cells(matrix, matrix.sensors, registry)
    assert {cell.rig for cell in cells} == {"replay"}
    assert len({cell.split for cell in cells}) >= 2
    # How to get the recordings, and how to run it, stand in the file itself.
    text = path.read_text()
    assert f"tactbench run --config examples/matrices/{path.name} --probe" in text
    assert "tactbench import examples/mappings/" in text


def test_there_is_one_for_each_data_set():
    assert {path.stem for path in MATRICES} == {
        "real-biotacsp",
        "real-eflesh",
        "real-eflesh-shear",
        "real-eflesh-slip",
        "real-icub",
    }
