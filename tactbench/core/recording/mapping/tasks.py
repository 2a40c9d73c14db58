"""The tasks that a mapping declares, and the file in which they lie beside its recordings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import yaml

from tactbench.core.errors import MappingError, UnwritableError
from tactbench.core.recording.mapping.channels import MappedStream
from tactbench.core.recording.mapping.model import Mapping as MappingFile
from tactbench.core.spec.declared_task import FILE, TaskFile
from tactbench.core.spec.task import LabelTarget, VectorTarget
from tactbench.core.spec.yaml_file import load_yaml


def require_channels(mapping: MappingFile, streams: Mapping[str, MappedStream], path: Path) -> None:
    """Refuse a task whose target names a channel that is not there; raises MappingError."""
    every = [channel for stream in streams.values() for channel in stream.spec.channels]
    for task in mapping.tasks:
        if isinstance(task.target, LabelTarget):
            continue
        there = [channel.name for channel in every if channel.kind == task.target.kind]
        for one in task.target.components if isinstance(task.target, VectorTarget) else (task.target,):
            if one.name is not None and one.name not in there:
                raise MappingError(
                    f"{path}: task {task.name!r} asks for the {one.kind} channel {one.name!r}; there are: "
                    f"{', '.join(there)}.",
                    hint="Name one of them in the task's target.",
                )


def tasks_text(mapping: MappingFile, name: str) -> str:
    """Return what is to lie beside the recordings of the mapping called `name`; empty if it declares no task."""
    if not mapping.tasks:
        return ""
    tasks = [task.model_dump(mode="json", exclude_unset=True) for task in mapping.tasks]
    body = yaml.safe_dump({"version": 1, "tasks": tasks}, sort_keys=False, allow_unicode=True)
    return f"# Tasks of these recordings, from the mapping {name}; `tactbench run --recordings` reads them.\n{body}"


def check_tasks(out: Path, text: str, *, replace: bool) -> None:
    """Refuse to write over other tasks unless they are to be replaced; raises MappingError."""
    target = out / FILE
    if not text or replace or not target.exists():
        return
    if load_yaml(target, TaskFile) != TaskFile.model_validate(yaml.safe_load(text)):
        raise MappingError(
            f"{target} exists already and declares other tasks.",
            hint="Give another folder with --out DIR, or replace it with --replace.",
        )


def place_tasks(out: Path, aside: Path, text: str) -> None:
    """Write the tasks into `aside` and move them to `out`; raises UnwritableError."""
    if not text:
        return
    try:
        (aside / FILE).write_text(text, encoding="utf-8")
        (aside / FILE).replace(out / FILE)
    except OSError as error:
        raise UnwritableError(
            f"{out / FILE} cannot be written: {error.strerror}.", hint="Give another with --out."
        ) from error
