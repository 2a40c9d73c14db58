"""The packages of examples/plugins: they stand on the doors alone.

Their own tests need them installed: ``.ci/run`` does that. Here they are only read.
"""

import re
import tomllib

import pytest

from tests.conftest import ROOT

PACKAGES = sorted(path.parent for path in (ROOT / "examples" / "plugins").glob("*/pyproject.toml"))
DOORS = {"tactbench.plugin", "tactbench.plugin.simulation", "tactbench.plugin.devices"}
CONTRACT = ROOT / "examples" / "plugins" / "importlinter.toml"


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
