"""Real packages, edited: every byte of them counts, and every package that they import."""

import importlib
import sys
import tomllib
import zipfile

import pytest

from tactbench.core.provenance.source import SHOWING, SourceDigests, imports_of
from tests.conftest import ROOT
from tests.core.matrix.plugin_packages import write_metadata, write_package


@pytest.fixture
def package(tmp_path, monkeypatch):
    folder = write_package(
        tmp_path, "some_plugin", {"__init__.py": "from some_plugin.law import LAW\n", "law.py": "LAW = 3\n"}
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    yield folder
    sys.modules.pop("some_plugin", None)


def digest(tmp_path, module="some_plugin.anything:at_all", purpose="answer"):
    importlib.invalidate_caches()
    found = SourceDigests().behind([module], purpose)
    return {name: files for name, files in found.packages.items() if name != "tactbench"}, found.versions


@pytest.mark.parametrize("text", ["LAW = 4\n", "LAW = 3.0\n", "LAW = '3'\n", "LAW = 3  # the law\n", "LAW = ("])
def test_a_changed_module_beside_the_plugin_counts(package, tmp_path, text):
    before = digest(tmp_path)
    (package / "law.py").write_text(text)
    assert digest(tmp_path) != before


@pytest.mark.parametrize(
    "name", ["more.py", "gains.npz", "deep/er/table.yaml", "_fast.cpython-311-x86_64-linux-gnu.so"]
)
def test_every_file_of_the_package_counts(package, tmp_path, name):
    before = digest(tmp_path)
    path = package / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"1")
    added = digest(tmp_path)
    assert added != before
    path.write_bytes(b"2")
    assert digest(tmp_path) not in (before, added)
    path.unlink()
    assert digest(tmp_path) == before


def test_byte_code_and_hidden_files_do_not_count(package, tmp_path):
    before = digest(tmp_path)
    for name in ("__pycache__/law.cpython-311.pyc", ".law.py.swp", ".git/HEAD"):
        (package / name).parent.mkdir(exist_ok=True)
        (package / name).write_bytes(b"x")
    assert digest(tmp_path) == before


def test_a_linked_folder_counts_and_a_loop_of_links_ends(package, tmp_path):
    (package / "loop").symlink_to(package, target_is_directory=True)
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "table.csv").write_text("1")
    (package / "tables").symlink_to(outside, target_is_directory=True)
    before = digest(tmp_path)
    (outside / "table.csv").write_text("2")
    assert digest(tmp_path) != before


def test_all_portions_of_a_namespace_count(tmp_path, monkeypatch):
    for place in ("one", "two"):
        write_package(tmp_path / place, "shared_name", {f"{place}/__init__.py": "LAW = 3\n"})
        monkeypatch.syspath_prepend(str(tmp_path / place))
    before, _ = digest(tmp_path, "shared_name.one:at_all")
    assert set(before["shared_name"]) == {"one/__init__.py", "two/__init__.py"}
    (tmp_path / "two" / "shared_name" / "two" / "__init__.py").write_text("LAW = 4\n")
    assert digest(tmp_path, "shared_name.one:at_all")[0] != before


def test_two_portions_may_have_a_file_of_one_name(tmp_path, monkeypatch):
    for place in ("one", "two"):
        write_package(tmp_path / place, "shared_name", {"law.py": f"LAW = '{place}'\n"})
        monkeypatch.syspath_prepend(str(tmp_path / place))
    assert len(digest(tmp_path, "shared_name.law:at_all")[0]["shared_name"]) == 2


