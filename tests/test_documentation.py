"""Every page is found from the index, every link leads somewhere, and the floors drawn are those that are held."""

import re
import tomllib
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]
PAGES = sorted((CHECKOUT / "docs").rglob("*.md"))


def links(page):
    """Return the files that a page links to."""
    found = re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    return [(page.parent / link).resolve() for link in found if "://" not in link]


@pytest.mark.parametrize("page", [CHECKOUT / "README.md", *PAGES], ids=lambda path: path.name)
def test_every_link_leads_to_a_file(page):
    assert [link for link in links(page) if not link.exists()] == []


def test_every_page_is_in_the_index():
    index = CHECKOUT / "docs" / "index.md"
    listed = {index.resolve(), *links(index)}
    assert [page.name for page in PAGES if page.resolve() not in listed and page.parent.resolve() not in listed] == []
    assert index.resolve() in links(CHECKOUT / "README.md")


def test_the_floors_of_the_core_are_those_that_are_held():
    with (CHECKOUT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    (floors,) = [one["layers"] for one in contracts if one["name"] == "The floors of the core"]
    rooms = [name for floor in floors for name in re.findall(r"\w+", floor)]
    (drawn,) = re.findall(r"```\n(cli\n.*?)```", (CHECKOUT / "docs" / "architecture.md").read_text(), re.DOTALL)
    stated = [re.split(r"\s{2,}", line)[0] for line in drawn.splitlines()]
    assert [name for line in stated for name in line.split(" · ")] == rooms
