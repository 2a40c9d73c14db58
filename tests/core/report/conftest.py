"""One run for all tests of the report."""

import pytest

from tests.conftest import Shell

from .results import make_results


@pytest.fixture(scope="session")
def results(tmp_path_factory):
    """A result folder with finished and skipped cells of three tasks."""
    return make_results(Shell(tmp_path_factory.mktemp("results")))
