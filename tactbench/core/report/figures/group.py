"""Which cells stand in one figure: those that differ in nothing but the sensor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from tactbench.core.errors import TactbenchError
from tactbench.core.leaderboard.names import answer_name
from tactbench.core.matrix.store import Row
from tactbench.core.report.figures.style import sensor_colours
from tactbench.core.report.results import Results
from tactbench.core.samples import Answers
from tactbench.core.spec.task import TaskSpec

Remark = Callable[[str], None]


@dataclass(frozen=True)
class Panel:
    """One sensor's cell, with what it answered."""

    row: Row
    """of the replicate that is shown"""
    answers: Mapping[str, Answers]
    """by role"""

    @property
    def sensor(self) -> str:
        """Its name."""
        return str(self.row["sensor"])


@dataclass(frozen=True)
class Group:
    """The cells of one figure, in the order of the rows."""

    results: Results
    task: TaskSpec
    panels: tuple[Panel, ...]
    baselines: Mapping[str, Panel]
    """The trivial answer of the table's column, by sensor."""

    @property
    def row(self) -> Row:
        """What all panels have in common, and the first one's own."""
        return self.panels[0].row

    @property
    def colours(self) -> dict[str, str]:
        """A colour a sensor, the same in all figures of the folder."""
        return sensor_colours(self.results.rows)

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the cells."""
        return tuple(str(panel.row["key"]) for panel in self.panels)


def groups(results: Results, remark: Remark) -> list[Group]:
    """Return the groups of finished cells, a figure's worth each.

    Of several estimators the first that the task names for itself is shown, or else the first in the folder; of several
    replicates the one whose answers the cell's row leads to. Whatever is not shown is told to `remark`.
    """
    alike: dict[tuple[Any, ...], list[Row]] = {}
    for trouble in results.store.troubles:
        remark(trouble)
    for row in results.rows:
        if row["status"] == "done":
            alike.setdefault((row["task"], row["protocol"], row["split"], row["rig"]), []).append(row)
        elif not row["is_baseline"]:
            remark(f"{row['cell']} is in no figure: {row['status']}: {row['reason']}")
    made = [_group(results, rows, remark) for rows in alike.values()]
    return [group for group in made if group is not None]


def _group(results: Results, rows: list[Row], remark: Remark) -> Group | None:
    about = f"{rows[0]['task']} under {rows[0]['protocol']}, split {rows[0]['split']}"
    try:
        task = results.registry.tasks[rows[0]["task"]].spec
    except TactbenchError as error:
        remark(f"No figures of {about}: {error}")
        return None
    answers = [row for row in rows if not row["is_baseline"]]
    names = list(dict.fromkeys(map(answer_name, answers)))
    if not names:
        remark(f"No figures of {about}: no cell is done but baselines.")
        return None
    shown = next((name for name in task.estimators if name in names), names[0])
    if len(names) > 1:
        others = ", ".join(name for name in names if name != shown)
        remark(f"Figures of {about} show {shown}; not shown: {others}.")
    panels = _panels(results, [row for row in answers if answer_name(row) == shown], remark)
    if not panels:
        remark(f"No figures of {about}: no answers of {shown} can be read.")
        return None
    first = next((row["estimator"] for row in rows if row["is_baseline"]), None)
    trivial = [row for row in rows if row["estimator"] == first]
    return Group(results, task, tuple(panels.values()), _panels(results, trivial, remark))


def _panels(results: Results, rows: list[Row], remark: Remark) -> dict[str, Panel]:
    """Return the first readable cell of each sensor."""
    found: dict[str, Panel] = {}
    for row in rows:
        if row["sensor"] in found:
            continue
        answers = results.answers(row)
        if "test" in answers:
            found[row["sensor"]] = Panel(results.replicate(row), answers)
        else:
            remark(f"{row['cell']} is in no figure: cells/{row['key']}.h5 cannot be read. Run it again.")
    order = list(dict.fromkeys(row["sensor"] for row in rows))
    return {sensor: found[sensor] for sensor in order if sensor in found}
