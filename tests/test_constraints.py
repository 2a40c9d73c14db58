"""The versions with which the lowest of each dependency is tested."""

from __future__ import annotations

import tomllib

from packaging.requirements import Requirement
from packaging.version import Version

from tests.conftest import ROOT


def test_the_lowest_versions_are_those_that_the_package_allows():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    allowed = {one.name: one.specifier for one in map(Requirement, project["dependencies"])}
    lines = (ROOT / "constraints-lowest.txt").read_text().splitlines()
    pinned = {one.name: one.specifier for one in (Requirement(line) for line in lines if not line.startswith("#"))}
    assert pinned.keys() == allowed.keys()
    for name, pin in pinned.items():
        (exact,), (lowest,) = pin, allowed[name]
        assert (exact.operator, lowest.operator) == ("==", ">=")
        assert Version(exact.version) == Version(lowest.version), name
