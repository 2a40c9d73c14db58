"""Tasks that come with recordings, beside those that are installed."""

import json

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.plugins.declared import declared_in, with_declared, with_declared_of
from tactbench.core.plugins.registry import installed
from tactbench.core.spec.task import TASKS_FILE, DeclaredTask


def task(name, unit="mm"):
    return DeclaredTask(name=name, target={"source": "vector", "names": ["x"], "unit": unit}, splits=("session",))


def write(folder, *tasks):
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"tasks": [one.model_dump(mode="json", exclude_unset=True) for one in tasks]})
    (folder / TASKS_FILE).write_text(text, encoding="utf-8")


def test_tasks_of_a_folder_and_of_those_below_are_found_once_and_hidden_ones_are_passed_over(tmp_path):
    write(tmp_path, task("where"))
    write(tmp_path / "below", task("where"), task("there"))
    write(tmp_path / ".hidden", task("where", "m"))
    assert declared_in(tmp_path) == (task("where"), task("there"))
    assert declared_in(None) == ()
    write(tmp_path / "other", task("there", "m"))
    with pytest.raises(UsageError, match="'there'"):
        declared_in(tmp_path)


def test_declared_tasks_stand_beside_installed_ones_whose_names_they_may_not_have():
    registry = installed()
    assert with_declared(registry, ()).tasks.names() == registry.tasks.names()
    found = with_declared(registry, [task("where")])
    assert set(found.tasks.names()) == {*registry.tasks.names(), "where"}
    owned = found.tasks.owned("where")
    assert owned.descriptor.spec == task("where").spec
    assert DeclaredTask.model_validate_json(owned.declared) == task("where")
    with pytest.raises(UsageError, match="'force'"):
        with_declared(registry, [task("force")])


def test_rows_bring_the_tasks_that_can_be_read_and_the_last_of_a_name():
    texts = ["", "nonsense", *(one.model_dump_json() for one in (task("where"), task("force"), task("where", "m")))]
    found = with_declared_of(installed(), [{"declared_task": text} for text in texts])
    assert set(found.tasks.names()) == {*installed().tasks.names(), "where"}
    assert found.tasks["where"].spec.unit == "m"
