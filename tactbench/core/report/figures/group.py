"""Groups the cells of one figure, which differ only in their sensor, and writes its heading and caption."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from textwrap import fill
from typing import TYPE_CHECKING, NamedTuple

from tactbench.core.leaderboard.names import METRIC_NAMES, answer_name, error_of, grouped
from tactbench.core.matrix.store import Row
from tactbench.core.report.figures.style import sensor_colours
from tactbench.core.report.published import stands_beside
from tactbench.core.report.results import Results
from tactbench.core.samples import Answers
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.task import LabelTarget, TaskSpec, VectorTarget

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LINE = 64
"""Largest number of characters that fit above a column."""
MARKS = {
    "simulated": "SIM: simulated, no hardware was touched.",
    "dagger": "†: each set, the test set too, is scaled by its own mean and deviation.",
}
"""Explanation of each mark, by the key of a row that it stands for."""


class Sketch(NamedTuple):
    """A figure before it is saved."""

    name: str
    """Name of its files, unique among the figures of a folder."""
    title: str
    caption: str
    figure: Figure


class Panel(NamedTuple):
    """The cell of one sensor, with its answers."""

    row: Row
    """Row of the replicate that is shown."""
    answers: Mapping[str, Answers]
    """Answers by role."""

    @property
    def sensor(self) -> str:
        """Return the name of the sensor."""
        return str(self.row["sensor"])


@dataclass(frozen=True)
class Group:
    """The cells of one figure, in the order of the rows."""

    results: Results
    task: TaskSpec
    panels: tuple[Panel, ...]

    @property
    def row(self) -> Row:
        """Return the row of the first panel, which shares task, protocol, split and estimator with all others."""
        return self.panels[0].row

    @cached_property
    def colours(self) -> dict[str, str]:
        """Return a colour for each sensor, the same in all figures of the folder."""
        return sensor_colours(self.results.rows)

    @property
    def metric(self) -> str:
        """Return the name of the metric as tables write it."""
        return METRIC_NAMES.get(self.task.metric, self.task.metric)

    @property
    def quantity(self) -> str:
        """Return the quantity that the task predicts, in words."""
        target = self.task.target
        if isinstance(target, SlipTarget):
            return "state of slip"
        if isinstance(target, LabelTarget):
            return target.name.removesuffix(f"_{target.unit}").replace("_", " ")
        components = f" ({', '.join(target.names)})" if isinstance(target, VectorTarget) else ""
        return target.kind.replace("_", " ") + components

    @property
    def unit(self) -> str:
        """Return the unit of the predicted quantity."""
        target = self.task.target
        return target.unit if isinstance(target, LabelTarget) else self.task.unit

    def sketch(self, kind: str, title: str, caption: str, figure: Figure) -> Sketch:
        """Return the group's figure of a kind with its heading; the caption ends with an explanation of its marks."""
        row = self.row
        words = [kind, row["task"], row["protocol"], row["split"], answer_name(row)]
        words += [] if row["simulated"] else [row["rig"]]
        name = re.sub(r"[^a-z0-9]+", "-", "-".join(filter(None, words)).lower()).strip("-")
        # A figure of single answers shows one of several replicates.
        shown = f"replicate with seed {row['seed']}" if row["repeats"] > 1 else ""
        heading = [row["task"], answer_name(row), row["protocol"] + (" †" if row["dagger"] else "")]
        if row["split"] not in (None, "roles"):
            heading.append(f"split {row['split']}" + (" ‡" if row["stamps"] else ""))
        heading += ["SIM" if row["simulated"] else f"rig {row['rig']}", shown]
        figure.suptitle(fill(" · ".join(filter(None, heading)), _LINE))
        marks = [MARKS[key] for key in MARKS if row[key]] + [f"‡: {stamp}" for stamp in row["stamps"]]
        marks += [f"Shown: {shown}; the tables are over all of them."] if shown else []
        return Sketch(name, title, " ".join((caption, *marks)), figure)


def with_unit(words: str, unit: str) -> str:
    """Return the label of an axis."""
    return words if unit == "1" else f"{words} [{unit}]"


def groups(results: Results, remark: Callable[[str], None]) -> list[Group]:
    """Return the groups of finished cells, one for each set of figures.

    Of several estimators, the one that is comparable with a published number is shown, or else the one with the best
    score; of several replicates, the one whose answers are stored with the cell's row. `remark` is called with a
    sentence on what is not shown.
    """
    for trouble in results.store.troubles:
        remark(trouble)
    done = [row for row in results.rows if row["status"] == "done" and not row["is_baseline"]]
    found = []
    for (name, protocol, split, _), rows in grouped(done, itemgetter("task", "protocol", "split", "rig")).items():
        where = f"{name} under {protocol}, split {split}"
        if name not in results.registry.tasks:
            remark(f"{where}: the task is not installed.")
            continue
        task = results.registry.tasks[name].spec
        beside = [row for row in rows if any(stands_beside(row, task, one) for one in task.published)]
        answers = grouped(rows, answer_name)
        shown = answer_name(min(beside or rows, key=error_of))
        if len(answers) > 1:
            remark(f"{where}: {shown} is shown; not shown: {', '.join(one for one in answers if one != shown)}.")
        panels: dict[str, Panel] = {}
        for row in answers[shown]:
            stored = results.answers(row)
            if "test" in stored:
                panels.setdefault(row["sensor"], Panel(results.replicate(row), stored))
            else:
                remark(f"{row['cell']} is in no figure: cells/{row['key']}.h5 cannot be read. Run it again.")
        if panels:
            found.append(Group(results, task, tuple(panels.values())))
    return found
