"""A figure before it is saved, and the words that every figure of a group shares."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tactbench.core.leaderboard.names import METRIC_NAMES, answer_name
from tactbench.core.report.figures.group import Group, Panel
from tactbench.core.report.figures.style import colour_name
from tactbench.core.spec.events import SlipTarget
from tactbench.core.spec.task import LabelTarget, TaskSpec, VectorTarget

if TYPE_CHECKING:
    from matplotlib.figure import Figure


LINE = 64
"""Letters that fit above a column, wide ones too."""


@dataclass(frozen=True)
class Sketch:
    """What a module of this room returns."""

    kind: str
    """Short name of the kind of figure."""
    title: str
    caption: str
    group: Group
    figure: Figure

    @property
    def name(self) -> str:
        """Short and unique among the figures of a folder, whatever else is in it."""
        row = self.group.row
        rig = "" if row["simulated"] else row["rig"]
        parts = (self.kind, row["task"], row["protocol"], row["split"], answer_name(row), rig)
        return re.sub(r"[^a-z0-9]+", "-", "-".join(part for part in parts if part).lower()).strip("-")


def heading(group: Group, *more: str) -> str:
    """Return what stands above a figure: question, answer, protocol with its marks, SIM; in lines that fit a column."""
    row = group.row
    parts = [row["task"], answer_name(row), row["protocol"] + (" †" if row["dagger"] else "")]
    if row["split"] not in (None, "roles"):
        parts.append(f"split {row['split']}" + (" ‡" if row["stamps"] else ""))
    parts += ["SIM" if row["simulated"] else f"rig {row['rig']}", *more, *_shown(row)]
    lines = [parts[0]]
    for part in parts[1:]:
        if len(lines[-1]) + len(part) < LINE:
            lines[-1] += f" · {part}"
        else:
            lines.append(part)
    return "\n".join(lines)


def marks(group: Group) -> str:
    """Return what the marks in the heading mean, and which replicate is shown."""
    row = group.row
    sentences = [""]
    if row["simulated"]:
        sentences.append("SIM: simulated, no hardware was touched.")
    if row["dagger"]:
        sentences.append("†: each set, the test set too, is scaled by its own mean and deviation.")
    sentences += [f"‡: {stamp}" for stamp in row["stamps"]]
    sentences += [f"Shown: {one}; the tables are over all of them." for one in _shown(row)]
    return " ".join(sentences)


def _shown(row: Mapping[str, Any]) -> list[str]:
    """Return which of several replicates a figure of single answers shows; of recordings, which of several seeds."""
    if row["repeats"] <= 1:
        return []
    return [f"{'replicate' if row['simulated'] else 'seed'} {row['repeat']} of {row['repeats']}"]


def quantity(task: TaskSpec) -> str:
    """Return what a task asks for, in words."""
    target = task.target
    if isinstance(target, SlipTarget):
        return "state of slip"
    if isinstance(target, LabelTarget):
        return target.name.removesuffix(f"_{target.unit}").replace("_", " ")
    if isinstance(target, VectorTarget):
        return f"{target.kind} ({', '.join(target.names)})"
    return (target.name if target.name and len(target.name) > 2 else target.kind).replace("_", " ")


def with_unit(words: str, unit: str) -> str:
    """Return the label of an axis."""
    return words if unit == "1" else f"{words} [{unit}]"


def metric_name(task: TaskSpec) -> str:
    """Return a metric as the tables call it."""
    return METRIC_NAMES.get(task.metric, task.metric)


def coloured(group: Group, shown: Sequence[Panel]) -> str:
    """Return the sensors with the names of their colours."""
    return ", ".join(f"{panel.sensor} {colour_name(group.colours[panel.sensor])}" for panel in shown)


def sensors(group: Group) -> str:
    """Return the sensors in the order of the panels."""
    return ", ".join(panel.sensor for panel in group.panels)
