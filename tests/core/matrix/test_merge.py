"""Merging: the same cells in whatever order, however often; contradictions are refused and change nothing."""

import json
import shutil
from pathlib import Path

import pytest

from tactbench.core.errors import FolderError
from tactbench.core.matrix.merge import merge
from tactbench.core.matrix.store import Store

from .made import SECTIONS, answers, kept, key, record


def tree(folder: Path) -> dict[str, bytes]:
    """Return every file with its bytes, but for the index."""
    paths = (path for path in sorted(folder.rglob("*")) if path.is_file() and not path.name.startswith("results.sql"))
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def holding(folder: Path, cell: str, *given, **more) -> Path:
    with Store(folder).hold() as store:
        kept(store, cell, *given, **more)
    return folder


FOLDERS = {
    "a": [("c0", "done", 1.0, 0.5), ("c1", "failed", None, None)],
    "b": [("c0", "done", 1.0 + 1e-12, 2.0), ("c1", "done", 1.0, 0.5), ("c2", "timeout", None, None)],
    "c": [("c1", "skipped", None, None), ("c2", "failed", None, None), ("c3", "done", 1.0, 2.0)],
}
"""By host: cell, status, score and time to fit."""


def test_order_grouping_and_repetition_change_nothing(tmp_path):
    for host, ends in FOLDERS.items():
        with Store(tmp_path / host).hold() as store:
            store.begin({"host": host})
            for cell, status, score, fit_s in ends:
                kept(store, cell, status, score, host=host, fit_s=fit_s)
    a, b, c = folders = [tmp_path / host for host in FOLDERS]
    before = [tree(folder) for folder in folders]

    def union(*some):
        out = tmp_path / f"out{len(list(tmp_path.iterdir()))}"
        rows = merge(some, out).rows
        assert {one["cell"]: one for one in rows} == {one["cell"]: one for one in Store(out).rows()}
        return out

    whole = union(a, b, c)
    for other in (union(union(a, b), c), union(c, a, a, b), union(whole, whole)):
        assert tree(other) == tree(whole)
    assert [tree(folder) for folder in folders] == before
    found = {one["cell"]: one for one in Store(whole).rows()}
    every = [one for folder in folders for one in Store(folder).rows()]
    assert all(one in every for one in found.values()), "whole: times of two hosts are not mixed"
    ends = {name: (one["status"], one["host"]) for name, one in found.items()}
    assert ends == {"c0": ("done", "a"), "c1": ("done", "b"), "c2": ("failed", "c"), "c3": ("done", "c")}
    assert {one["cell"] for one in found.values() if Store(whole).answers(one["key"])} == {"c0", "c1", "c3"}


def refused(tmp_path, *folders) -> str:
    before = [tree(folder) for folder in folders]
    with pytest.raises(FolderError) as error:
        merge(folders, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir() if "out" in path.name] == []
    assert [tree(folder) for folder in folders] == before
    return str(error.value)


@pytest.mark.parametrize(
    ("one", "other", "differs"),
    [
        ({"score": 2.0, "key": key(1)}, {"score": 2.0 * (1 + 1e-10), "key": key(2)}, None),  # its data differ in a bit
        ({"score": 2.0}, {"score": 2.0 * (1 + 1e-8)}, "score 2.0"),
        ({"fit_s": 1.0, "peak_rss_mb": 90.0}, {"fit_s": 7.0, "peak_rss_mb": 80.0}, None),
        ({"sections": {**SECTIONS, "versions": {"numpy": "1.26"}}}, {}, "versions: numpy"),
        ({"sections": {**SECTIONS, "data": {"s": "other"}}}, {}, None),
    ],
)
def test_two_finished_cells_of_one_name_agree_or_are_refused(tmp_path, one, other, differs):
    folders = [holding(tmp_path / "one", "a", host="aa", **one), holding(tmp_path / "two", "a", host="bb", **other)]
    folders.append(holding(tmp_path / "other", "b"))
    if differs is None:
        found = {row["cell"]: row for row in merge(folders, tmp_path / "out").rows}
        assert (len(found), found["a"]["host"]) == (2, "aa")
        return
    said = refused(tmp_path, *folders)
    assert f"a in {folders[0]} and in {folders[1]}" in said
    assert differs in said


def test_many_contradictions_are_counted(tmp_path):
    for name, score in (("one", 1.0), ("two", 2.0)):
        with Store(tmp_path / name).hold() as store:
            for place in range(11):
                kept(store, f"c{place:02}", score=score)
    said = refused(tmp_path, tmp_path / "one", tmp_path / "two")
    assert said.count("score 1.0 -> 2.0; ") == 10
    assert "; and 1 more" in said


def test_recordings_come_along_and_damaged_cells_are_told(tmp_path):
    folder = tmp_path / "one"
    path = record(folder / "recordings" / "made" / "scene.h5")
    holding(folder, "a", recordings=["recordings/made/scene.h5", "/elsewhere/b.h5"])
    shutil.copytree(holding(folder, "b"), tmp_path / "two")
    damaged = tmp_path / "two" / "cells" / f"{key('b')}.h5"
    damaged.write_bytes(damaged.read_bytes()[:-1])
    merged = merge([tmp_path / "two", folder], tmp_path / "out")
    assert (len(merged.rows), merged.recordings) == (2, 1)
    assert damaged.name in merged.left_out[0]
    assert (tmp_path / "out" / "recordings" / "made" / "scene.h5").read_bytes() == path.read_bytes()
    assert Store(tmp_path / "out").answers(key("a"))["test"].y_pred.tobytes() == answers(3).y_pred.tobytes()


def test_what_stands_in_the_way_is_named_and_nothing_is_left(tmp_path):
    (tmp_path / "empty").mkdir()
    assert "results" in refused(tmp_path, tmp_path / "empty")
    folder = holding(tmp_path / "one", "a")

    def fails(_):
        raise OSError(28, "No space left on device")

    with pytest.raises(FolderError, match="full"):
        merge([folder], tmp_path / "out", also=fails)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "one"]
    with pytest.raises(FolderError, match="exists already"):
        merge([tmp_path / "empty"], folder)


def test_the_verb_writes_the_tables_that_leaderboard_shows(verbs):
    for seed, name in ((1, "one"), (2, "two")):
        holding(verbs.folder / name, f"icub/force/twin/karl2016/mean/{seed}", seed=seed)
    assert verbs("merge", "one", "two", "--out", "both").stdout == "both\n"
    written = (verbs.folder / "both" / "leaderboard.json").read_text()
    (line,) = json.loads(written)
    assert (line["n_replicates"], line["repeats"]) == (2, 2)
    assert verbs("leaderboard", "both", "--format", "json").stdout == written
