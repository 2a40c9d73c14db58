"""Every format shows the same cells: each is read back by a reader of its own and compared with the table."""

import csv
import io
import json
import re

import pytest
from markdown_it import MarkdownIt

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.formats import ALL, grids, rendered, write_tables
from tactbench.core.leaderboard.names import COLUMNS, DEFAULT, SHOWN
from tactbench.core.leaderboard.table import build_table
from tactbench.core.tables.markup import tex

from .rows import hostile_rows, row


def written(shape, rows):
    return rendered(build_table(rows), shape)


def test_json_csv_parquet_and_excel_hold_the_cells_of_the_table():
    openpyxl, parquet = pytest.importorskip("openpyxl"), pytest.importorskip("pyarrow.parquet")
    rows = hostile_rows()
    table = build_table(rows)
    names = [SHOWN[name] for name in COLUMNS]
    lines = [tuple(line.texts.values()) for block in table.blocks for line in block.lines]
    of_json = json.loads(written("json", rows))
    assert [tuple(entry["shown"].items()) for entry in of_json] == [
        tuple(zip(names, one, strict=True)) for one in lines
    ]
    of_csv = list(csv.DictReader(io.StringIO(written("csv", rows).decode(), newline="")))
    assert [tuple(entry[f"shown_{name}"] for name in names) for entry in of_csv] == lines
    of_parquet = parquet.read_table(io.BytesIO(written("parquet", rows))).to_pylist()
    assert [tuple(entry[f"shown_{name}"] for name in names) for entry in of_parquet] == lines
    assert [entry["score"] for entry in of_parquet] == [entry["score"] for entry in of_json]
    header, *sheet = openpyxl.load_workbook(io.BytesIO(written("xlsx", rows))).active.iter_rows(values_only=True)
    assert header == tuple(of_csv[0])
    assert [line[header.index("score")] for line in sheet] == [entry["score"] for entry in of_json]


def test_latex_has_a_column_of_dashes_where_no_answer_is_better_than_the_trivial_one():
    rows = [row(score=2.0), row(estimator="mean", is_baseline=True)]
    lines = written("latex", rows).decode().splitlines()
    assert [line.split(" & ")[0] for line in lines if " & " in line] == ["place", "--", ""]


@pytest.mark.parametrize("view", [DEFAULT, ALL, ("estimator", "score", "cell")])
def test_markdown_shows_the_cells_of_the_table_as_text(view):
    table = build_table(hostile_rows())
    cells, place = [], None
    for token in (
        MarkdownIt("commonmark").enable(["table", "strikethrough"]).parse(rendered(table, "md", view).decode())
    ):
        place = [] if token.type == "tr_open" else place
        if token.type == "tr_close":
            cells.append(place)
            place = None
        elif token.type == "inline" and place is not None:
            assert {child.type for child in token.children} <= {"text"}
            place.append("".join(child.content for child in token.children))
    expected = [one for grid in grids(table, view) for one in (grid.headers, *grid.lines)]
    expected += [one for section in table.sections for one in (section.columns, *section.lines)]
    assert [[" ".join(cell.split()) for cell in line] for line in [*cells]] == [
        [" ".join(cell.split()) for cell in line] for line in expected
    ]


def test_latex_sets_signs_as_they_are_and_names_letters_that_it_lacks_by_number():
    assert tex("50% a_b&ü–中") == r"50\% a\_\allowbreak{}b\&ü--U+4E2D"
    labels = re.findall(
        r"\\label\{(tab:tactbench-[a-z0-9-]+)\}", written("latex", [row(), row(split="trial")]).decode()
    )
    assert labels == ["tab:tactbench-question-1", "tab:tactbench-question-2"]


def test_tables_that_cannot_be_written_are_refused_with_the_folder(tmp_path):
    with pytest.raises(UsageError, match="missing"):
        write_tables(build_table([row()]), tmp_path / "missing")
