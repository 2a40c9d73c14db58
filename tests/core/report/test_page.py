"""The page, from real results."""

import re
from dataclasses import replace

import pytest

from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.report import results as sections
from tactbench.core.report.page import answers_section, make_page
from tactbench.core.report.results import Results, open_results, recording_scores

from .html import Reader
from .results import draw_one

STRUCTURE = """\
What came out
Leaderboard [1 filter]
  Curvature: which of five spherical caps touches the sensor?: sensor estimator macro F1 delay after touch training
  Force: how large is the normal force?: sensor estimator true RMSE [N] RMSE [N] published delay after touch training
  Grasp-stability: will the object slip when it is lifted?: sensor estimator accuracy reason
Published numbers
  Published numbers, and ours: number published ours ours − published verdict
Figures [1 figure]
Sensors (the paper's Table I)
  Sensor comparison:  iCub fingertip iCub fingertip: source
Details of each cell [10 cells]
Made by
"""


@pytest.fixture(scope="module")
def material(results):
    return open_results(Store(results), load_registry())


@pytest.fixture
def subject(material, tmp_path):
    return replace(material, drawn=(draw_one(material, tmp_path),))


def with_rows(material, *rows):
    return Results(material.store, material.registry, rows)


def structure(html):
    """Return what the page is made of: sections, what is in them, and the columns of their tables."""
    lines = []
    for part in re.findall(r"<section.*?</section>", html, flags=re.S):
        own = part.partition('<details class="cell')[0]
        counts = {"figure": part.count("<figure>"), "cells": part.count('<details class="cell')}
        counts["filter"] = part.count('id="filter"')
        listed = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
        lines.append(re.search("<h2.*?>(.*?)</h2>", part)[1] + (f" [{listed}]" if listed else ""))
        for title, head in re.findall(r'<p class="caption">(.*?)</p>.*?<thead>(.*?)</thead>', own, flags=re.S):
            lines.append(f"  {title.partition(' <span')[0]}: {' '.join(re.findall(r'<th[^>]*>(.*?)</th>', head))}")
    return "\n".join(lines).replace("&#39;", "'") + "\n"


def test_the_structure_of_the_page(subject):
    assert structure(make_page(subject).html) == STRUCTURE


def test_the_first_section_has_a_sentence_of_each_block(material):
    again = [row | {"split": "press", "cell": f"{row['cell']} by press"} for row in material.rows]
    subject = with_rows(material, *material.rows, *again)
    blocks = [block for block in subject.leaderboard.blocks if block.verdict]
    said = [one for one in answers_section(subject).paragraphs if one.endswith(tuple(one.verdict[0] for one in blocks))]
    assert len(set(said)) == len(blocks) == 4


def test_the_page_is_well_formed_fetches_nothing_and_is_the_same_bytes_again(subject, results):
    html = make_page(subject).html
    page = Reader(html)
    assert page.wrong == []
    assert all(given.get("alt") for tag, given in page.elements if tag == "img")
    loaded = [given.get("src") or given.get("href") for tag, given in page.elements if tag != "a"]
    assert all(what.startswith("data:") for what in loaded if what)
    (policy,) = [given["content"] for _, given in page.elements if given.get("http-equiv")]
    assert policy.startswith("default-src 'none'")
    again = replace(open_results(Store(results), load_registry()), drawn=subject.drawn)
    assert make_page(again).html == html


def test_everything_that_a_row_knows_is_on_the_page(material):
    rows = [*material.rows, {**material.rows[0], "cell": "another", "novelty": "seen", "novel_table": {"depth": 3.25},
                             "novel_list": ["first", "second"]}]  # fmt: skip
    text = Reader(make_page(with_rows(material, *rows)).html).text
    for row in rows:
        for name, value in row.items():
            assert name in text or value in (None, "", [], {}) or name in ("confusion", "digests")
        told = [*row["scores"], *row["counts"], *row["chosen"], *row["assumptions"], *row["recordings"], *row["params"]]
        told += [reason for one in row["plan"] for reason in (one["effect"], one["reason"])]
        assert [what for what in told if " ".join(what.split()) not in text] == []
    assert all(told in text for told in ("seen", "3.25", "second"))
    assert "{'" not in text


def test_a_large_board_has_no_details_and_names_the_command(material, monkeypatch):
    monkeypatch.setattr(sections, "MOST_CELLS", 6)
    html = make_page(replace(material)).html
    assert html.count('<details class="cell') == 0
    assert Reader(html).wrong == []


def test_scores_of_folds_and_recordings(material):
    text = Reader(make_page(material).html).text
    assert "fold roles: " in text
    curvature = next(one for one in material.rows if one["task"] == "curvature" and one["estimator"] == "forest")
    found = recording_scores(curvature, material.answers(curvature)["test"])
    right = sum(one["test rows"] * one["score"] for one in found) / curvature["n_test"]
    assert (len(found), right) == (5, pytest.approx(curvature["scores"]["accuracy"], rel=1e-12))


def test_a_section_that_cannot_be_made_takes_no_other_with_it(material):
    page = make_page(with_rows(material, {**material.rows[0], "confusion": 3}))
    assert len(page.broken) == 1
    assert page.broken[0].startswith("Details")
    assert structure(page.html).count("[") >= 1
