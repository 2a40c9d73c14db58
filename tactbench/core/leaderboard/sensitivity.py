"""Sensitivity of a simulated comparison: changes of scores with nuisances at the ends of their ranges.

Each set of ends has its own result folder, such as ``OUT/assumptions/placement_scatter_mm=lower``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, permutations, product
from typing import Any

from tactbench.core.leaderboard.names import Row, answer_name, error_of, grouped, hardware_name, metric_name, sign_of
from tactbench.core.leaderboard.sentences import ORDER_DEPENDS_ON
from tactbench.core.matrix.store import Store
from tactbench.core.spec.scene import RANGES
from tactbench.core.spec.sensor import PhysicalRange, SensorSpec
from tactbench.core.statistics.paired import Difference, difference
from tactbench.core.statistics.replicates import counted, over_replicates
from tactbench.core.tables.text import ABSENT, TextTable, score, signed, text_table

FOLDER = "assumptions"
TURNED = "turns round"
_NOTE = (
    "Each nuisance stands at one end of its range, all else as stated; the same seeds draw the same in all lines. A "
    "change is that of the mean over campaigns, with its 95 % interval over paired campaigns; a score is the median. A "
    "sensor without numbers has no such nuisance. ≈: not shown to differ."
)


def ranges_of(spec: SensorSpec) -> dict[str, PhysicalRange]:
    """Return the ranges of the nuisances of a sensor and its mount, by name of the nuisance."""
    return {**RANGES, **spec.ranges}


def name_of(ends: Mapping[str, str]) -> str:
    """Return the folder name of a set of ends, such as ``offset_scale=lower,placement_scatter_mm=lower``."""
    return ",".join(f"{name}={end}" for name, end in sorted(ends.items()))


def ends_of(name: str) -> dict[str, str]:
    """Return the end, ``lower`` or ``upper``, by nuisance from the folder name of a set of ends."""
    return {nuisance: end for nuisance, _, end in (part.partition("=") for part in name.split(","))}


class Sensitivity:
    """Scores of all sensors in one task, as stated and with nuisances at the ends of their ranges.

    Parameters
    ----------
    rows
        Rows with all nuisances as stated, one for each cell and replicate.
    variants
        Rows by name of a set of ends, without sensors that lack the nuisance.
    """

    def __init__(self, rows: Sequence[Row], variants: Mapping[str, Sequence[Row]]) -> None:
        self.stated = _by_sensor(rows)
        self.task = str(rows[0]["task"])
        self.order = _order(self.stated)
        self.rows: dict[str, dict[str, Row]] = {}
        self.changes: dict[str, dict[str, Difference]] = {}
        """Changes of scores from those with stated nuisances, by set of ends and sensor, over common seeds."""
        for name, own in variants.items():
            seeds = {(row["sensor"], row["seed"]) for row in own}
            same = _by_sensor([row for row in rows if (row["sensor"], row["seed"]) in seeds])
            self.rows[name] = _by_sensor(own)
            pairs = {sensor: (row, same[sensor]) for sensor, row in self.rows[name].items() if sensor in same}
            self.changes[name] = {
                sensor: difference(*pair)
                for sensor, pair in pairs.items()
                if all(one["status"] == "done" for one in pair)
            }

    def change(self, name: str, sensor: str) -> float:
        """Return a sensor's change of score from that with stated nuisances; 0 if the sensor lacks the nuisance."""
        found = self.changes[name].get(sensor)
        return 0.0 if found is None else found.value

    def gain(self, name: str) -> float:
        """Return the improvement of the score over that with stated nuisances, as the mean over the sensors."""
        sign = -sign_of(next(iter(self.stated.values())))
        return sum(sign * self.change(name, sensor) for sensor in self.stated) / len(self.stated)

    def verdict(self, name: str) -> str:
        """Return a text: the order of the sensors stays or turns round at a set of ends, or is not shown."""
        order = _order({**self.stated, **self.rows[name]})
        if any((worse, better) in order for better, worse in self.order):
            return TURNED
        return "stays" if order == self.order else "not shown"

    def turned(self) -> list[str]:
        """Return the smallest sets of ends with which the order of the sensors turns round, without their supersets."""
        found = [name for name in self.rows if self.verdict(name) == TURNED]
        within = {name: ends_of(name).items() for name in found}
        return [name for name in found if not any(within[one] < within[name] for one in found)]


def _by_sensor(rows: Sequence[Row]) -> dict[str, Row]:
    return {str(row["sensor"]): row for row in over_replicates(rows)}


def _order(rows: Mapping[str, Row]) -> set[tuple[str, str]]:
    """Return the (better, worse) pairs of sensors of which the first is shown to be better."""
    done = {sensor: row for sensor, row in rows.items() if row["status"] == "done"}
    pairs = permutations(done, 2)
    return {(one, other) for one, other in pairs if difference(done[one], done[other]).verdict == "better"}


