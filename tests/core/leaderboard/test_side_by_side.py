"""The same question asked in several ways, side by side."""

import numpy as np

from tactbench.core.leaderboard.side_by_side import compare

from .rows import row


def test_protocols_stand_side_by_side_with_their_difference():
    rows = [row(protocol="karl2016", score=0.5), row("b", protocol="karl2016", score=0.7),
            row(protocol="deployable", score=0.625)]  # fmt: skip
    (table,) = compare(rows, "protocol")
    assert table.columns == ("sensor", "estimator", "karl2016", "deployable")
    assert table.lines == (
        ("a SIM", "lasso", "0.5000\n0.4000 … 0.6000", "0.6250 (+0.1250)\n0.5250 … 0.7250"),
        ("b SIM", "lasso", "0.7000\n0.6000 … 0.8000", "–"),
    )
    assert [record["difference"] for record in table.records] == [None, 0.125, None]


def test_the_difference_of_two_ways_has_an_interval_where_both_met_the_same_sessions():
    """Sessions differ by far more than protocols do: the scores' own intervals overlap, the difference is clear."""
    kept = {"unit": "session", "names": list("abcde"), "strata": None, "run": 1}
    rows = [
        row(protocol=protocol, score=float(np.sqrt(np.mean(np.square(errors)))),
            replicates=kept | {"sums": [[100 * error**2, 100] for error in errors]})
        for protocol, errors in (("karl2016", (1.0, 2.0, 3.0, 4.0, 5.0)), ("deployable", (1.1, 2.1, 3.1, 4.1, 5.1)))
    ]  # fmt: skip
    (table,) = compare(rows, "protocol")
    first, second = table.records
    assert (first["difference_low"], first["difference_high"]) == (None, None)
    assert 0.07 < second["difference_low"] < second["difference"] < second["difference_high"] < 0.13
    assert "\nΔ 0.0" in table.lines[0][3]


def test_what_must_not_be_mixed_never_shares_a_table():
    rows = [
        row(protocol=protocol, split=split, simulated=simulated, rig="twin" if simulated else "replay")
        for protocol in ("karl2016", "deployable")
        for split in ("roles", "session")
        for simulated in (True, False)
    ]
    assert len(compare(rows, "protocol")) == 4
    assert len(compare(rows, "split")) == 4
    assert compare(rows[:1], "protocol") == []


def test_a_skipped_cell_says_so_and_only_the_first_baseline_is_shown():
    rows = [
        row(split="roles"), row(split="unit", status="skipped", score=None),
        *(row(estimator=name, is_baseline=True, split=split) for name in ("mean", "time-index")
          for split in ("roles", "unit")),
    ]  # fmt: skip
    (table,) = compare(rows, "split")
    assert [line[1] for line in table.lines] == ["lasso", "mean"]
    assert table.lines[0][3] == "SKIPPED"


def test_folds_stand_in_order_of_their_numbers():
    scores = {"mae": 1.0, "fold radius 10.0, interpolated": 2.0, "fold radius 5.0, extrapolated": 3.0,
              "fold radius flat, extrapolated": 4.0}  # fmt: skip
    (table,) = compare([row(split="radius", scores=scores)], "fold")
    assert table.columns[2:] == ("5.0, extrapolated", "10.0, interpolated", "flat, extrapolated")
    assert [record["score"] for record in table.records] == [3.0, 2.0, 4.0]
    assert table.lines[0][2:] == ("3.0000", "2.0000", "4.0000")
