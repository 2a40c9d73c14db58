"""With which nuisances the order of sensors turns round, and what is said of it."""

import pytest

from tactbench.core.leaderboard.sensitivity import TURNED as TURNS
from tactbench.core.leaderboard.sensitivity import sensitivities, sensitivity_tables
from tactbench.core.leaderboard.table import build_table, over_all
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tests.core.matrix import made

COMMON = (0.0, 0.01, -0.02, 0.03, -0.01, 0.02)
"""What a seed does to all scores."""
STATED = {"biotac": 0.4, "icub": 0.5}
TURNED = {"biotac": 0.9, "icub": 0.6}
VARIANTS = {
    "offset_scale=lower": {"biotac": 0.45, "icub": 0.53},
    "placement_scatter_mm=lower": {"biotac": 0.5, "icub": 0.5},
    "since_power_on_s=lower": {"biotac": 0.3},
    "offset_scale=lower,placement_scatter_mm=lower": TURNED,
    "noise_scale=lower,offset_scale=lower,placement_scatter_mm=lower": TURNED,
}


def keep(folder, scores, nuisances=None, seeds=range(1, 7)):
    """Keep an answer of each sensor and seed; a second of noise is the sensor's own."""
    store = Store(folder)
    with store.hold():
        for sensor, score in scores.items():
            for seed in seeds:
                own = 0.004 * ((seed * len(sensor)) % 5)
                one = score + COMMON[seed - 1] + own
                cell = f"{sensor}/force/twin/karl2016/forest/{seed}"
                more = {"metric": "macro_f1", "unit": "1", "equivalence": None, "classes": [0, 1], "published": 0.9}
                made.kept(store, cell, score=one, sensor=sensor, estimator="forest", seed=seed, fit_s=1.0,
                          simulation={"nuisances": nuisances or {}}, **more)  # fmt: skip
    return store


@pytest.fixture
def store(tmp_path):
    for name, scores in VARIANTS.items():
        keep(tmp_path / "assumptions" / name, scores, {part.partition("=")[0]: 0.0 for part in name.split(",")})
    return keep(tmp_path, STATED)


def read(store):
    (found,) = sensitivities(store).values()
    return found


def test_the_order_turns_round_where_another_sensor_is_shown_to_be_better(store):
    found = read(store)
    assert [found.verdict(name) for name in VARIANTS] == ["stays", "not shown", "stays", "turns round", "turns round"]
    assert found.turned() == ["offset_scale=lower,placement_scatter_mm=lower"], "of nested sets the smallest"
    assert found.gain("offset_scale=lower") == pytest.approx(0.04)
    assert found.gain("since_power_on_s=lower") == pytest.approx(-0.05), "a sensor without it changes by nothing"


def test_changes_are_taken_over_the_seeds_that_both_have(store):
    keep(store.folder / "assumptions" / "fewer=lower", {"biotac": 0.45}, {"fewer": 0.0}, seeds=range(2, 7))
    change = read(store).changes["fewer=lower"]["biotac"]
    assert (change.paired, change.replicates, change.value) == (True, 5, pytest.approx(0.05))


def test_the_table_has_a_line_for_each_set_with_range_source_and_order(store):
    specs = {sensor.name: sensor.spec for sensor in load_registry().sensors}
    (table,) = sensitivity_tables(store, specs)
    lines = {(line[0], line[1]): dict(zip(table.columns, line, strict=True)) for line in table.lines}
    assert lines["as stated", ""]["order"].split(" > ") == ["icub", "biotac"]
    alone = lines["placement_scatter_mm", "0"]
    assert (alone["range"].split(" … "), alone["source"]) == (["0", "0.5"], "assumed")
    assert lines["offset_scale", "0"]["range"].startswith("biotac 0 "), "the sensors' ranges differ"
    assert alone["biotac: change"].startswith("+0.100 (+0.")
    both = lines["offset_scale, placement_scatter_mm", "0, 0"]
    assert both["order"].endswith(TURNS)
    assert lines["since_power_on_s", "0"]["icub"] == "–"
    assert any(note.startswith("offset_scale, icub: ") for note in table.notes)


def test_the_leaderboard_names_what_the_order_depends_on_only_where_it_was_computed(store, tmp_path):
    (block,) = build_table(over_all(store, store.rows())).blocks
    assert all(name in block.verdict[-1] for name in ("offset_scale", "placement_scatter_mm"))
    (block,) = build_table(over_all(Store(tmp_path / "new"), store.rows())).blocks
    assert "depends" not in block.verdict[-1]
