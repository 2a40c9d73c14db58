"""The page on checks names them all."""

import runpy

from tests.conftest import ROOT


def test_the_table_of_checks_is_up_to_date():
    page = runpy.run_path(str(ROOT / "docs" / "conformance_checks.py"))
    assert (ROOT / "docs" / "conformance.md").read_text(encoding="utf-8") == page["document"]()
