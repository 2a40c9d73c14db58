"""One run serves every test that only reads it."""

import shutil

import pytest

from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.figures.group import groups
from tactbench.core.report.results import open_results
from tests.core.report.results import make_results


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """A result folder of two sensors that nobody may change."""
    return make_results(tmp_path_factory.mktemp("finished") / "results", "icub", "ideal")


@pytest.fixture
def folder(finished, tmp_path):
    """A result folder of one's own."""
    return shutil.copytree(finished, tmp_path / "results")


def opened(folder):
    return open_results(Store(folder), load_registry())


def group_of(folder, task):
    (found,) = [group for group in groups(opened(folder), [].append) if group.task.name == task]
    return found
