"""Tables to import."""

import pytest

from .made import Tables


@pytest.fixture
def tables(tmp_path):
    return Tables(tmp_path)
