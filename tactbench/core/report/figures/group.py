"""Style of all figures, and groups of cells that share a figure and differ only in their sensor."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

from tactbench.core.files import replace_file
from tactbench.core.leaderboard.names import Row, answer_name, error_of, grouped, hardware_name
from tactbench.core.report.results import Results, stands_beside
from tactbench.core.samples import Answers
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.task import LabelTarget, TaskSpec, VectorTarget

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MARKERS = "os^DvPX*<>"
"""Markers of categories; their colours ``C0`` … are Okabe and Ito's."""


def styled() -> AbstractContextManager[None]:
    """Return a context in which figures have the style of the file ``paper.mplstyle``."""
    import matplotlib.style

    return matplotlib.style.context(Path(__file__).with_name("paper.mplstyle"), after_reset=True)


def save(figure: Figure, place: Path) -> Path:
    """Write ``PLACE.png`` and ``PLACE.pdf`` and return the path of the PNG; equal figures give equal bytes."""
    # Without dates, and without the version of what drew it.
    apart = {"png": {"Software": None}, "pdf": {"CreationDate": None, "Creator": "tactbench", "Producer": None}}
    for ending, metadata in apart.items():
        content = io.BytesIO()
        figure.savefig(content, format=ending, metadata=metadata)
        figure.set_layout_engine("none")  # the first drawing has put everything in its place
        replace_file(place.with_name(f"{place.name}.{ending}"), content.getvalue())
    return place.with_name(f"{place.name}.png")


def panels(rows: int, columns: int, *, wide: bool = False, **more: Any) -> tuple[Figure, Any]:
    """Return a figure and its (rows, columns) axes, square, over one column of a page or over both if `wide`."""
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained")
    width = figure.get_figwidth() * (2 if wide else 1)
    figure.set_size_inches(width, width * rows / columns)
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def legend(figure: Figure, shown: Iterable[Axes], **more: Any) -> None:
    """Add a legend below a figure, with each label of its panels listed once."""
    entries: dict[str, Any] = {}
    for here in shown:
        handles, labels = here.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside lower center", ncols=6, **more)


_LINE = 64
"""Largest number of characters of a line of a heading above a figure of one column."""


class Sketch(NamedTuple):
    """A figure that has been drawn and not yet saved, with its title and caption."""

    name: str
    """Name of the figure's files without suffix, unique in a folder."""
    title: str
    caption: str
    figure: Figure


class Panel(NamedTuple):
    """The cell of one sensor in a figure."""

    sensor: str
    row: Row
    """Row of the replicate shown in the figure."""
    answers: Mapping[str, Answers]
    """Answers by role: train, validation, test."""


@dataclass(frozen=True)
class Group:
    """The cells of one figure, one for each sensor, in the order of the result rows."""

    results: Results
    task: TaskSpec
    panels: tuple[Panel, ...]

    @property
    def row(self) -> Row:
        """Row of the first panel; task, protocol, split and estimator are the same in all panels."""
        return self.panels[0].row

    @property
    def quantity(self) -> str:
        """Quantity predicted in the task, in words."""
        target = self.task.target
        if isinstance(target, SlipTarget):
            return "state of slip"
        if isinstance(target, LabelTarget):
            return target.name.removesuffix(f"_{target.unit}").replace("_", " ")
        components = f" ({', '.join(target.names)})" if isinstance(target, VectorTarget) else ""
        return target.kind.replace("_", " ") + components

    @property
    def unit(self) -> str:
        """Unit of the predicted quantity."""
        target = self.task.target
        return target.unit if isinstance(target, LabelTarget) else self.task.unit

    def sketch(self, kind: str, title: str, caption: str, figure: Figure) -> Sketch:
        """Return the group's figure with its name and heading; explanations of marks are appended to the caption."""
        row = self.row
        words = [kind, row["task"], row["protocol"], row["split"], answer_name(row)]
        words += [] if row["simulated"] else [row["rig"]]
        name = re.sub(r"[^a-z0-9]+", "-", "-".join(filter(None, words)).lower()).strip("-")
        shown, stamps = "", [f"‡: {stamp}" for stamp in row["stamps"]]
        if row["repeats"] > 1:  # a figure of single answers is of one replicate
            shown = f"replicate with seed {row['seed']}"
            stamps.append(f"Shown: {shown}; the tables are over all of them.")
        if row["dagger"]:
            stamps.append("†: each set, the test set too, is scaled by its own mean and deviation.")
        split = "" if row["split"] in (None, "roles") else f"split {row['split']}{' ‡' * bool(row['stamps'])}"
        protocol = row["protocol"] + " †" * row["dagger"]
        heading = [row["task"], answer_name(row), protocol, split, hardware_name(row), shown]
        figure.suptitle(fill(" · ".join(filter(None, heading)), _LINE))
        return Sketch(name, title, " ".join((caption, *stamps)), figure)


def with_unit(words: str, unit: str) -> str:
    """Return the label of an axis: `words [unit]`, without the unit if it is 1."""
    return words if unit == "1" else f"{words} [{unit}]"


def groups(results: Results, remark: Callable[[str], None]) -> list[Group]:
    """Return the groups of finished cells, one group for each set of figures.

    Of several estimators, one that is comparable with a published number is shown, or else the estimator with the best
    score; of several replicates, that whose answers are stored with the cell's row. `remark` is called with a
    sentence on each omission.
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
                panels.setdefault(row["sensor"], Panel(row["sensor"], results.replicate(row), stored))
            else:
                remark(f"{row['cell']} is not drawn: cells/{row['key']}.h5 cannot be read. Run the cell again.")
        if panels:
            found.append(Group(results, task, tuple(panels.values())))
    return found
