"""``tactbench docs``: what a screen names can be read where tactbench is installed."""

import re

import pytest

from tactbench.core.cli.docs import installed_pages
from tests.conftest import ROOT


def test_the_list_has_every_page_with_its_title(verbs):
    lines = dict(line.split(maxsplit=1) for line in verbs("docs").stdout.splitlines())
    assert lines["events"] == "Events in time"
    assert set(lines) == set(installed_pages())


@pytest.mark.parametrize("given", ["events", "docs/events.md", "docs/events.md#scores"])
def test_a_page_is_printed_as_it_is_written(verbs, given):
    assert verbs("docs", given).stdout == (ROOT / "docs" / "events.md").read_text(encoding="utf-8")


def test_a_page_that_is_not_there_is_named(verbs):
    assert "Did you mean 'events'" in verbs("docs", "event", code=2).stderr


def test_every_page_that_the_program_names_is_one_and_they_travel_in_the_wheel():
    named = {
        name
        for path in (ROOT / "tactbench").rglob("*.py")
        for name in re.findall(r"docs/([\w/-]+)\.md", path.read_text(encoding="utf-8"))
    }
    assert len(named) > 10
    assert named <= set(installed_pages())
    assert '"docs" = "tactbench/docs"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