def test_a_single_module_counts_and_so_does_the_module_it_imports(tmp_path, monkeypatch):
    (tmp_path / "lone_plugin.py").write_text("from lone_filters import LAW\n")
    (tmp_path / "lone_filters.py").write_text("LAW = 3\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    before, _ = digest(tmp_path, "lone_plugin:at_all")
    assert set(before) == {"lone_plugin", "lone_filters"}
    (tmp_path / "lone_filters.py").write_text("LAW = 4\n")
    assert digest(tmp_path, "lone_plugin:at_all")[0] != before


def test_an_archive_counts_as_a_whole(tmp_path, monkeypatch):
    archive = tmp_path / "zipped.zip"

    def write(law):
        with zipfile.ZipFile(archive, "w") as file:
            file.writestr("zipped_plugin/__init__.py", "")
            file.writestr("zipped_plugin/law.py", f"LAW = {law}\n")

    write(3)
    monkeypatch.syspath_prepend(str(archive))
    before = digest(tmp_path, "zipped_plugin:at_all")[0]
    assert digest(tmp_path, "zipped_plugin:at_all")[0] == before
    write(4)
    assert digest(tmp_path, "zipped_plugin:at_all")[0] != before


def test_what_was_installed_and_is_imported_counts_by_its_version(package, tmp_path, monkeypatch):
    site = tmp_path / "site-packages"
    write_package(site, "vendor_maths", {"__init__.py": "PI = 3\n"})
    write_metadata(site, "Vendor.Maths-Lib", "1.0", record="vendor_maths/__init__.py,,\n")
    monkeypatch.syspath_prepend(str(site))
    (package / "law.py").write_text("import vendor_maths\nLAW = vendor_maths.PI\n")
    before = digest(tmp_path)
    assert before[1] == {"vendor_maths": "vendor-maths-lib 1.0"}
    (site / "vendor_maths" / "__init__.py").write_text("PI = 4\n")
    assert digest(tmp_path) == before
    (site / "Vendor.Maths_Lib-1.0.dist-info").rename(site / "Vendor.Maths_Lib-1.1.dist-info")
    assert digest(tmp_path)[1] == {"vendor_maths": "vendor-maths-lib 1.1"}


def test_a_file_that_nobody_installed_counts_by_its_source_even_there(package, tmp_path, monkeypatch):
    site = tmp_path / "site-packages"
    write_package(site, "dropped_in", {"__init__.py": "PI = 3\n"})
    monkeypatch.syspath_prepend(str(site))
    (package / "law.py").write_text("import dropped_in\n")
    assert set(digest(tmp_path)[0]) == {"some_plugin", "dropped_in"}


def test_an_import_that_is_missing_counts_once_it_is_there(package, tmp_path):
    (package / "law.py").write_text("try:\n    import perhaps_installed\nexcept ImportError:\n    pass\n")
    before = digest(tmp_path)
    assert before[1] == {"perhaps_installed": "absent"}
    (tmp_path / "perhaps_installed.py").write_text("")
    assert digest(tmp_path) != before


def test_a_package_that_nobody_can_find_never_has_the_same_digest(tmp_path):
    assert digest(tmp_path, "nowhere_at_all:x") != digest(tmp_path, "nowhere_at_all:x")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import a.b, c", ["a", "c"]),
        ("from a.b import c", ["a"]),
        ("from . import a\nfrom .b import c", []),
        ("def f():\n    import a", ["a"]),
        ("import importlib\nimportlib.import_module('a.b')", ["a", "importlib"]),
        ("from tactbench.plugin import hookimpl", ["tactbench.plugin"]),
        ("from tactbench import rigs", ["tactbench.rigs"]),
        ("import tactbench.core.evaluation.cell", ["tactbench.core.evaluation"]),
        ("this is no Python", []),
    ],
)
def test_imports_are_read_off_the_source(text, found):
    assert imports_of(text.encode()) == found


@pytest.mark.parametrize(
    ("purpose", "module", "not_counted"),
    [("answer", "tactbench.tasks.force", ("sensors/", "rigs/")),
     ("recording", "tactbench.sensors.biotac", ("tasks/", "estimators/", "core/evaluation/", "core/matrix/"))],
)  # fmt: skip
def test_what_shows_results_or_serves_another_purpose_does_not_count(tmp_path, purpose, module, not_counted):
    names = SourceDigests().behind([module], purpose).packages["tactbench"]
    assert {"core/recording/reader.py", "core/samples.py", "plugin/__init__.py"} <= set(names)
    assert not any(name.startswith(("core/cli", "core/leaderboard", *not_counted)) for name in names)


def test_a_strangers_estimator_that_looks_into_our_rigs_is_made_by_them_too(package, tmp_path):
    def ours():
        sources = SourceDigests()
        return sources.behind(["some_plugin"], "answer").packages["tactbench"]

    assert not any(name.startswith("rigs/") for name in ours())
    (package / "law.py").write_text("from tactbench.rigs.twin.geometry import anything\n")
    assert any(name.startswith("rigs/") for name in ours())


def test_what_only_shows_is_what_stands_above_the_matrix():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (floors,) = [contract["layers"] for contract in contracts if contract["name"] == "The floors of the core"]
    above = {room.strip(" ()") for floor in floors[: floors.index("matrix")] for room in floor.split("|")}
    shown = {name.split("/")[1] for name in SHOWING if name.startswith("core/") and "matrix" not in name}
    assert above <= shown
    # `statistics` is on its way up there: it ranks rows and makes none. Provenance says what made them.
    assert shown - above <= {"statistics", "provenance"}
