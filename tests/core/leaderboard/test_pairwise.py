"""What may be compared, what is refused and why, and what is declared."""

import pytest

from tactbench.core.errors import UnknownNameError
from tactbench.core.leaderboard.pairwise import comparisons, folder_comparisons, record_of, tables_of

from .rows import row

SESSIONS = [f"s{place}" for place in range(6)]


def answered(sensor="a", means=(1.0, 1.1, 1.2, 1.3, 1.4, 1.5), estimator="lasso", **more):
    sums = [[100 * mean**2, 100] for mean in means]
    kept = {"unit": "session", "names": SESSIONS, "strata": None, "run": 1, "sums": sums}
    score = (sum(mean**2 for mean in means) / len(means)) ** 0.5
    made = row(sensor, estimator, score, replicates=kept, baseline=3.0)
    made |= more
    return made | {"cell": "/".join(str(made[k]) for k in ("sensor", "task", "rig", "protocol", "split", "estimator"))}


WORSE = (1.3, 1.4, 1.5, 1.65, 1.7, 1.8)


def test_two_sensors_are_compared_estimator_by_estimator():
    rows = [answered(), answered("b", WORSE), answered(estimator="ols"), answered("b", WORSE, "ols"),
            answered("a", estimator="mean", is_baseline=True), answered("c")]  # fmt: skip
    found = comparisons(rows, "a", "b")
    assert [(one.kind, one.of) for one in found] == [("sensors", "lasso"), ("sensors", "ols")]
    assert all(one.difference.verdict == "better" and one.difference.paired for one in found)
    (table,) = tables_of(found)
    assert table.title.split(" · ")[1:4] == ["question", "RMSE [N]", "deployable"]
    assert table.lines[0][-1] == "a better"
    (record, _) = map(record_of, found)
    assert record["difference"] == pytest.approx(record["score_a"] - record["score_b"])


def test_a_name_that_is_not_there_is_refused_with_those_of_its_kind():
    for names in (("a", "c"), ("c", "a")):
        with pytest.raises(UnknownNameError, match="'c'"):
            comparisons([answered(), answered("b")], *names)


@pytest.mark.parametrize(
    "more",
    [{"simulated": False, "rig": "replay"}, {"status": "failed", "reason": "x", "score": None}, {"metric": "mae"}],
)
def test_what_must_not_be_compared_is_refused_with_its_reason(more):
    found = comparisons([answered(), answered("b", **more)], "a", "b")
    assert found[0].refused
    assert all(record_of(one)["difference"] is None for one in found)


def test_p_values_are_corrected_for_all_pairs_compared_at_once():
    rows = [answered(), answered("b", WORSE), answered(estimator="ols"), answered("b", WORSE, "ols"),
            answered(estimator="ridge")]  # fmt: skip
    found = comparisons(rows, "b", "a")
    assert [one.difference and one.difference.p for one in found] == [2 / 64, 2 / 64, None]
    assert [record_of(one)["p_holm"] for one in found] == [2 * 2 / 64, 2 * 2 / 64, None]


def test_two_folders_are_compared_cell_by_cell():
    before, after = [answered(), answered("b")], [answered(means=WORSE), answered("c")]
    found = folder_comparisons(before, after, "old", "new")
    assert [(one.of, one.refused[:3]) for one in found] == [("a, lasso", ""), ("b, lasso", "new"), ("c, lasso", "old")]
    assert tables_of(found)[0].lines[0][-1] == "old better"


def test_protocols_and_splits_are_compared_answer_by_answer():
    rows = [answered(protocol=protocol, split=split, means=means)
            for protocol, means in (("karl2016", WORSE), ("deployable", (1.0, 1.1, 1.2, 1.3, 1.4, 1.5)))
            for split in ("session", "unit")]  # fmt: skip
    found = comparisons(rows, "karl2016", "deployable")
    assert [(one.kind, one.of, one.row["split"]) for one in found] == [
        ("protocols", "a, lasso", "session"), ("protocols", "a, lasso", "unit"),
    ]  # fmt: skip
    assert all(one.difference.verdict == "worse" for one in found)
