"""Merging: the same bytes in whatever order, however often; contradictions are refused and leave nothing."""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.errors import FolderError
from tactbench.core.leaderboard.levels import OTHER_VERSION, write_level
from tactbench.core.matrix.key_book import Entry, book_of
from tactbench.core.matrix.keys import Fixed
from tactbench.core.matrix.merge import merge
from tactbench.core.matrix.store import Store
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import Block, ChannelSpec, SensorSpec, Source, StreamSpec

from .store.made import PLAN, answers, done, ended, key

HOSTS = ("aa", "bb", "cc")
MEMORY = "/dev/shm" if Path("/dev/shm").is_dir() else None
"""Hundreds of folders are made and synced: a disk that spins would take minutes."""


def tree(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def record(path: Path, reading: float = 1.0, seconds: float = 0.5) -> Path:
    """Write a small recording; how long it took is no part of its content."""
    stream = StreamSpec(name="taxels", channels=(ChannelSpec(name="t", kind="taxel"),))
    sensor = SensorSpec(name="made", title="Made", principle="none", streams=(stream,),
                        principle_source=Source(tag="assumed", reference="a test"))  # fmt: skip
    about = RecordingMeta(name="scene", sensor=sensor, rig="made", simulated=True, role="train", session="s",
                          provenance={"sim_s": seconds})  # fmt: skip
    with RecordingWriter(path, about) as writer:
        writer.append(Block("taxels", np.arange(5, dtype=np.int64), np.full((5, 1), reading)))
    return path


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """The same content as three hosts recorded it, in other bytes."""
    folder = tmp_path_factory.mktemp("shelf")
    return {host: record(folder / f"{host}.h5", seconds=place) for place, host in enumerate(HOSTS)}


cells = st.sampled_from([f"c{number}" for number in range(5)])
lines = st.one_of(
    st.tuples(st.just("done"), cells, st.floats(0, 9), st.sampled_from([1, 3])),
    st.tuples(st.sampled_from(["failed", "skipped", "timeout"]), cells, st.sampled_from(["x", "y"]), st.none()),
)
results = st.tuples(st.sampled_from(HOSTS), st.lists(lines, min_size=1, max_size=6), st.booleans())
"""A host, what its cells ended as, in this order, and whether it has the recording."""


def make(folder: Path, result, recordings, contradicting: bool) -> Path:
    host, told, recorded = result
    with Store(folder).hold() as store:
        store.begin({"cpu": host})
        for status, cell, value, repeats in told:
            if status == "done":
                # What a seed decides follows from the key; times, and how many repeats there are, do not.
                name = (cell, value) if contradicting else cell
                row = done(cell, float(len(cell)), host=host, fit_s=value, plan=PLAN, repeat=1, repeats=repeats)
                store.keep(key(name), row, {"test": answers(3)})
            else:
                store.note(ended(cell, status, reason=value, host=host, plan=PLAN))
    if recorded:
        (folder / "recordings" / "made").mkdir()
        shutil.copy(recordings[host], folder / "recordings" / "made" / "scene.h5")
    return folder


def union(root: Path, name: str, *folders: Path) -> Path | None:
    """Return the merged folder, or None where the folders contradict each other."""
    if any(folder is None for folder in folders):
        return None
    try:
        merge(folders, root / name)
    except FolderError as error:
        told = str(error)
    else:
        return root / name
    assert "contradict each other" in told
    assert not any(name in path.name for path in root.iterdir())
    return None


def same(one: Path | None, other: Path | None) -> bool:
    return one is other if one is None or other is None else tree(one) == tree(other)


@settings(max_examples=30)
@given(st.lists(results, min_size=3, max_size=3), st.booleans())
def test_order_and_repetition_change_no_byte(recordings, three, contradicting):
    with tempfile.TemporaryDirectory(dir=MEMORY) as made:
        root = Path(made)
        a, b, c = (make(root / f"in{n}", one, recordings, contradicting) for n, one in enumerate(three))
        before = [tree(folder) for folder in (a, b, c)]
        ab, ba, bc = union(root, "ab", a, b), union(root, "ba", b, a), union(root, "bc", b, c)
        assert same(ab, ba)
        assert same(union(root, "aab", a, a, b), ab)
        assert same(union(root, "abab", ab, ab), ab)
        whole = union(root, "abc", a, b, c)
        assert same(union(root, "ab_c", ab, c), whole)
        assert same(union(root, "a_bc", a, bc), whole)
        assert same(union(root, "c_b_a", c, b, a), whole)
        assert [tree(folder) for folder in (a, b, c)] == before
        if whole is None:
            return
        names = {row["cell"] for folder in (a, b, c) for row in Store(folder).rows()}
        finished = {row["cell"] for folder in (a, b, c) for row in Store(folder).rows() if row["status"] == "done"}
        rows = {row["cell"]: row for row in Store(whole).rows()}
        assert set(rows) == names
        assert {name for name, row in rows.items() if row["status"] == "done"} == finished
        for name in finished:
            assert len(Store(whole).answers(rows[name]["key"])["test"]) == 3
        assert (whole / "recordings" / "made" / "scene.h5").exists() == any(one[2] for one in three)


def kept(folder: Path, cell: str, score: float, *, name: object = None, host: str = "aa", **more) -> Path:
    Store(folder).keep(key(name or cell), done(cell, score, host=host, **more), {"test": answers(3)})
    return folder


def refused(tmp_path, *folders) -> str:
    with pytest.raises(FolderError) as error:
        merge(folders, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir() if "out" in path.name] == []
    return str(error.value)


def test_two_scores_of_one_key_are_refused_naming_cell_and_folders(tmp_path):
    one, two = kept(tmp_path / "one", "a", 1.0), kept(tmp_path / "two", "a", 1.5)
    said = refused(tmp_path, kept(tmp_path / "other", "b", 3.0), one, two)
    for told in ("'a'", "'score'", "1.0", "1.5", str(one), str(two)):
        assert told in said


def test_one_name_with_other_data_is_refused(tmp_path):
    said = refused(tmp_path, kept(tmp_path / "one", "a", 1.0), kept(tmp_path / "two", "a", 1.0, name="other"))
    assert "'a' is of other code, data or versions" in said


def test_times_of_two_hosts_are_never_mixed(tmp_path):
    one = kept(tmp_path / "one", "a", 1.0, host="bb", fit_s=1.0, predict_s=10.0)
    two = kept(tmp_path / "two", "a", 1.0, host="aa", fit_s=2.0, predict_s=5.0)
    (row,) = merge([one, two], tmp_path / "out").rows
    assert (row["host"], row["fit_s"], row["predict_s"]) == ("aa", 2.0, 5.0)


def test_finished_beats_not_finished_whichever_came_first(tmp_path):
    Store(tmp_path / "two").note(ended("a"))
    (row,) = merge([tmp_path / "two", kept(tmp_path / "one", "a", 1.0)], tmp_path / "out").rows
    assert row["status"] == "done"


def test_a_recording_of_other_content_is_refused_and_a_damaged_one_told(tmp_path):
    folders = [kept(tmp_path / name, name, 1.0) for name in ("one", "two")]
    for place, folder in enumerate(folders):
        record(folder / "recordings" / "made" / "scene.h5", reading=place)
    assert "scene.h5 holds other data" in refused(tmp_path, *folders)
    damaged = folders[1] / "recordings" / "made" / "scene.h5"
    damaged.write_bytes(damaged.read_bytes()[:-100])
    merged = merge(folders, tmp_path / "out")
    assert "scene.h5" in merged.left_out[0]
    assert tree(tmp_path / "out" / "recordings") == tree(folders[0] / "recordings")


def test_a_shard_that_was_changed_is_told_and_left_out(tmp_path):
    folder = kept(kept(tmp_path / "one", "a", 1.0), "b", 1.0)
    shard = folder / "cells" / f"{key('a')}.h5"
    shard.write_bytes(shard.read_bytes()[:-1] + b"x")
    merged = merge([folder], tmp_path / "out")
    assert [row["cell"] for row in merged.rows] == ["b"]
    assert "'a'" in merged.left_out[0]


def test_what_stands_in_the_way_is_named_and_nothing_is_written(tmp_path):
    (tmp_path / "empty").mkdir()
    assert "no results in" in refused(tmp_path, tmp_path / "empty")
    (tmp_path / "there").mkdir()
    with pytest.raises(FolderError, match="exists already"):
        merge([kept(tmp_path / "one", "a", 1.0)], tmp_path / "there")


def test_a_merge_that_was_killed_leaves_no_folder_and_the_next_one_clears_up(tmp_path):
    folder = kept(tmp_path / "one", "a", 1.0)
    code = (
        "import os, signal, sys\nfrom pathlib import Path\nfrom tactbench.core.matrix.merge import merge\n"
        "merge([Path(sys.argv[1])], Path(sys.argv[2]), also=lambda *_: os.kill(os.getpid(), signal.SIGKILL))\n"
    )
    dead = subprocess.run([sys.executable, "-c", code, str(folder), str(tmp_path / "out")])
    assert dead.returncode == -9
    assert not (tmp_path / "out").exists()
    assert len(list(tmp_path.glob(".out.*.merging"))) == 1
    merge([folder], tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "out"]


def test_of_two_at_once_into_one_folder_the_first_to_end_makes_it_of_its_own_files(tmp_path):
    for name, cell in (("one", "a"), ("two", "b")):
        Store(tmp_path / name).keep(key(cell), done(cell), {"test": answers(3)})
    code = (
        "import sys\nfrom pathlib import Path\nfrom tactbench.core.matrix.merge import merge\n"
        "def wait(_):\n    print('filled', flush=True)\n    sys.stdin.readline()\n"
        "merge([Path(sys.argv[1])], Path(sys.argv[2]), also=wait)\n"
    )
    out = tmp_path / "out"
    command = [sys.executable, "-c", code, str(tmp_path / "one"), str(out)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"filled\n"
        with pytest.raises(FolderError):
            merge([tmp_path / "two"], out, also=lambda _: other.communicate(b"\n", timeout=60))
    assert other.returncode == 0
    assert [row["cell"] for row in Store(out).rows()] == ["a"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one", "out", "two"]


def test_the_verb_merges_and_its_folder_can_be_shown(shell):
    from .store.made import whole

    for name, cell, host in (("one", "a", "aa"), ("two", "b", "bb")):
        store = Store(shell.folder / name)
        store.keep(key(cell), whole(cell, host=host, estimator=cell), {"test": answers(3)})
    told = shell("merge", "one", "two", "--out", "both")
    assert told.stdout == "both\n"
    assert "2 cells, 2 of them finished, on 2 hosts" in told.stderr
    assert "a" in shell("leaderboard", "both").stdout
    again = shell("merge", "two", "one", "--out", "both", code=2)
    assert "exists already" in again.stderr
    assert "Traceback" not in again.stderr


def test_its_tables_are_those_that_leaderboard_shows_over_replicates_and_with_levels(verbs):
    from .store.made import whole

    for repeat, name in ((1, "one"), (2, "two")):
        cell = f"icub/force/twin/karl2016/mean/{repeat}"
        store = Store(verbs.folder / name)
        store.keep(key(cell), whole(cell, repeat=repeat, repeats=2, seed=repeat), {"test": answers(3)})
    write_level(verbs.folder / "two", "icub", {"level": "silver"})
    verbs("merge", "one", "two", "--out", "both")
    written = (verbs.folder / "both" / "leaderboard.json").read_text()
    (row,) = json.loads(written)
    assert (row["n_replicates"], row["shown"]["level"]) == (2, OTHER_VERSION)
    assert verbs("leaderboard", "both", "--format", "json").stdout == written


def test_what_went_into_the_keys_of_its_cells_and_recordings_is_known(tmp_path):
    fixed = Fixed("f", {"versions": {"numpy": "2.0"}})
    for name, cell in (("one", "a"), ("two", "b")):
        store = Store(tmp_path / name)
        store.keep(key(cell), done(cell), {"test": answers(3)})
        record(store.folder / "recordings" / "made" / f"press-{key(cell)[:12]}.h5")
        entries = [Entry(cell, key(cell), {"seed": 1}, fixed), Entry("of another", key("x"), {"seed": 2}, fixed)]
        book_of(store.folder).write([*entries, Entry(f"recording {cell}", key(cell)[:12], {"seed": 3}, fixed)])
    merge([tmp_path / "one", tmp_path / "two"], tmp_path / "both")
    book = book_of(tmp_path / "both")
    for cell in "ab":
        assert book.sections(cell, key(cell)) == {**fixed.sections, "configuration": {"seed": 1}}
        assert book.sections("", key(cell)[:12]) == {**fixed.sections, "configuration": {"seed": 3}}
    assert book.sections("of another", key("x")) is None
    merge([tmp_path / "two", tmp_path / "both", tmp_path / "one"], tmp_path / "again")
    assert tree(tmp_path / "again") == tree(tmp_path / "both")
