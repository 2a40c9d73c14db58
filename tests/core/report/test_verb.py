"""`tactbench report`, as a person runs it."""

import pytest

from tests.conftest import Verbs

from .unrendered import unrendered


@pytest.fixture(scope="module")
def reported(results):
    verbs = Verbs(results.parent, here=True)
    with unrendered():
        return verbs, verbs("report")


def test_page_on_disk_table_on_stdout_the_rest_on_stderr(reported, results):
    _, done = reported
    assert "iCub" in done.stdout
    assert "Page: tactbench-results/report/index.html" in done.stderr
    assert "Left out: " in done.stderr
    assert list((results / "report" / "figures").glob("*.pdf"))
    assert (results / "report" / "index.html").read_text().startswith("<!DOCTYPE html>")
    assert not list(results.rglob("*.partial"))


def test_the_same_page_in_another_folder(reported, results):
    verbs, _ = reported
    with unrendered():
        verbs("report", "tactbench-results", "--out", "elsewhere")
    page = (verbs.folder / "elsewhere" / "index.html").read_bytes()
    assert page == (results / "report" / "index.html").read_bytes()


def test_what_cannot_be_reported_or_written_is_one_sentence_with_the_next_step(reported):
    verbs, _ = reported
    (verbs.folder / "taken").write_text("a file, not a folder")
    for words, says in (("nowhere",), "There are no results in nowhere"), (("--out", "taken"), "--out"):
        refused = verbs("report", *words, code=2)
        assert (refused.stdout, refused.stderr[:7]) == ("", "Error: ")
        assert says in refused.stderr
