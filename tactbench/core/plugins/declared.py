"""Tasks declared in a file beside recordings, in addition to the installed tasks."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from tactbench.core.errors import UsageError
from tactbench.core.plugins.registry import Family, Owned, Registry
from tactbench.core.spec.rig import TaskDescriptor
from tactbench.core.spec.task import TASKS_FILE, DeclaredTask, TaskFile
from tactbench.core.spec.yaml_file import load_yaml


def declared_in(folder: Path | None) -> tuple[DeclaredTask, ...]:
    """Return the tasks declared in a folder of recordings and in its sub-folders, except hidden ones.

    Raises ConfigError for an invalid file, and UsageError if two files declare different tasks of one name.
    """
    found: dict[str, tuple[DeclaredTask, Path]] = {}
    paths = []
    for below, folders, names in os.walk(folder) if folder is not None else ():
        # A folder that vanishes meanwhile, or may not be read, is passed over.
        folders[:] = [name for name in folders if not name.startswith(".")]
        paths += [Path(below, TASKS_FILE)] if TASKS_FILE in names else []
    for path in sorted(paths):
        for task in load_yaml(path, TaskFile).tasks:
            known, where = found.setdefault(task.name, (task, path))
            if known != task:
                raise UsageError(
                    f"The task {task.name!r} is declared differently in {where} and in {path}.",
                    hint="Give one sub-folder with --recordings, or rename one of the two tasks.",
                )
    return tuple(task for task, _ in found.values())


def with_declared(registry: Registry, tasks: Iterable[DeclaredTask]) -> Registry:
    """Return the registry with `tasks` added; raise UsageError if a task has the name of an installed task."""
    each = {task.name: task for task in tasks}
    family: Family[TaskDescriptor] = Family("task")
    for owned in registry.tasks.all_owned():
        family.add(owned)
    for name, task in each.items():
        if name in registry.tasks:
            raise UsageError(
                f"The task {name!r} in {TASKS_FILE} beside the recordings has the name of an installed task.",
                hint="Rename the task in that file, or in the mapping and import again.",
            )
        descriptor = TaskDescriptor(spec=task.spec)
        family.add(Owned(descriptor, DeclaredTask.__module__, "recordings", "", task.model_dump_json()))
    return registry.with_tasks(family)


def with_declared_of(registry: Registry, rows: Iterable[Mapping[str, Any]]) -> Registry:
    """Return the registry with the tasks that rows of results contain added; of tasks of one name, the last counts.

    A task that cannot be read, or has the name of an installed task, is ignored: rows may come from elsewhere.
    """
    found: dict[str, DeclaredTask] = {}
    for text in dict.fromkeys(str(row.get("declared_task") or "") for row in rows):
        with suppress(ValidationError):
            task = DeclaredTask.model_validate_json(text)
            if task.name not in registry.tasks:
                found[task.name] = task
    return with_declared(registry, found.values())
