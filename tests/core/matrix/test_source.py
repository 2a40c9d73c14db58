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


def test_tables_do_not_belong_to_what_decides_a_score(tmp_path):
    sources = SourceDigests(tmp_path / "memory.json")
    for purpose, other in (("answer", ("sensors/", "rigs/")), ("recording", ("tasks/", "core/evaluation/"))):
        names = sources.behind(["tactbench.sensors.biotac"], purpose).packages["tactbench"]
        assert "core/recording/reader.py" in names
        assert not any(name.startswith(("core/cli", "core/leaderboard")) for name in names)
        assert any(name.startswith(other) for name in names) == (purpose == "answer")
