"""The packages of examples/plugins: they stand on the doors alone.

Their own tests need them installed: ``.ci/run`` does that. Here they are only read.
"""

import os
import re
import shutil
import subprocess
import sys
import tomllib

import pytest

from tests.conftest import ROOT

PACKAGES = sorted(path.parent for path in (ROOT / "examples" / "plugins").glob("*/pyproject.toml"))
DOORS = {"tactbench.plugin", "tactbench.plugin.simulation", "tactbench.plugin.devices"}
CONTRACT = ROOT / "examples" / "plugins" / "importlinter.toml"


def linted(*path):
    """Return what import-linter says of the packages on a path."""
    pytest.importorskip("importlinter", reason="import-linter is a tool of development")
    code = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (*path, *PACKAGES, ROOT)))}
    command = [sys.executable, "-c", code, "--config", str(CONTRACT), "--no-cache"]
    return subprocess.run(command, env=env, capture_output=True, text=True, timeout=100, check=False)


def test_they_import_the_doors_alone(tmp_path):
    assert linted().returncode == 0, linted().stdout
    anyskin = next(path for path in PACKAGES if path.name == "anyskin")
    shutil.copytree(anyskin / "tactbench_anyskin", tmp_path / "tactbench_anyskin")
    with (tmp_path / "tactbench_anyskin" / "driver.py").open("a", encoding="utf-8") as file:
        file.write("\n\ndef late():\n    import tactbench.core.errors\n")
    broken = linted(tmp_path)
    assert broken.returncode == 1
    assert "tactbench_anyskin is not allowed to import tactbench.core" in broken.stdout


def test_the_contract_knows_every_package_and_all_of_tactbench():
    with CONTRACT.open("rb") as file:
        linter = tomllib.load(file)["tool"]["importlinter"]
    (contract,) = linter["contracts"]
    assert contract["source_modules"] == [path.name for package in PACKAGES for path in package.glob("tactbench_*")]
    assert linter["root_packages"] == [*contract["source_modules"], "tactbench"]
    rooms = {f"tactbench.{path.parent.name}" for path in (ROOT / "tactbench").glob("*/__init__.py")}
    rooms |= {f"tactbench.plugin.{path.stem}" for path in (ROOT / "tactbench" / "plugin").glob("[!_]*.py")}
    assert set(contract["forbidden_modules"]) == rooms - DOORS | {"tactbench.testing"}


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_its_tests_import_the_doors_and_what_is_for_tests(package):
    text = "".join(path.read_text(encoding="utf-8") for path in (package / "tests").glob("*.py"))
    used = set(re.findall(r"^\s*(?:from|import) (tactbench(?:\.\w+)*)\b", text, re.MULTILINE))
    assert used <= DOORS | {"tactbench.testing"}


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_its_entry_point_names_its_package(package):
    with (package / "pyproject.toml").open("rb") as file:
        (module,) = tomllib.load(file)["project"]["entry-points"]["tactbench"].values()
    assert (package / module / "__init__.py").is_file()
    assert f"`{package.name}`" in (package.parent / "README.md").read_text(encoding="utf-8")
