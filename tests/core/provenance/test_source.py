"""Real packages, edited: every byte of those that take part counts, and nothing else does."""

import importlib
import sys
import types
from importlib.metadata import version
from pathlib import Path

import pytest
from sklearn.linear_model import Ridge

from tactbench.core.provenance import ANSWERING, RECORDING, identity_of, source_digest, sources_of, versions
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


def test_every_byte_of_the_package_counts_but_for_byte_code_hidden_files_and_verbs(package, monkeypatch):
    """A recording of the twin was made anew since a verb about devices had changed."""
    monkeypatch.setattr("tactbench.core.provenance.PACKAGE", "some_plugin")
    before = source_digest("some_plugin")
    uncounted = (
        "__pycache__/law.cpython-311.pyc",
        ".law.py.swp",
        ".git/HEAD",
        "cli/doctor.py",
        "conformance/driver.py",
    )
    for name in (*uncounted, "gains.npz", "deep/er/table.yaml", "law.py"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        found = []
        for content in (b"1", b"2"):
            (package / name).write_bytes(content)
            source_digest.cache_clear()
            found.append(source_digest("some_plugin"))
        assert len({before, *found}) == (1 if name in uncounted else 3), name
        before = found[-1]


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
}
"""Files of tactbench, and whether they count for an answer and for a recording by the twin."""


def test_of_tactbench_itself_counts_what_takes_part():
    answer, recording = sources_of([], ANSWERING), sources_of(["tactbench.rigs.twin.rig:anything"], RECORDING)
    assert recording.keys() - sources_of([], RECORDING) == {"tactbench.rigs.twin"}
    for file, counts in ROOMS.items():
        for sources, expected in zip((answer, recording), counts, strict=True):
            places = [name.partition(".")[2].replace(".", "/") for name in sources]
            assert any(file.startswith(f"{place}/") or file == f"{place}.py" for place in places) == expected, file
    assert len({*answer.values()}) == len(answer), "of each the content of its own"


def test_each_place_of_tactbench_that_takes_part_is_there_and_a_missing_distribution_says_so():
    assert {place for place in (*ANSWERING, *RECORDING)
            if not any((ROOT / "tactbench" / one).exists() for one in (place, f"{place}.py"))} == set()  # fmt: skip
    assert versions(("no-such-distribution",))["no-such-distribution"] == "missing"


def test_an_object_is_its_attributes_and_the_code_that_it_uses(tmp_path, monkeypatch):
    weak, strong = (identity_of(Ridge(alpha=alpha)) for alpha in (1.0, 2.0))
    assert weak["object"] != strong["object"]
    assert (weak["source"], weak["versions"]) == ({}, versions(("scikit-learn",)))
    assert weak["versions"]["scikit-learn"] == version("scikit-learn")
    assert set(identity_of(Path)["versions"]) == set(versions()), "the standard library is Python's version"
    monkeypatch.syspath_prepend(tmp_path)
    write_package(tmp_path, "identified_plugin", {"__init__.py": "class Own:\n    pass\n"})
    own = importlib.import_module("identified_plugin").Own
    assert identity_of(own())["source"] == sources_of(["identified_plugin"], ())
    (tmp_path / "script.py").write_text("class Own:\n    pass\n")
    main = types.ModuleType("__main__")
    exec((tmp_path / "script.py").read_text(), vars(main))  # a script of a person
    monkeypatch.setitem(sys.modules, "__main__", main)
    with pytest.raises(ValueError, match="__file__"):  # of a notebook
        identity_of(main.Own())
    main.__file__ = str(tmp_path / "script.py")
    script = identity_of(main.Own())["source"]
    (tmp_path / "script.py").write_text("# changed\n")
    assert script.keys() == {"__main__"}
    assert script != identity_of(main.Own())["source"]
    with pytest.raises(ValueError, match="lambda"):
        identity_of(lambda: None)
