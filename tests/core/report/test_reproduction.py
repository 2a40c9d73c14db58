import pytest

from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.published import reproduce, verdict
from tests.core.leaderboard.rows import row

METHOD = "block bootstrap in time within 1 recording (blocks of 17 rows): spread between sessions is not in it"


def force_row(sensor="icub", estimator="lasso", score=0.68, **more):
    """A row of the force task as the paper asks it; the interval is the score ± 0.1."""
    named = f"{sensor}/force/{estimator}/{more.get('repeat', 1)}"
    return (
        row(sensor, estimator, score)
        | {"task": "force", "protocol": "karl2016", "split": "roles", "cell": named}
        | more
    )


@pytest.mark.parametrize(
    ("published", "word", "says"),
    [
        (0.58, "inside", "inside: the published lies in our 95 % interval over 8 replicates"),
        (0.78, "inside", "inside: the published lies in our 95 % interval over 8 replicates"),
        (0.9, "outside", "the published lies above our 95 % interval over 8 replicates"),
        (0.5, "outside", "the published lies below our 95 % interval over 8 replicates"),
    ],
)
def test_the_published_lies_inside_bounds_included_or_on_one_side(published, word, says):
    eight = force_row(ci_low=0.58, ci_high=0.78, n_replicates=8, replicate_unit="replicate")
    found, sentence = verdict(eight, published)
    assert found == word
    assert sentence.endswith(says)


def test_too_few_replicates_for_an_interval_are_said_in_its_place():
    few = force_row(ci_low=None, ci_high=None, n_replicates=3, replicate_unit="session")
    word, sentence = verdict(few, 0.88)
    assert word == "no interval"
    assert (
        sentence
        == "3 sessions: too few for an interval; ours is 0.2000 N (22.7 %) below the published, which is better"
    )


@pytest.mark.parametrize(
    ("metric", "unit", "published", "says"),
    [
        ("rmse", "N", 0.88, "ours is 0.2000 N (22.7 %) below the published, which is better"),
        ("rmse", "N", 0.5, "ours is 0.1800 N (36.0 %) above the published, which is worse"),
        ("macro_f1", "1", 0.88, "ours is 0.200 (22.7 %) below the published, which is worse"),
        ("macro_f1", "1", 0.5, "ours is 0.180 (36.0 %) above the published, which is better"),
        ("macro_f1", "1", 0.0, "ours is 0.680 above the published, which is better"),
    ],
)
def test_a_miss_says_by_how_much_and_which_way_is_better(metric, unit, published, says):
    word, sentence = verdict(force_row(metric=metric, unit=unit), published)
    assert word == "outside"
    assert sentence.startswith(f"outside: {says}, and the published lies")


def test_an_interval_not_over_replicates_is_named_with_its_method():
    assert verdict(force_row(ci_method=METHOD), 0.9)[1].endswith(f"by {METHOD}")


def test_a_cell_without_an_answer_gives_its_reason():
    assert verdict(force_row(status="failed", reason="the plug was pulled"), 0.7) == (
        "no answer",
        "failed: the plug was pulled",
    )


def test_the_five_numbers_of_the_paper_have_a_line_each_even_without_results():
    lines = [line for line in reproduce(load_registry(), []) if line.published.reference.startswith("Karl et al. 2016")]
    assert sorted(line.published.score for line in lines) == [0.60488, 0.6875, 0.7307, 0.7659, 0.79512]
    for line in lines:
        assert line.sentence.startswith("not run: `tactbench run ")
    (time_index,) = [line for line in lines if line.published.estimator == "time-index"]
    assert "--estimator" not in time_index.sentence  # a baseline is run with any answer


def test_rows_stand_beside_the_numbers_they_are_comparable_with_and_no_others():
    beside = force_row()
    others = [
        force_row(cell="a", protocol="deployable"),
        force_row(cell="b", estimator="ridge"),
        force_row(cell="c", params={"lambda_": 0.3}),
        force_row(cell="d", task="curvature"),
    ]
    lines = [line for line in reproduce(load_registry(), [beside, *others]) if line.row]
    assert [(line.published.score, line.row["cell"]) for line in lines] == [(0.7659, beside["cell"])]


def test_a_number_of_no_certain_sensor_has_a_line_for_each_sensor_s_recordings():
    rows = [force_row(sensor, "time-index", is_baseline=True) for sensor in ("biotac", "icub")]
    lines = [line for line in reproduce(load_registry(), rows) if line.row]
    assert [(line.published.score, line.title) for line in lines] == [
        (0.6875, "force, RMSE of the time index (biotac)"),
        (0.6875, "force, RMSE of the time index (icub)"),
    ]
