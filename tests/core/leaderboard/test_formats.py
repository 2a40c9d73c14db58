"""Every format shows the same cells: each is read back by a reader of its own and compared with the table."""

import csv
import io
import json
import re
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from rich.cells import cell_len

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.columns import SHOWN
from tactbench.core.leaderboard.formats import csv_text, latex, markdown, plain_text
from tactbench.core.leaderboard.records import JSON_KEYS, OF_REPLICATES, OF_THE_MACHINE, RANK_KEYS
from tactbench.core.leaderboard.table import build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, WHOLE, View, grids
from tactbench.core.tables.csv_text import guarded
from tests.core.leaderboard.rendering import to_csv, to_json, to_latex, to_markdown, to_parquet

from .rows import row
from .strategies import HOSTILE, some_rows, texts
from .tex import as_set, untex

many = settings(max_examples=60)
either = st.booleans()
views = st.sampled_from((DEFAULT_VIEW, WHOLE, View(columns=("estimator", "score", "cell"))))


def lines_of(table):
    return [tuple(line.texts.values()) for block in table.blocks for line in block.lines]


def one_spaced(cells):
    return [" ".join(cell.split()) for cell in cells]


@many
@given(some_rows(), either)
def test_json_and_csv_show_the_cells_of_the_table(rows, times):
    table = build_table(rows, times=times)
    names = [SHOWN[name] for name in table.columns]
    of_json = json.loads(to_json(rows, times=times).encode())
    assert [list(entry["shown"]) for entry in of_json] == [names] * len(rows)
    assert [tuple(entry["shown"].values()) for entry in of_json] == lines_of(table)
    assert [entry["cell"] for entry in of_json] == [one["cell"] for one in table.rows]
    of_csv = list(csv.DictReader(io.StringIO(to_csv(rows, times=times).encode().decode(), newline="")))
    shown = [[entry[f"shown_{name}"] for name in names] for entry in of_csv]
    assert shown == [list(map(guarded, one)) for one in lines_of(table)]
    for entry, one in zip(of_csv, table.rows, strict=True):
        assert entry["score"] == ("" if one["score"] is None else str(one["score"]))
        assert json.loads(entry["params"]) == one["params"]


@many
@given(some_rows(), either)
def test_parquet_shows_the_cells_of_the_table_and_keeps_types(rows, times):
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = build_table(rows, times=times)
    read = pq.read_table(io.BytesIO(to_parquet(rows, [{"host": "one"}], times=times)))
    shown = [f"shown_{SHOWN[name]}" for name in table.columns]
    assert list(zip(*(read[name].to_pylist() for name in shown), strict=True)) == lines_of(table)
    assert read["score"].to_pylist() == [one["score"] for one in table.rows]
    types = {field.name: field.type for field in read.schema}
    assert (types["score"], types["seed"], types["dagger"], types["sensor"]) == (
        pa.float64(), pa.int64(), pa.bool_(), pa.string(),
    )  # fmt: skip
    assert [json.loads(text) for text in read["params"].to_pylist()] == [one["params"] for one in table.rows]
    assert read.schema.metadata[b"tactbench.format_version"] == b"1"
    assert json.loads(read.schema.metadata[b"tactbench.provenance"]) == ([{"host": "one"}] if times else [])


@many
@given(some_rows(), either, views)
def test_markdown_shows_the_cells_of_the_table_as_text(rows, times, view):
    table = build_table(rows, times=times)
    tokens = MarkdownIt("commonmark").enable(["table", "strikethrough"]).parse(markdown(table, view))
    allowed = {"inline", "text", "code_inline"} | {
        f"{kind}_{edge}"
        for kind in ("heading", "table", "thead", "tbody", "tr", "th", "td", "bullet_list", "list_item", "paragraph")
        for edge in ("open", "close")
    }
    assert {token.type for token in tokens} | {c.type for t in tokens for c in t.children or ()} <= allowed
    cells, place = [], None
    for token in tokens:
        place = [] if token.type == "tr_open" else place
        if token.type == "tr_close":
            cells.append(place)
            place = None
        elif token.type == "inline" and place is not None:
            assert {child.type for child in token.children} <= {"text"}
            place.append("".join(child.content for child in token.children))
    expected = [list(one) for grid in grids(table, view) for one in (grid.headers, *grid.lines)]
    expected += [list(one) for section in table.sections for one in (section.columns, *section.lines)]
    assert [one_spaced(line) for line in cells] == [one_spaced(line) for line in expected]


def lines_set(text):
    """Return the cells that a text of LaTeX sets, one list a table of its lines."""
    found = []
    for body in re.findall(r"\\toprule\n(.*?)\\bottomrule", text, re.DOTALL):
        found.append([])
        for line in body.splitlines():
            if line != r"\midrule":
                assert line.endswith(r" \\")
                found[-1].append([untex(cell) for cell in line.removesuffix(r" \\").split(" & ")])
    return found


