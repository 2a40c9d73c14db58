"""A folder that somebody else made: nothing outside it is opened, nothing of it is believed unseen."""

import hashlib
import io
import json
import os

import h5py
import numpy as np
import pytest

from tactbench.core.errors import FolderError
from tactbench.core.matrix.merge import merge
from tactbench.core.matrix.store import Store, limits, shard
from tactbench.core.matrix.store.ledger import Entry, whole_text
from tactbench.core.matrix.store.sharing import canonical
from tests.core.matrix.test_merge import record

from .made import answers, done, kept, key


def forged(folder, change):
    """Write a folder whose ledger vouches for a shard that was made by hand."""
    row = {**done("a"), "key": key("a")}
    image = io.BytesIO(shard.build(canonical(row), "{}", {"test": answers(5)}))
    with h5py.File(image, "r+") as file:
        change(file)
    (folder / "cells").mkdir(parents=True)
    (folder / "cells" / f"{key('a')}.h5").write_bytes(image.getvalue())
    digest = hashlib.sha256(image.getvalue()).hexdigest()
    (folder / "index.jsonl").write_text(whole_text([Entry(row, (digest, len(image.getvalue())))]))
    return Store(folder)


FIELDS = [("y_true", "<f8"), ("y_pred", "<f8"), ("recording", "<i8"), ("row", "<i8"), ("fold", "<i8"),
          ("time_s", "<f8"), ("force_n", "<f8")]  # fmt: skip


def remade(file, **options):
    """Put another dataset in the place of the answers."""
    del file["test"]
    file.create_dataset("test", **options)


def another(file, name, value):
    """Put another text in the place of one of the shard's own."""
    del file.attrs[name]
    file.attrs[name] = value


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda file: remade(file, shape=(2**35,), dtype=FIELDS, chunks=(1024,)), "claims"),
        (lambda file: remade(file, shape=(2**55,), dtype=FIELDS, chunks=(1024,), compression="gzip"), "claims"),
        (lambda file: remade(file, data=np.zeros((5, 5), dtype=FIELDS)), "2 dimensions"),
        (lambda file: remade(file, data=np.zeros(5)), "holds float64"),
        (lambda file: remade(file, data=np.zeros(5, dtype=FIELDS[1:])), "test holds"),
        (lambda file: remade(file, data=np.zeros(5, dtype=[("y_true", "S8"), *FIELDS[1:]])), "test holds"),
        (lambda file: remade(file, shape=(5,), dtype=[("y_true", h5py.string_dtype()), *FIELDS[1:]]), "test holds"),
        (lambda file: remade(file, data=np.zeros(5, dtype=FIELDS), compression="lzf"), "has filters"),
        (lambda file: remade(file, data=np.ones(5, dtype=FIELDS)), "does not hold what was written"),
        (lambda file: remade(file, shape=(5,), dtype=FIELDS, external=[("/etc/passwd", 0, 280)]), "another file"),
        (lambda file: another(file, "format", "else"), "no shard of this version"),
        (lambda file: another(file, "row", "{}"), "does not hold what was written"),
        (lambda file: another(file, "provenance", np.arange(3)), "does not hold what was written"),
        (lambda file: file.attrs.__delitem__("sha256"), "does not hold what was written"),
    ],
)
def test_a_shard_that_claims_what_cannot_be_answers_nothing(tmp_path, change, says):
    store = forged(tmp_path, change)
    assert store.answers(key("a")) == {}
    assert says in store.troubles[0]


@pytest.mark.parametrize("kind", [h5py.ExternalLink("/etc/hostname", "/x"), h5py.SoftLink("/elsewhere")])
def test_links_in_a_shard_are_not_followed(tmp_path, kind):
    def change(file):
        del file["test"]
        file["test"] = kind

    store = forged(tmp_path, change)
    assert store.answers(key("a")) == {}
    assert "is a link to another place" in store.troubles[0]


def test_an_untouched_shard_made_so_is_read(tmp_path):
    assert len(forged(tmp_path, lambda file: None).answers(key("a"))["test"]) == 5


def test_a_column_larger_than_the_limit_is_refused(tmp_path, monkeypatch):
    kept(Store(tmp_path), "a")
    monkeypatch.setattr(limits, "FEW_BYTES", 100)
    monkeypatch.setattr(limits, "LARGEST_RATIO", 0)
    store = Store(tmp_path)
    assert store.answers(key("a")) == {}
    assert "claims 3 rows" in store.troubles[0]
    monkeypatch.setattr(limits, "SHARD_BYTES", 100)
    assert Store(tmp_path).rows() == []


def test_a_pipe_in_a_shards_place_is_not_waited_for(tmp_path):
    kept(Store(tmp_path), "a")
    path = tmp_path / "cells" / f"{key('a')}.h5"
    path.unlink()
    os.mkfifo(path)
    assert Store(tmp_path).answers(key("a")) == {}
    assert Store(tmp_path).rows() == []


