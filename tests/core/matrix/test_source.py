import importlib
import sys

import pytest

from tactbench.core.matrix.source import SourceDigests


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = tmp_path / "some_plugin"
    folder.mkdir()
    (folder / "__init__.py").write_text("from some_plugin.law import LAW\n")
    (folder / "law.py").write_text("LAW = 3\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    yield folder
    sys.modules.pop("some_plugin", None)


def digest(tmp_path):
    sources = SourceDigests(tmp_path / "memory.json")
    found = sources.package("some_plugin.anything:at_all")
    sources.save()
    return found


def test_comments_and_formatting_do_not_count(package, tmp_path):
    before = digest(tmp_path)
    (package / "law.py").write_text("# why three\nLAW = (\n    3\n)\n")
    assert digest(tmp_path) == before


def test_a_changed_module_beside_the_plugin_counts(package, tmp_path):
    before = digest(tmp_path)
    (package / "law.py").write_text("LAW = 4\n")
    assert digest(tmp_path) != before


def test_a_new_module_counts(package, tmp_path):
    before = digest(tmp_path)
    (package / "more.py").write_text("")
    assert digest(tmp_path) != before


def test_the_memory_changes_nothing_and_may_be_rubbish(package, tmp_path):
    before = digest(tmp_path)
    assert digest(tmp_path) == before
    (tmp_path / "memory.json").write_text("rubbish")
    assert digest(tmp_path) == before


@pytest.mark.parametrize(
    ("purpose", "module", "not_counted"),
    [("answer", "tactbench.tasks.force", ("sensors/", "rigs/")),
     ("recording", "tactbench.sensors.biotac", ("tasks/", "estimators/", "core/evaluation/", "core/matrix/"))],
)  # fmt: skip
def test_what_shows_results_or_serves_another_purpose_does_not_count(tmp_path, purpose, module, not_counted):
    names = SourceDigests(tmp_path / "memory.json").behind([module], purpose).packages["tactbench"]
    assert {"core/recording/reader.py", "core/samples.py", "plugin.py"} <= set(names)
    assert not any(name.startswith(("core/cli", "core/leaderboard", *not_counted)) for name in names)