def _order_text(rows: Mapping[str, Row]) -> str:
    done = [sensor for sensor, row in rows.items() if row["status"] == "done"]
    done.sort(key=lambda one: error_of(rows[one]))
    order = _order(rows)
    return "".join(f"{' > ' if pair in order else ' ≈ '}{pair[1]}" for pair in pairwise(["", *done]))[3:]


def sensitivities(store: Store) -> dict[tuple[str, ...], Sensitivity]:
    """Return the sensitivities computed in a folder, by (task, protocol, split, rig, estimator)."""
    folders = [path.parent for path in sorted((store.folder / FOLDER).glob("*=*/cells"))]
    variants = {folder.name: _questions(Store(folder)) for folder in folders}
    stated = _questions(store) if folders else {}
    own = {key: {name: rows[key] for name, rows in variants.items() if key in rows} for key in stated}
    return {key: Sensitivity(stated[key], found) for key, found in own.items() if found}


def _questions(store: Store) -> dict[tuple[str, ...], list[Row]]:
    def question(row: Row) -> tuple[str, ...]:
        return row["task"], row["protocol"], row["split"] or "", hardware_name(row), answer_name(row)

    return grouped((row for row in store.rows() if not row["is_baseline"]), question)


def with_dependence(rows: Sequence[dict[str, Any]], store: Store) -> list[dict[str, Any]]:
    """Return rows, one for each cell, with the nuisances that the order of the sensors depends on, if computed."""
    named: dict[str, list[str]] = {}
    for found in sensitivities(store).values():
        names = list(dict.fromkeys(nuisance for name in found.turned() for nuisance in ends_of(name)))
        named |= {row["cell"]: names for row in found.stated.values()}
    return [{**row, ORDER_DEPENDS_ON: named[row["cell"]]} if row["cell"] in named else row for row in rows]


def sensitivity_tables(store: Store, specs: Mapping[str, SensorSpec]) -> list[TextTable]:
    """Return one table for each sensitivity; `specs` by sensor supply ranges and their sources."""
    return [_table(found, specs) for found in sensitivities(store).values()]


def _table(found: Sensitivity, specs: Mapping[str, SensorSpec]) -> TextTable:
    sensors, row = list(found.stated), next(iter(found.stated.values()))
    scores = [score(one["score"], one["unit"]) for one in found.stated.values()]
    lines = [["as stated", "", "", "", *(text for one in scores for text in (one, "")), _order_text(found.stated)]]
    notes = dict.fromkeys([_NOTE])
    for name in sorted(
        found.rows, key=lambda one: (len(ends_of(one)), -max(abs(found.change(one, s)) for s in sensors))
    ):
        own, ends = found.rows[name], ends_of(name)
        values = (_alike({s: f"{one['simulation']['nuisances'][end]:g}" for s, one in own.items()}) for end in ends)
        texts = (text for sensor in sensors for text in _change(own.get(sensor), found.changes[name].get(sensor)))
        order = f"{_order_text({**found.stated, **own})}: {found.verdict(name)}"
        ranges: dict[str, PhysicalRange] = {}
        for sensor, nuisance in product(own, ends if len(ends) == 1 else ()):
            if sensor in specs and (one := ranges_of(specs[sensor]).get(nuisance)):
                ranges[sensor] = one
                of = f", {sensor}" if nuisance not in RANGES else ""
                notes[f"{nuisance}{of}: {one.source.reference} ({one.source.tag})."] = None
        within = _alike({sensor: f"{one.lower:g} … {one.upper:g}" for sensor, one in ranges.items()})
        source = _alike({sensor: one.source.tag for sensor, one in ranges.items()})
        lines.append([", ".join(ends), ", ".join(values), within, source, *texts, order])
    campaigns = counted(row["n_replicates"] or 0, "campaign")
    about = [row["task"], metric_name(row), row["protocol"], answer_name(row), campaigns, hardware_name(row)]
    numeric = [column for sensor in sensors for column in (sensor, f"{sensor}: change")]
    columns = ("nuisance", "value", "range", "source", *numeric, *["order"] * (len(sensors) > 1))
    lines = [line[: len(columns)] for line in lines]
    table = text_table(" · ".join(about), columns, lines, numeric=numeric, notes=tuple(notes))
    return replace(table, first_to_go=("source", "range"))


def _alike(texts: Mapping[str, str]) -> str:
    """Return the text that all sensors share, or the texts with the sensors' names if they differ."""
    if len(set(texts.values())) < 2:
        return next(iter(texts.values()), "")
    return ", ".join(f"{sensor} {text}" for sensor, text in texts.items())


def _change(row: Row | None, change: Difference | None) -> tuple[str, str]:
    """Return as text a sensor's score with nuisances at ends of their ranges, and the change of the score."""
    if row is None or change is None:
        return ABSENT, ABSENT if row is None else row["status"]
    unit = row["unit"]
    ends = " … ".join(signed(end, unit) for end in (change.low, change.high) if end is not None)
    return score(row["score"], unit), signed(change.value, unit) + (f" ({ends})" if ends else "")
