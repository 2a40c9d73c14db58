"""What a simulated comparison rests on: scores with nuisances at the ends of their ranges, beside those as stated.

Each set of ends is a result folder of its own, ``assumptions/placement_scatter_mm=lower`` inside the other's.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

from tactbench.core.leaderboard.names import Row, answer_name, error_of, grouped, hardware_name, metric_name, sign_of
from tactbench.core.leaderboard.pairwise import folder_comparisons
from tactbench.core.leaderboard.sentences import ORDER_DEPENDS_ON
from tactbench.core.matrix.store import Store
from tactbench.core.spec.scene import RANGES
from tactbench.core.spec.sensor import PhysicalRange, SensorSpec
from tactbench.core.statistics.paired import difference
from tactbench.core.statistics.replicates import over_replicates
from tactbench.core.tables.numbers import ABSENT, score, signed
from tactbench.core.tables.text_table import TextTable, text_table

FOLDER = "assumptions"
TURNED = "turns round"
_NOTE = (
    "Each nuisance stands at one end of its range, all else as stated; the same seeds draw the same in all lines. A "
    "change is that of the mean over campaigns, with its 95 % interval over paired campaigns; a score is the median. A "
    "sensor without numbers has no such nuisance. ≈: not told apart."
)


def ranges_of(spec: SensorSpec) -> dict[str, PhysicalRange]:
    """Return between what ends a sensor's nuisances and those of its mount may lie, by name."""
    return {**RANGES, **spec.ranges}


def name_of(ends: Mapping[str, str]) -> str:
    """Return the name of a folder by the end of each nuisance: ``offset_scale=lower,placement_scatter_mm=lower``."""
    return ",".join(f"{name}={end}" for name, end in sorted(ends.items()))


def ends_of(name: str) -> dict[str, str]:
    """Return what the name of a folder says."""
    return {nuisance: end for nuisance, _, end in (part.partition("=") for part in name.split(","))}


def read_variants(folder: Path) -> dict[str, list[Row]]:
    """Return the rows of every set of ends that has been computed, by its name: one a cell and replicate."""
    return {path.parent.name: list(Store(path.parent).rows()) for path in sorted((folder / FOLDER).glob("*=*/cells"))}


class Sensitivity:
    """The scores of one question, as stated and with nuisances at the ends of their ranges.

    Parameters
    ----------
    rows
        As stated: one a cell and replicate.
    variants
        The same by the name of a set of ends; a sensor that has no such nuisance is not among them.
    """

    def __init__(self, rows: Sequence[Row], variants: Mapping[str, Sequence[Row]]) -> None:
        self.stated = {str(row["sensor"]): row for row in over_replicates(rows)}
        self.order = _order(self.stated)
        self.rows: dict[str, dict[str, Row]] = {}
        self.changes: dict[str, dict[str, Any]] = {}
        for name, own in variants.items():
            seeds = {(row["sensor"], row["seed"]) for row in own}
            same = over_replicates([row for row in rows if (row["sensor"], row["seed"]) in seeds])
            found = over_replicates(own)
            self.rows[name] = {str(row["sensor"]): row for row in found}
            self.changes[name] = {pair.row["sensor"]: pair for pair in folder_comparisons(found, same, name, "stated")}

    def change(self, name: str, sensor: str) -> float:
        """Return by how much a sensor's score differs from that as stated; 0 where it has no such nuisance."""
        pair = self.changes[name].get(sensor)
        return 0.0 if pair is None or pair.difference is None else float(pair.difference.value)

    def gain(self, name: str) -> float:
        """Return by how much better the sensors score than as stated, the mean over them."""
        sign = -sign_of(next(iter(self.stated.values())))
        return sum(sign * self.change(name, sensor) for sensor in self.stated) / len(self.stated)

    def there(self, name: str) -> dict[str, Row]:
        """Return a row for each sensor: that with a set of ends, or as stated where it has no such nuisance."""
        return {**self.stated, **self.rows[name]}

    def verdict(self, name: str) -> str:
        """Return what becomes of the order of the sensors."""
        order = _order(self.there(name))
        if any((worse, better) in order for better, worse in self.order):
            return TURNED
        if not order or self.order - order:
            return "not shown"
        return "stays" if order == self.order else "shown here only"

    def turned(self) -> list[str]:
        """Return the sets of ends with which the order turns round; of those that hold another, the smaller one."""
        found = [name for name in self.rows if self.verdict(name) == TURNED]
        within = {name: ends_of(name).items() for name in found}
        return [name for name in found if not any(within[one] < within[name] for one in found)]


def _order(rows: Mapping[str, Row]) -> set[tuple[str, str]]:
    """Return which sensor is shown to be better than which."""
    done = {sensor: row for sensor, row in rows.items() if row["status"] == "done"}
    found = set()
    for one, other in combinations(done, 2):
        verdict = difference(done[one], done[other]).verdict
        if verdict in ("better", "worse"):
            found.add((one, other) if verdict == "better" else (other, one))
    return found