def test_recordings_inside_are_followed_and_outside_only_with_leave(tmp_path):
    inside = record(tmp_path / "out" / "recordings" / "made" / "scene.h5")
    outside = record(tmp_path / "shelf" / "scene.h5")
    store = Store(tmp_path / "out")
    assert store.recording("recordings/made/scene.h5") == inside.resolve()
    for path in (str(outside), "../shelf/scene.h5", "recordings/../../shelf/scene.h5", "/etc/passwd", "a\0b"):
        assert store.recording(path) is None, path
    allowed = Store(tmp_path / "out", recordings=(tmp_path / "shelf",))
    assert allowed.recording(str(outside)) == outside.resolve()
    assert allowed.recording("/etc/passwd") is None
    (inside.parent / "link.h5").symlink_to(outside)
    assert store.recording("recordings/made/link.h5") is None


def test_ones_own_recordings_elsewhere_are_followed_as_long_as_they_are_the_same(tmp_path):
    from tactbench.core.recording.reader import content_digest

    outside = record(tmp_path / "shelf" / "scene.h5")
    digest = content_digest(outside)
    assert Store(tmp_path / "out").recording(str(outside), digest) == outside.resolve()
    assert Store(tmp_path / "out").recording(str(outside), "0" * 64) is None
    record(outside, reading=2.0)
    assert Store(tmp_path / "out").recording(str(outside), digest) is None
    os.mkfifo(tmp_path / "pipe")
    assert Store(tmp_path / "out").recording(str(tmp_path / "pipe"), digest) is None


def test_a_report_of_a_strangers_folder_names_what_it_left_out(shell):
    store = Store(shell.folder / "tactbench-results")
    kept(store, "a")
    with (shell.folder / "tactbench-results" / "index.jsonl").open("a") as ledger:
        ledger.write(json.dumps({"row": {**done("evil"), "score": "1"}}) + "\n")
    said = shell("report", code=2).stderr
    assert "'evil' is left out: its score: Input should be a valid number" in said
    assert "Traceback" not in said


@pytest.mark.parametrize("name", ["index.jsonl", "run.json", "provenance/0123456789abcdef.json"])
def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(tmp_path, name):
    kept(Store(tmp_path), "a")
    path = tmp_path / name
    path.unlink(missing_ok=True)
    path.parent.mkdir(exist_ok=True)
    os.mkfifo(path)
    store = Store(tmp_path)
    if name == "index.jsonl":
        with pytest.raises(FolderError, match="no regular file"):
            store.rows()
    else:
        assert [row["cell"] for row in store.rows()] == ["a"]
        assert store.provenance("0123456789abcdef") == {}


def edited(folder, **changes):
    """Change the row of a finished cell in the ledger as an editor of text would."""
    path = folder / "index.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    for line in lines:
        line.get("row", {}).update(changes)
        line.pop("sha256", None)  # as earlier versions wrote it, or somebody who knows
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    return Store(folder)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"score": 0.1075}, "'score' is 0.1075, outside its own interval"),
        ({"score": 0.51, "ci_low": 0.5}, "its shard is missing, cut or not of this row"),
        ({"sensor": "another"}, "its shard is missing, cut or not of this row"),
        ({"metric": "mae", "score": -5.0}, "'score' is -5, and no mae is"),
        ({"metric": "macro_f1", "score": 1.5}, "'score' is 1.5, and no macro_f1 is"),
        ({"score": float("nan")}, "'score' is nan, and no rmse is"),
        ({"ci_high": float("inf")}, "the interval of 'score' has no ends"),
    ],
)
def test_a_row_that_is_not_its_shards_or_cannot_be_is_left_out_or_restored(tmp_path, changes, says):
    kept(Store(tmp_path), "a", metric="rmse", score=0.55, ci_low=0.5, ci_high=0.6)
    assert Store(tmp_path).finished(key("a"))["score"] == 0.55
    store = edited(tmp_path, **changes)
    # A line that cannot be leaves a shard that no line tells of: its own row is taken instead.
    restored = store.rows()
    assert [(row["score"], row["metric"], row.get("sensor")) for row in restored] in ([], [(0.55, "rmse", None)])
    assert says in " ".join(store.troubles)
    if restored:
        assert merge([tmp_path], tmp_path / "merged").rows[0]["score"] == 0.55
    else:
        assert store.finished(key("a")) is None
        with pytest.raises(FolderError, match="no results"):
            merge([tmp_path], tmp_path / "merged")


def test_a_line_that_was_altered_is_no_line(tmp_path):
    kept(Store(tmp_path), "a", score=0.55)
    path = tmp_path / "index.jsonl"
    path.write_text(path.read_text().replace('"cell": "a"', '"cell": "b"'))
    store = Store(tmp_path)
    assert [(row["cell"], row["score"]) for row in store.rows()] == [("a", 0.55)]
    assert "do not hold what was written" in " ".join(store.troubles)