@many
@given(some_rows(), either)
def test_latex_sets_the_cells_of_the_table_whatever_names_are_made_of(rows, times):
    table = build_table(rows, times=times)
    text = latex(table)
    for grid, lines in zip(grids(table), lines_set(text), strict=False):
        for line, cells in zip(grid.lines, lines[-len(grid.lines) :], strict=True):
            shown = [as_set(line[grid.columns.index(name)]) for name in ("estimator", "score") if name in grid.columns]
            assert {one for one in one_spaced(shown) if one} <= set(one_spaced(cells))
    for said in re.findall(r"\\caption\{(.*)\}$|\\raggedright (.*)$", text, re.MULTILINE):
        untex("".join(said))
    labels = re.findall(r"\\label\{(tab:tactbench-[a-z0-9-]+)\}", text)
    assert len(labels) == len(set(labels)) == len(table.blocks) + len(table.sections)
    assert "tactbench why" not in text


@many
@given(some_rows(), either, views)
def test_a_terminal_shows_the_cells_of_the_table(rows, times, view):
    table = build_table(rows, times=times)
    # On a screen of any width texts are broken and columns may be left out: here none is.
    lines = [" ".join(line.split()) for line in plain_text(table, 100_000, view).splitlines()]
    for grid in grids(table, view):
        for line in grid.lines:
            assert " ".join(" ".join(line).split()) in lines


@many
@given(some_rows(), st.sampled_from((80, 100, 140)), views)
def test_no_number_is_broken_and_no_word_where_there_is_room(rows, width, view):
    table = build_table(rows)
    text = plain_text(table, width, view)
    gone = " ".join(text.partition("Too narrow for: ")[2].split())
    for grid in grids(table, view):
        for column, *cells in zip(grid.headers, *grid.lines, strict=True):
            parts = cells if column in grid.numeric else [word for one in cells for word in one.split()]
            if column not in gone and not view.columns and max(map(cell_len, [*parts, ""])) < 12:
                assert [part for part in parts if part not in text] == []


@given(texts)
def test_a_formula_is_text_for_a_spreadsheet(text):
    assert guarded(text) in (text, f"'{text}")
    assert not re.match(r"[=+\-@]", guarded(text)) or re.fullmatch(r"[-+]?[0-9.]+(e[-+]?[0-9]+)?", text, re.IGNORECASE)


def test_no_cell_of_csv_is_a_formula_but_negative_numbers_stay_numbers():
    rows = [row(score=-0.25, metric="r2", unit="1", reason="=cmd()")]
    (entry,) = csv.DictReader(io.StringIO(csv_text(build_table(rows)), newline=""))
    assert (entry["score"], entry["shown_score"], entry["reason"]) == ("-0.25", "-0.250", "'=cmd()")


@pytest.mark.parametrize("name", HOSTILE)
def test_nothing_in_a_name_acts_on_a_terminal_in_any_format(name):
    rows = [row(name, name, reason=name, status=status, score=score, stamps=[name], published=1.0,
                published_reference=name, ci_method=name, remarks=[name])
            for status, score in (("done", 0.5), ("failed", None))]  # fmt: skip
    rows[0]["cell"], rows[1]["cell"] = name, f"{name} 2"
    for text in (to_json(rows), to_csv(rows), to_markdown(rows), to_latex(rows), plain_text(build_table(rows))):
        assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]", text)


def test_numbers_that_are_none_are_null_in_json_and_told_in_the_table():
    text = to_json([row(score=float("nan"), fit_s=float("inf"))])
    (entry,) = json.loads(text, parse_constant=pytest.fail)
    assert entry["score"] is None
    assert entry["shown"]["score"] == "nan"


def test_without_times_nothing_is_left_that_a_machine_decides():
    here = row(host="here", concurrency=4, fit_s=1.0, made_by="x", wall_s=2.0, peak_rss_mb=1.0, threads=2, key="k")
    there = here | {
        "host": "there", "concurrency": 1, "fit_s": 2.0, "made_by": "y", "wall_s": 3.0, "peak_rss_mb": 2.0,
        "threads": 1,
        "key": "l", "search": [{"fit_s": 1.0}], "recordings": ["elsewhere"], "sim_s": 1.0, "search_s": 1.0,
        "predict_s": 2.0, "batch_rows": 2, "latency_ms_p50": 1.0, "latency_ms_p95": 2.0, "latency_ms_max": 2.0,
        "latency_n": 3, "answer_delay_ms": 4.0, "delay_parts_ms": {"prediction": 1.0},
        "events": {"onset latency p50 ms": 1.0}, "operating_points": [{"bound": 1.0}],
    }  # fmt: skip
    assert {key for key in JSON_KEYS if here.get(key) != there.get(key)} == OF_THE_MACHINE
    machine = [{"host": "here", "cpu": "fast", "cores": 1}], [{"host": "there", "cpu": "slow", "cores": 2}]
    for form in (to_json, to_csv, to_markdown, to_latex, to_parquet):
        texts = [form([one], known, times=False) for one, known in zip((here, there), machine, strict=True)]
        assert texts[0] == texts[1]
        assert form([here]) != form([there])
    assert (
        set(json.loads(to_json([here], times=False))[0])
        == {*JSON_KEYS, *OF_REPLICATES, *RANK_KEYS, "shown"} - OF_THE_MACHINE
    )


def test_parquet_without_pyarrow_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UsageError, match=r"pip install 'tactbench\[parquet\]'"):
        to_parquet([row()])


def test_a_number_that_64_bits_cannot_hold_is_no_traceback():
    with pytest.raises(UsageError, match="do not fit Parquet"):
        to_parquet([row(seed=2**70)])
