"""Where a user's runs remember the digests of sources, and that a second result folder has them from there."""

import stat
import sys
from pathlib import Path

import pytest

from tactbench.core.matrix import meaning
from tactbench.core.matrix.personal import cache_folder, sources_of_this_user

linux_only = pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="other platforms keep caches elsewhere")


def test_the_variable_moves_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("TACTBENCH_CACHE", str(tmp_path / "elsewhere"))
    assert cache_folder() == tmp_path / "elsewhere"


@linux_only
@pytest.mark.parametrize(("base", "found"), [("{}/caches", "caches/tactbench"), ("relative", ".cache/tactbench"),
                                             ("", ".cache/tactbench")])  # fmt: skip
def test_without_it_the_platforms_place_holds_it(monkeypatch, tmp_path, base, found):
    monkeypatch.delenv("TACTBENCH_CACHE")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", base.format(tmp_path))
    assert cache_folder() == tmp_path / found


def test_what_one_run_has_read_the_next_one_knows(monkeypatch, tmp_path):
    monkeypatch.setenv("TACTBENCH_CACHE", str(tmp_path / "cache"))
    first = sources_of_this_user()
    before = first.package("yaml")
    first.save()
    (file,) = (tmp_path / "cache").iterdir()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    content = file.read_bytes()
    again = sources_of_this_user()
    assert again.package("yaml") == before
    again.save()
    assert file.read_bytes() == content


def test_what_other_code_has_read_is_not_believed(monkeypatch, tmp_path):
    monkeypatch.setenv("TACTBENCH_CACHE", str(tmp_path / "cache"))
    sources = sources_of_this_user()
    sources.package("yaml")
    sources.save()
    changed = tmp_path / "meaning.py"
    changed.write_bytes(Path(meaning.__file__).read_bytes() + b"CHANGED = True\n")
    monkeypatch.setattr(meaning, "__file__", str(changed))
    sources = sources_of_this_user()
    sources.package("yaml")
    sources.save()
    assert len(list((tmp_path / "cache").iterdir())) == 2


def test_set_to_nothing_nothing_is_remembered(monkeypatch, tmp_path):
    monkeypatch.setenv("TACTBENCH_CACHE", "")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    sources = sources_of_this_user()
    assert sources.package("yaml")
    sources.save()
    assert list(tmp_path.iterdir()) == []
