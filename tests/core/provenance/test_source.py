"""Real packages, edited: every byte of those that take part counts, and nothing else does."""

import importlib
from importlib.metadata import version

import pytest
from sklearn.linear_model import Ridge

from tactbench.core.provenance.source import ANSWERING, RECORDING, identity_of, source_digest, sources_of, versions
from tests.conftest import ROOT
from tests.core.matrix.plugin_packages import write_package

LAW = {"__init__.py": "from some_plugin.law import LAW\n", "law.py": "LAW = 3\n"}


@pytest.fixture
def package(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    return write_package(tmp_path, "some_plugin", LAW)


def digest(module="some_plugin.anything:at_all", own=()):
    importlib.invalidate_caches()
    source_digest.cache_clear()
    return sources_of([module], own)


@pytest.mark.parametrize("name", ["law.py", "gains.npz", "deep/er/table.yaml"])
def test_every_byte_of_the_package_counts(package, name):
    before = digest()
    path = package / name
    path.parent.mkdir(parents=True, exist_ok=True)
    found = [before]
    for content in (b"1", b"2"):
        path.write_bytes(content)
        found.append(digest())
    assert len({str(one) for one in found}) == 3
    if name in LAW:
        path.write_text(LAW[name])
    else:
        path.unlink()
    assert digest() == before


def test_byte_code_and_hidden_files_do_not_count(package):
    before = digest()
    for name in ("__pycache__/law.cpython-311.pyc", ".law.py.swp", ".git/HEAD"):
        (package / name).parent.mkdir(exist_ok=True)
        (package / name).write_bytes(b"x")
    assert digest() == before


def test_verbs_and_checks_of_tactbench_do_not_count(package, monkeypatch):
    """A recording of the twin was made anew since a verb about devices had changed."""
    monkeypatch.setattr("tactbench.core.provenance.source.PACKAGE", "some_plugin")
    before = source_digest("some_plugin")
    for name in ("cli/doctor.py", "conformance/driver.py"):
        (package / name).parent.mkdir(parents=True)
        (package / name).write_bytes(b"x")
    source_digest.cache_clear()
    assert source_digest("some_plugin") == before


def test_a_module_of_its_own_counts_and_what_it_imports_does_not(tmp_path, monkeypatch):
    (tmp_path / "lone_plugin.py").write_text("from lone_filters import LAW\n")
    (tmp_path / "lone_filters.py").write_text("LAW = 3\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = digest("lone_plugin:at_all")
    assert set(before) == {"lone_plugin"}
    (tmp_path / "lone_filters.py").write_text("LAW = 4\n")
    assert digest("lone_plugin:at_all") == before
    (tmp_path / "lone_plugin.py").write_text("LAW = 5\n")
    assert digest("lone_plugin:at_all") != before
    assert digest("nobody_has_it:at_all") == digest("nobody_has_it:at_all")


ROOMS = {
    "tasks/force.py": (True, False),
    "core/matrix/solve.py": (True, False),
    "core/spec/row.py": (True, True),
    "core/acquisition.py": (False, True),
    "rigs/twin/rig.py": (False, True),
    "core/matrix/run.py": (False, False),
    "sensors/icub.py": (False, False),
}
"""Files of tactbench, and whether they count for an answer and for a recording by the twin."""


@pytest.mark.parametrize(("file", "counts"), ROOMS.items(), ids=[*ROOMS])
def test_of_tactbench_itself_counts_what_takes_part(file, counts):
    path = ROOT / "tactbench" / file
    assert path.exists() or path.with_suffix("").is_dir() or path.parent.is_dir()
    answer, recording = sources_of([], ANSWERING), sources_of(["tactbench.rigs.twin:anything"], RECORDING)
    for sources, expected in zip((answer, recording), counts, strict=True):
        places = [name.partition(".")[2].replace(".", "/") for name in sources]
        assert any(file.startswith(f"{place}/") or file == f"{place}.py" for place in places) == expected


def test_each_place_of_tactbench_that_takes_part_is_there_and_a_missing_distribution_says_so():
    assert {place for place in (*ANSWERING, *RECORDING)
            if not any((ROOT / "tactbench" / one).exists() for one in (place, f"{place}.py"))} == set()  # fmt: skip
    assert versions(("no-such-distribution",))["no-such-distribution"] == "missing"


def test_an_object_is_its_attributes_and_the_code_that_it_uses(tmp_path, monkeypatch):
    weak, strong = (identity_of(Ridge(alpha=alpha)) for alpha in (1.0, 2.0))
    assert weak["object"] != strong["object"]
    assert (weak["source"], weak["versions"]["scikit-learn"]) == ({}, version("scikit-learn"))
    monkeypatch.syspath_prepend(tmp_path)
    write_package(tmp_path, "identified_plugin", {"__init__.py": "class Own:\n    pass\n"})
    assert set(identity_of(importlib.import_module("identified_plugin").Own())["source"]) == {"identified_plugin"}
    with pytest.raises(ValueError, match="lambda"):
        identity_of(lambda: None)
