"""``--probe`` adds cells; what was asked for stays as it was."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.matrix.plan import plan_cells
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.matrix import MatrixSpec


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
    assert len({cell.name for cell in probed}) == len(probed)


@pytest.mark.parametrize(
    ("asked", "probes"),
    [
        (("deployable", "session"), [("first-frame", "session"), ("deployable", "shuffled")]),
        (("deployable", "shuffled"), [("deployable", None), ("first-frame", None)]),
        ((["deployable"], ["in-session", "shuffled"]), [("deployable", None), ("first-frame", None)]),
        ((["karl2016", "deployable"], None), [("first-frame", None), ("deployable", "shuffled")]),
    ],
)
def test_probes_keep_apart_what_the_cell_keeps_apart(registry, asked, probes):
    protocol, split = asked
    choice = {"protocol": protocol, "split": split}
    assert ways(plan(registry, **choice)) == [*ways(plan(registry, probe=False, **choice)), *probes]


def test_a_split_in_time_alone_cannot_be_probed(registry):
    with pytest.raises(UsageError, match="probe"):
        plan(registry, protocol="deployable", split="in-session")
