"""The verb ``choose``."""

import json

from tactbench.core.cli.config import shipped_results
from tactbench.core.matrix.store import Store
from tests.core.matrix import made

WISH = ("--task", "force", "--max-delay-ms", "2", "--range-n", "5", "--rate-hz", "10")


def test_results_of_ones_own_come_before_those_that_came_along(verbs):
    shipped = verbs("choose", *WISH)
    assert "results that came with tactbench" in shipped.stdout
    assert "the force range of icub: not stated" in shipped.stdout
    assert shipped.stderr == ""
    with Store(verbs.folder / "tactbench-results").hold() as store:
        made.kept(store, "icub/force/twin/karl2016/ols/1", estimator="ols", dagger=True)
    shown = verbs("choose", *WISH).stdout
    assert "protocol karl2016 †" in shown
    assert "the results in tactbench-results" in shown
    assert "tactbench run --sensor biotac --task force" in shown, "what is not known, and what to do"
    assert verbs("choose", "tactbench-results", *WISH).stdout == shown
    # A task of which the folder has nothing is answered from what came along, unless the folder was asked for.
    assert "came with tactbench" in verbs("choose", "--task", "curvature").stdout
    assert "curvature" in verbs("choose", "tactbench-results", "--task", "curvature", code=2).stderr


def test_json_has_the_wish_the_criteria_and_what_is_unknown(verbs):
    told = json.loads(verbs("choose", *WISH, "--score", "0.2", "--format", "json").stdout)
    assert told["wish"] == {"max_delay_ms": 2, "range_n": 5, "rate_hz": 10, "score": 0.2}
    assert (told["protocol"], told["split"]) == ("deployable", "roles")
    (choice,) = told["choices"]
    assert {one["sensor"] for one in choice["candidates"]} == {"biotac", "icub"}
    for one in choice["candidates"]:
        assert [criterion["wish"] for criterion in one["criteria"]] == ["answer delay", "force range", "rate", "score"]
    assert choice["unknown"]


def test_the_shipped_results_are_of_both_sensors_simulated():
    rows = json.loads(shipped_results().read_text(encoding="utf-8"))["rows"]
    asked = {(row["sensor"], row["task"], row["protocol"]) for row in rows if row["status"] == "done"}
    assert asked == {(sensor, task, protocol) for sensor in ("biotac", "icub") for task in ("force", "curvature")
                     for protocol in ("deployable", "karl2016")}  # fmt: skip
    assert all(row["simulated"] for row in rows)