def _order_text(rows: Mapping[str, Row]) -> str:
    done = {sensor: row for sensor, row in rows.items() if row["status"] == "done"}
    best_first = sorted(done, key=lambda sensor: error_of(done[sensor]))
    order = _order(done)
    signs = [" > " if pair in order else " ≈ " for pair in pairwise(best_first)]
    return "".join(f"{sensor}{sign}" for sensor, sign in zip(best_first, [*signs, ""], strict=True))


def sensitivities(rows: Iterable[Row], variants: Mapping[str, Sequence[Row]]) -> dict[tuple[str, ...], Sensitivity]:
    """Return what each answer's scores rest on, by task, protocol, split, rig and estimator.

    `rows` and `variants` hold one row a cell and replicate, those of trivial answers too, which are passed over.
    """

    def question(row: Row) -> tuple[str, ...]:
        split = "" if row["split"] is None else str(row["split"])
        return (row["task"], row["protocol"], split, hardware_name(row), answer_name(row))

    stated = grouped((row for row in rows if not row["is_baseline"]), question)
    found: dict[tuple[str, ...], dict[str, Sequence[Row]]] = {}
    for name, own in variants.items():
        for key, members in grouped((row for row in own if not row["is_baseline"]), question).items():
            found.setdefault(key, {})[name] = members
    return {key: Sensitivity(stated[key], some) for key, some in found.items() if key in stated}


def with_dependence(rows: Sequence[dict[str, Any]], store: Store) -> list[dict[str, Any]]:
    """Return rows with the nuisances on which the order of the sensors depends, where it has been computed.

    `rows` are those of `store`, one a cell.
    """
    variants = read_variants(store.folder)
    if not variants:
        return list(rows)
    named: dict[str, list[str]] = {}
    for found in sensitivities(store.rows(), variants).values():
        names = list(dict.fromkeys(nuisance for name in found.turned() for nuisance in ends_of(name)))
        named |= {row["cell"]: names for row in found.stated.values()}
    return [{**row, ORDER_DEPENDS_ON: named[row["cell"]]} if row["cell"] in named else row for row in rows]


def sensitivity_table(found: Sensitivity, specs: Mapping[str, SensorSpec]) -> TextTable:
    """Return the table of one question; `specs` by sensor have ranges and sources."""
    any_row = next(iter(found.stated.values()))
    sensors = list(found.stated)
    names = sorted(found.rows, key=lambda name: (len(ends_of(name)), -max(abs(found.change(name, s)) for s in sensors)))
    per_sensor = [column for sensor in sensors for column in (sensor, f"{sensor}: change")]
    columns = ("nuisance", "value", "range", "source", *per_sensor, *(("order", "it") if len(sensors) > 1 else ()))
    shipped = [score(found.stated[sensor]["score"], any_row["unit"]) for sensor in sensors]
    first = [text for one in shipped for text in (one, "")]
    lines = [["as stated", "", "", "", *first, _order_text(found.stated), ""][: len(columns)]]
    notes: dict[str, None] = {_NOTE: None}
    for name in names:
        ends, own = ends_of(name), found.rows[name]
        ranges = {one: {sensor: ranges_of(specs[sensor]).get(one) for sensor in own if sensor in specs} for one in ends}
        value = ", ".join(_alike({s: f"{row['simulation']['nuisances'][one]:g}" for s, row in own.items()})
                          for one in ends)  # fmt: skip
        stated = {one: {s: given for s, given in by.items() if given is not None} for one, by in ranges.items()}
        alone = next(iter(stated.values())) if len(ends) == 1 else {}
        texts = [_alike({s: f"{one.lower:g} … {one.upper:g}" for s, one in alone.items()}),
                 _alike({s: one.source.tag for s, one in alone.items()})]  # fmt: skip
        for sensor, one in alone.items():
            where = f", {sensor}" if next(iter(ends)) not in RANGES else ""
            notes[f"{next(iter(ends))}{where}: {one.source.reference} ({one.source.tag})."] = None
        lines.append([", ".join(ends), value, *texts, *(text for s in sensors for text in _scores(found, name, s)),
                      _order_text(found.there(name)), found.verdict(name)][: len(columns)])  # fmt: skip
    title = " · ".join([any_row["task"], metric_name(any_row), any_row["protocol"], answer_name(any_row),
                        hardware_name(any_row)])  # fmt: skip
    return text_table(title, columns, lines, numeric=per_sensor, notes=tuple(notes))


def _alike(texts: Mapping[str, str]) -> str:
    """Return the text of all sensors, each with its name where they differ."""
    if len(set(texts.values())) < 2:
        return next(iter(texts.values()), "")
    return ", ".join(f"{sensor} {text}" for sensor, text in texts.items())


def _scores(found: Sensitivity, name: str, sensor: str) -> tuple[str, str]:
    """Return a sensor's score with a set of ends, and how it differs from that as stated."""
    pair = found.changes[name].get(sensor)
    if pair is None or pair.first_row is None:
        return ABSENT, ABSENT
    if pair.difference is None:
        return ABSENT, pair.refused
    unit, apart = pair.row["unit"], pair.difference
    ends = " … ".join(signed(end, unit) for end in (apart.low, apart.high) if end is not None)
    return score(pair.first_row["score"], unit), signed(apart.value, unit) + (f" ({ends})" if ends else "")
