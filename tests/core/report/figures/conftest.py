"""One run serves every test that only reads it."""

import shutil

import pytest

from .made import results


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """A result folder nobody may change."""
    return results(tmp_path_factory.mktemp("finished"))


@pytest.fixture
def folder(finished, tmp_path):
    """A result folder of one's own."""
    return shutil.copytree(finished, tmp_path / "results", ignore=shutil.ignore_patterns("report"))
