"""One run for all tests of the report."""

import pytest

from .results import make_results


@pytest.fixture(scope="session")
def results(tmp_path_factory):
    """A result folder with finished and skipped cells of three tasks."""
    return make_results(tmp_path_factory.mktemp("results") / "tactbench-results", "icub")
