"""Tasks that a mapping declares, and the file beside its recordings that holds them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import yaml

from tactbench.core.errors import MappingError
from tactbench.core.files import writable
from tactbench.core.recording.mapping.channels import MappedStream
from tactbench.core.recording.mapping.model import Mapping as MappingFile
from tactbench.core.spec.declared_task import FILE
from tactbench.core.spec.task import LabelTarget, VectorTarget

SPLITS = ("roles", "session", "recording", "trial", "in-session", "shuffled")
"""Splits that need no label."""
_FEW_SHOT = re.compile(r"few-shot-[1-9][0-9]{0,3}")


def require_answerable(mapping: MappingFile, streams: Mapping[str, MappedStream], path: Path) -> None:
    """Raise MappingError for a task that needs channels or labels which the recordings will not have."""
    channels = [channel for stream in streams.values() for channel in stream.spec.channels]
    own = {str(one.spec.kind) for stream in streams.values() if stream.source.of == "sensor" for one in stream.channels}
    labels = {label for stream in streams.values() for label in stream.source.annotations} | {*mapping.recording.labels}
    for task in mapping.tasks:
        groups = [split for split in task.splits if not _FEW_SHOT.fullmatch(split)]
        needs: list[tuple[str, set[str], set[str]]] = [
            ("features of kind", set(task.features), own),
            ("the split", {*groups}, {*SPLITS, *labels}),
        ]
        if isinstance(task.target, LabelTarget):
            needs.append(("the label", {task.target.name}, labels))
        else:
            kind = task.target.kind
            parts = task.target.components if isinstance(task.target, VectorTarget) else (task.target,)
            names = {one.name for one in parts if one.name is not None}
            needs.append(("a target of kind", {kind}, {one.kind for one in channels}))
            needs.append((f"the {kind} channel", names, {one.name for one in channels if one.kind == kind}))
        for what, some, there in needs:
            for name in sorted(some - there):
                raise MappingError(
                    f"{path}: task {task.name!r} needs {what} {name}, which the mapping does not have.",
                    hint=f"It has {', '.join(sorted(there)) or 'none'}.",
                )


def tasks_text(mapping: MappingFile) -> str:
    """Return the text of the file of tasks beside the recordings; empty if the mapping declares none."""
    if not mapping.tasks:
        return ""
    tasks = [task.model_dump(mode="json", exclude_unset=True) for task in mapping.tasks]
    body = yaml.safe_dump({"version": 1, "tasks": tasks}, sort_keys=False, allow_unicode=True)
    return f"# Tasks of these recordings, from their mapping; `tactbench run --recordings` reads them.\n{body}"


def check_tasks(out: Path, text: str, *, replace: bool) -> None:
    """Raise MappingError if there is a file with other tasks which is not to be replaced."""
    target = out / FILE
    if text and not replace and target.exists() and target.read_text(encoding="utf-8") != text:
        raise MappingError(
            f"{target} exists already and declares other tasks.",
            hint="Give another folder with --out DIR, or replace it with --replace.",
        )


def write_tasks(folder: Path, text: str) -> None:
    """Write the file of tasks into a folder; raises UnwritableError."""
    if text:
        with writable(folder / FILE):
            (folder / FILE).write_text(text, encoding="utf-8")
