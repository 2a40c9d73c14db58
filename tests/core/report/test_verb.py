"""`tactbench report`, as a person runs it."""

import pytest

from tests.conftest import Verbs

from .unrendered import unrendered


def test_page_table_and_remarks(results):
    verbs = Verbs(results.parent, here=True)
    with unrendered():
        done = verbs("report")
        verbs("report", "tactbench-results", "--out", "elsewhere")
    assert "iCub" in done.stdout
    assert "Page: tactbench-results/report/index.html" in done.stderr
    assert "Left out: " in done.stderr
    assert list((results / "report" / "figures").glob("*.pdf"))
    page = (results / "report" / "index.html").read_bytes()
    assert page.startswith(b"<!DOCTYPE html>")
    assert (verbs.folder / "elsewhere" / "index.html").read_bytes() == page
    assert not list(results.rglob("*.partial"))


@pytest.mark.parametrize(("words", "says"), [(("nowhere",), "nowhere"), (("--out", "taken"), "--out")])
def test_what_cannot_be_reported_or_written_is_one_sentence(results, words, says):
    (results.parent / "taken").write_text("a file, not a folder")
    refused = Verbs(results.parent, here=True)("report", *words, code=2)
    assert (refused.stdout, refused.stderr[:7]) == ("", "Error: ")
    assert says in refused.stderr
