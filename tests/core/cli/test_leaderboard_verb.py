"""The verb ``leaderboard``: a result folder as a table, in any format, from anybody."""

import csv
import io
import json
import os
import pty
import subprocess
import sys

import pytest

RUN = ("run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "lasso", "--out", "out")


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    from tests.conftest import Shell

    shell = Shell(tmp_path_factory.mktemp("ran"))
    shell(*RUN)
    return shell


def test_a_folder_shows_the_same_table_as_its_run(ran):
    again = ran(*RUN, "--format", "json").stdout
    assert ran("leaderboard", "out", "--format", "json").stdout == again
    assert json.loads(again) == json.loads((ran.folder / "out" / "leaderboard.json").read_text())


def test_what_was_just_computed_and_what_is_read_again_have_one_digest(shell):
    shell(*RUN)
    kept = [shell.folder / "out" / "cache" / name for name in ("ranks.json", "tables.json")]
    before = [path.read_bytes() for path in kept]
    shell(*RUN)
    assert [path.read_bytes() for path in kept] == before


def test_every_format_goes_to_a_file_named_for_it(ran):
    for suffix, shape in (
        (".md", "md"),
        (".csv", "csv"),
        (".json", "json"),
        (".tex", "latex"),
        (".html", "html"),
        (".txt", "table"),
    ):
        ran("leaderboard", "out", "--to", f"table{suffix}")
        assert (ran.folder / f"table{suffix}").read_text() == ran("leaderboard", "out", "--format", shape).stdout
    refused = ran("leaderboard", "out", "--to", "nowhere/table.md", code=2)
    assert "nowhere/table.md cannot be written" in refused.stderr


def test_parquet_goes_to_a_file_and_into_a_pipe(ran):
    import pyarrow.parquet as pq

    ran("leaderboard", "out", "--to", "table.parquet")
    read = pq.read_table(ran.folder / "table.parquet")
    rows = json.loads(ran("leaderboard", "out", "--format", "json").stdout)
    assert read["cell"].to_pylist() == [row["cell"] for row in rows]
    assert read["score"].to_pylist() == [row["score"] for row in rows]
    assert read["shown_score"].to_pylist() == [row["shown"]["score"] for row in rows]
    piped = subprocess.run(
        [sys.executable, "-m", "tactbench", "leaderboard", "out", "--format", "parquet"],
        cwd=ran.folder, capture_output=True, check=True,
    )  # fmt: skip
    assert piped.stdout == (ran.folder / "table.parquet").read_bytes()


def test_parquet_is_not_written_to_a_terminal(ran):
    ours, theirs = pty.openpty()
    try:
        done = subprocess.run(
            [sys.executable, "-m", "tactbench", "leaderboard", "out", "--format", "parquet"],
            cwd=ran.folder, stdout=theirs, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    finally:
        os.close(theirs)
        os.close(ours)
    assert done.returncode == 2
    assert "--to leaderboard.parquet" in done.stderr


def test_without_times_two_runs_give_the_same_bytes(ran, shell):
    shell(*RUN, "--jobs", "2")
    for shape in ("table", "md", "csv", "json", "latex"):
        here, there = (one("leaderboard", "out", "--no-times", "--format", shape).stdout for one in (ran, shell))
        assert here == there
    with_times = list(csv.DictReader(io.StringIO(ran("leaderboard", "out", "--format", "csv").stdout)))
    without = list(csv.DictReader(io.StringIO(ran("leaderboard", "out", "--no-times", "--format", "csv").stdout)))
    assert [row["score"] for row in without] == [row["score"] for row in with_times]
    assert "fit_s" in with_times[0]
    assert "fit_s" not in without[0]


@pytest.mark.parametrize("content", [None, "", "{}", "not a folder"])
def test_what_is_no_result_folder_is_told_in_a_sentence(shell, content):
    place = shell.folder / "there"
    if content == "not a folder":
        place.write_text("x")
    elif content is not None:
        place.mkdir()
        (place / "index.jsonl").write_text(content)
    refused = shell("leaderboard", "there", code=2)
    assert "Traceback" not in refused.stderr
    assert "tactbench run" in refused.stderr
    assert not (shell.folder / "there" / "recordings").exists()


def test_the_page_has_no_form_without_times(ran):
    assert "Use another --format" in ran("leaderboard", "out", "--format", "html", "--no-times", code=2).stderr


def test_a_comparison_is_not_written_to_files(ran):
    assert "--to" in ran("leaderboard", "out", "--compare", "split", "--to", "x.md", code=2).stderr
