"""Damaged and crafted files: no number changes in silence, no traceback, at most 512 MB and 5 s each.

Makes a small result folder on the twin, and then, each in a process of its own whose time and memory are measured:

- flips: one random bit of a recording, of a shard or of the ledger;
- truncations: a recording, a shard, the ledger or a mapping, cut at a random place;
- crafted: HDF5 files that claim more than they hold, in recordings and shards;
- folders: result folders whose lines, names and files a stranger has chosen;
- YAML: texts that grow when they are built;
- noise: bytes changed, moved and repeated in the same files.

What is read must be what was written, or be refused with one of the project's own errors, or be left out with a
sentence.

Usage: python benchmarks/hostile_files.py [FLIPS] [TRUNCATIONS] [SEED] [MINUTES]

With MINUTES damage goes on with other seeds until so much time has passed: an hour before a release.
"""

from __future__ import annotations

import importlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tactbench.core.errors import TactbenchError
from tactbench.core.leaderboard.checked import checked
from tactbench.core.leaderboard.formats import plain_text
from tactbench.core.leaderboard.table import build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW
from tactbench.core.matrix.store import Store
from tactbench.core.recording.health import examine
from tactbench.core.recording.mapping.model import Mapping
from tactbench.core.recording.reader import content_digest, open_recording
from tactbench.core.spec.yaml_file import load_yaml

ROOT = Path(__file__).resolve().parents[1]
MOST_MB, MOST_S = 512, 5.0
"""Of memory beyond what the process had before, and of processor time."""
WAIT_S = 30
"""Then a reader that waits is ended, and counted as such."""
Outcome = tuple[str, str]


def look_at_recording(path: Path, known: dict[str, Any]) -> Outcome:
    """Read a recording whole, as `inspect` and `run` do."""
    try:
        with open_recording(path) as recording:
            examine(recording)
        digest = content_digest(path)
        with open_recording(path) as recording:
            read = {name: recording.read(name) for name in recording.stream_names}
    except TactbenchError as error:
        return "refused", str(error)
    same = digest == known["digest"] and all(
        np.array_equal(stream.data, known["streams"][name].data)
        and np.array_equal(stream.t_ns, known["streams"][name].t_ns)
        for name, stream in read.items()
    )
    return ("without effect", "") if same and set(read) == set(known["streams"]) else ("CHANGED", "")


def look_at_folder(folder: Path, known: dict[str, Any]) -> Outcome:
    """Read a result folder as `leaderboard` and `report` do: rows, table and answers."""
    try:
        store = Store(folder)
        rows, wrong = checked(store.rows())
        plain_text(build_table(rows), 100, DEFAULT_VIEW)
        for row in rows:
            store.answers(str(row["key"]))
            store.provenance(str(row["made_by"]))
        said = (*wrong, *store.troubles)
    except TactbenchError as error:
        return "refused", str(error)
    expected = known.get("rows")
    if expected is None:
        return "read", ""
    for row in rows:
        if expected.get(row["cell"]) != row:
            return "CHANGED", str(row["cell"])
    if len(rows) < len(expected):
        return ("left out", said[0]) if said else ("CHANGED", "a row is gone without a word")
    return ("restored" if said else "without effect"), ""


def look_at_yaml(path: Path, _: dict[str, Any]) -> Outcome:
    """Read a mapping."""
    try:
        load_yaml(path, Mapping)
    except TactbenchError as error:
        return "refused", str(error)
    return "read", ""


def flipped(content: bytes, rng: random.Random) -> bytes:
    """Return `content` with one bit changed."""
    place = rng.randrange(8 * len(content))
    changed = bytearray(content)
    changed[place // 8] ^= 1 << place % 8
    return bytes(changed)


def noisy(content: bytes, rng: random.Random) -> bytes:
    """Return `content` with some bytes changed, moved or repeated."""
    changed = bytearray(content)
    for _ in range(rng.choice([1, 2, 8, 32])):
        place, length = rng.randrange(len(changed)), rng.choice([1, 4, 16, 256])
        if rng.random() < 0.5:
            changed[place : place + length] = rng.randbytes(length)
        else:
            other = rng.randrange(len(changed))
            changed[place : place + length] = changed[other : other + length]
    return bytes(changed)


def cut(content: bytes, rng: random.Random) -> bytes:
    """Return the beginning of `content`."""
    return content[: rng.randrange(len(content))]


def crafted_recordings(path: Path) -> Iterator[tuple[str, Path]]:
    """Yield recordings made from a sound one, in each of which one dataset is something else."""
    for stream in ("taxels", "force_torque"):
        for name in ("data", "t_ns"):
            for title, change in CRAFTED.items():
                made = path.with_name(f"crafted-{stream}-{name}-{title}.h5")
                shutil.copyfile(path, made)
                with h5py.File(made, "r+") as file:
                    change(file[f"streams/{stream}"], name)
                yield f"{stream}/{name}: {title}", made


def _again(group: Any, name: str, **stored: Any) -> Any:
    width, dtype = group[name].shape[1:], group[name].dtype
    del group[name]
    shape = (stored.pop("rows"), *width)
    chunks = stored.pop("chunk_rows", None)
    return group.create_dataset(
        name, shape=shape, dtype=dtype, maxshape=(None, *width), chunks=chunks and (chunks, *width), **stored
    )


def _huge_chunk(group: Any, name: str) -> None:
    made = _again(group, name, rows=3000, chunk_rows=2**26, compression="gzip")
    made.id.write_direct_chunk((0,) * made.ndim, zlib.compress(bytes(2**20)))


def _inflating(group: Any, name: str) -> None:
    made = _again(group, name, rows=2**16, chunk_rows=2**16, compression="gzip")
    made.id.write_direct_chunk((0,) * made.ndim, zlib.compress(bytes(2**31 - 1)))


def _zeros(group: Any, name: str) -> None:
    made = _again(group, name, rows=2**25, chunk_rows=2**18, compression="gzip")
    zeros = zlib.compress(bytes(int(np.prod(made.chunks)) * made.dtype.itemsize))
    for start in range(0, 2**25, 2**18):
        made.id.write_direct_chunk((start, *(0,) * (made.ndim - 1)), zeros)


def _nothing_stored(group: Any, name: str) -> None:
    _again(group, name, rows=2**40, chunk_rows=1024, compression="gzip")


def _texts(group: Any, name: str) -> None:
    rows = len(group[name])
    notes = group.require_group("annotations")
    made = notes.create_dataset("x", (rows,), h5py.string_dtype(), chunks=(rows,), compression="gzip")
    made[0] = "x" * 2**21
    reference = zlib.decompress(made.id.read_direct_chunk((0,))[1])[:16]
    made.id.write_direct_chunk((0,), zlib.compress(reference * rows))


def _outside(group: Any, name: str) -> None:
    del group[name]
    group[name] = h5py.ExternalLink("/etc/hostname", "/x")


def _loop(group: Any, name: str) -> None:
    del group[name]
    group[name] = h5py.SoftLink(f"{group.name}/{name}")


def _other_filter(group: Any, name: str) -> None:
    _again(group, name, rows=3000, chunk_rows=1024, compression="lzf")


def _other_type(group: Any, name: str) -> None:
    del group[name]
    group.create_dataset(name, data=np.zeros(3000, dtype=[("a", "f8"), ("b", "S9")]))


def _objects(group: Any, name: str) -> None:
    del group[name]
    group.create_dataset(name, (3000,), dtype=h5py.vlen_dtype(np.float64))


def _group(group: Any, name: str) -> None:
    del group[name]
    group.create_group(name)


def _deep(group: Any, name: str) -> None:
    del group[name]
    inner = group.create_group(name)
    for _ in range(2000):
        inner = inner.create_group("g")


def _narrow(group: Any, name: str) -> None:
    _again(group, name, rows=10, chunk_rows=1024)


CRAFTED: dict[str, Callable[[Any, str], None]] = {
    "a chunk of gigabytes": _huge_chunk, "a chunk that inflates to 2 GiB": _inflating, "gigabytes of zeros": _zeros,
    "a tebibyte that nothing holds": _nothing_stored, "texts that share a place": _texts, "a link outside": _outside,
    "a link to itself": _loop, "another filter": _other_filter, "a compound type": _other_type,
    "lists of any length": _objects, "a group": _group, "groups without end": _deep, "fewer rows": _narrow,
}  # fmt: skip


def stranger_folders(sound: Path, folder: Path, rng: random.Random) -> Iterator[tuple[str, Path]]:
    """Yield result folders in which somebody has written what he liked."""
    lines = (sound / "index.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    deep: Any = "x"
    for _ in range(3000):
        deep = [deep]
    values: list[tuple[str, Any]] = [
        ("a deep list", None), ("a number of 4,000 digits", int("9" * 4000)), ("not a number", float("nan")),
        ("infinity", float("inf")), ("a control sequence", "\x1b]0;x\x07"), ("a lone surrogate", "\ud800"),
        ("a mapping", {"a": {}}), ("a list", []), ("true", True), ("nothing", None), ("a megabyte", "x" * 2**20),
        ("minus one", -1), ("a path", "../../../etc/passwd"), ("NUL", "a\0b"),
    ]  # fmt: skip
    names = ["score", "cell", "status", "sensor", "key", "recordings", "confusion", "replicates", "made_by", "metric"]
    for number in range(38):
        title, value = values[number % len(values)]
        name = rng.choice(names)
        made = folder / f"edited-{number}"
        shutil.copytree(sound, made)
        changed = [dict(row) for row in rows]
        for row in changed:
            if "row" in row:
                row["row"] = {**row["row"], name: value}
        text = "\n".join(json.dumps(row) for row in changed)
        if title == "a deep list":
            text = text.replace(f'"{name}": null', f'"{name}": {"[" * 3000}{"]" * 3000}')
        (made / "index.jsonl").write_text(text + "\n")
        yield f"{name} is {title}", made
    for title, write in FOLDERS.items():
        made = folder / title.replace(" ", "-")
        shutil.copytree(sound, made)
        write(made)
        yield title, made


def _million_lines(folder: Path) -> None:
    (folder / "index.jsonl").write_text("{}\n" * 1_000_000)


def _long_line(folder: Path) -> None:
    (folder / "index.jsonl").write_text('{"row": {"cell": "' + "x" * 20 * 2**20 + '"}}\n')


def _shared(folder: Path) -> None:
    text = json.dumps({"shared": "0" * 64, "value": "x" * 2**20})
    line = json.dumps({"row": {"cell": "a", "status": "failed"}, "refs": {"reason": "0" * 64}})
    (folder / "index.jsonl").write_text(f"{text}\n" + f"{line}\n" * 5000)


def _pipe(name: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        os.mkfifo(folder / name)

    return write


def _shard(change: Callable[[Path], None]) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        for path in (folder / "cells").iterdir():
            change(path)

    return write


def _linked(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def _orphaned(change: Callable[[Path], None]) -> Callable[[Path], None]:
    """Without a ledger, shards vouch for themselves."""

    def write(folder: Path) -> None:
        (folder / "index.jsonl").unlink()
        _shard(change)(folder)

    return write


def _large_answers(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        dtype = file["test"].dtype
        del file["test"]
        made = file.create_dataset("test", (2**24,), dtype, chunks=(2**20,), compression="gzip")
        zeros = zlib.compress(bytes(2**20 * dtype.itemsize))
        for start in range(0, 2**24, 2**20):
            made.id.write_direct_chunk((start,), zeros)


FOLDERS: dict[str, Callable[[Path], None]] = {
    "a million lines": _million_lines, "a value shared by thousands": _shared,
    "a pipe for the ledger": _pipe("index.jsonl"),
    "a pipe for the run": _pipe("run.json"), "shards are links": _shard(_linked),
    "shards are empty": _shard(lambda path: path.write_bytes(b"")), "shards are large": _shard(_large_answers),
    "large shards without a ledger": _orphaned(_large_answers), "no ledger": _orphaned(lambda path: None),
    "shards are folders": _shard(lambda path: (path.unlink(), path.mkdir())[0]),
    "a folder for the ledger": lambda folder: ((folder / "index.jsonl").unlink(), (folder / "index.jsonl").mkdir())[0],
    "a line of 20 MiB": _long_line,
}  # fmt: skip


def measured(
    look: Callable[[Path, dict[str, Any]], Outcome], path: Path, known: dict[str, Any]
) -> tuple[Outcome, float, float]:
    """Return what a child process finds, the megabytes that it took beyond its start, and its processor seconds."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        os.close(read)
        signal.alarm(WAIT_S)
        try:
            outcome = look(path, known)
        except BaseException:
            outcome = ("TRACEBACK", traceback.format_exc()[-400:])
        os.write(write, json.dumps(outcome)[:4000].encode(errors="replace"))
        os._exit(0)
    os.close(write)
    with open(read, "rb") as file:  # noqa: PTH123  (a descriptor)
        text = file.read()
    _, status, used = os.wait4(child, 0)
    try:
        kind, why = json.loads(text)
    except ValueError:
        kind, why = "ENDED", f"by signal {os.WTERMSIG(status)}" if os.WIFSIGNALED(status) else text.decode()[:80]
    return (kind, why), used.ru_maxrss / 1024, used.ru_utime + used.ru_stime


class Tally:
    """What became of the files of each kind."""

    def __init__(self) -> None:
        self.kinds: dict[str, Counter[str]] = {}
        self.worst: dict[str, tuple[float, float]] = {}
        self.bad: list[str] = []

    def add(self, kind: str, title: str, found: tuple[Outcome, float, float]) -> None:
        """Count one file."""
        (outcome, why), mb, seconds = found
        self.kinds.setdefault(kind, Counter())[outcome] += 1
        most = self.worst.get(kind, (0.0, 0.0))
        self.worst[kind] = (max(most[0], mb), max(most[1], seconds))
        if outcome.isupper() or mb > MOST_MB or seconds > MOST_S:
            self.bad.append(f"{kind}, {title}: {outcome} {why} ({mb:.0f} MB, {seconds:.1f} s)")

    def show(self) -> None:
        """Print the table, and whatever should not be."""
        for kind, counts in self.kinds.items():
            mb, seconds = self.worst[kind]
            listed = ", ".join(f"{count} {outcome}" for outcome, count in counts.most_common())
            print(f"{kind:<24} {sum(counts.values()):>5}: {listed}; at most {mb:.0f} MB and {seconds:.2f} s")
        print(f"{len(self.bad)} that should not be")
        for one in self.bad[:40]:
            print(f"  {one}")


def main(flips: int, truncations: int, seed: int, minutes: float) -> int:
    """Go through all kinds; return 1 if a number changed in silence, a reader raised, or a bound was passed."""
    sys.path.insert(0, str(ROOT))
    bombs = importlib.import_module("tests.core.spec.yaml_bombs").BOMBS
    main_of = importlib.import_module("tactbench.core.cli").main
    tally, until = Tally(), time.monotonic() + 60 * minutes
    with tempfile.TemporaryDirectory() as name:
        here = Path(name)
        sound = here / "sound"
        try:
            main_of(["run", "--sensor", "icub", "--task", "force", "--estimator", "ols", "--repeats", "1",
                     "--out", str(sound)])  # fmt: skip
        except SystemExit as ended:
            if ended.code:
                return 1
        recording = next((sound / "recordings").rglob("*.h5"))
        shard = next((sound / "cells").glob("*.h5"))
        ledger = sound / "index.jsonl"
        mapping = ROOT / "examples/mappings/icub-grasp.yaml"
        with open_recording(recording) as opened:
            streams = {one: opened.read(one) for one in opened.stream_names}
        known = {
            "digest": content_digest(recording), "streams": streams,
            "rows": {row["cell"]: row for row in checked(Store(sound).rows())[0]},
        }  # fmt: skip
        rounds = 0
        while rounds == 0 or time.monotonic() < until:
            rng = random.Random(seed + rounds)
            rounds += 1
            for kind, change, times in (
                ("flip", flipped, flips),
                ("truncation", cut, truncations),
                ("noise", noisy, truncations),
            ):
                for number in range(times):
                    source = (recording, shard, ledger, *([mapping] if kind != "flip" else []))[
                        number % (3 + (kind != "flip"))
                    ]
                    content = change(source.read_bytes(), rng)
                    if source is mapping or source is recording:
                        path = here / source.name
                        path.write_bytes(content)
                        look = look_at_recording if source is recording else look_at_yaml
                        tally.add(
                            f"{kind}: {'recording' if source is recording else 'mapping'}",
                            str(number),
                            measured(look, path, known),
                        )
                    else:
                        folder = here / "changed"
                        shutil.copytree(sound, folder, ignore=shutil.ignore_patterns("recordings"))
                        (folder / source.relative_to(sound)).write_bytes(content)
                        what = "shard" if source is shard else "ledger"
                        tally.add(f"{kind}: {what}", str(number), measured(look_at_folder, folder, known))
                        shutil.rmtree(folder)
            if rounds == 1:
                for title, path in crafted_recordings(shutil.copyfile(recording, here / "craft.h5")):
                    tally.add("crafted recordings", title, measured(look_at_recording, path, known))
                    path.unlink()
                for title, path in stranger_folders(sound, here / "strangers", rng):
                    tally.add("strangers' folders", title, measured(look_at_folder, path, {}))
                    shutil.rmtree(path)
                for title, text in bombs.items():
                    path = here / "bomb.yaml"
                    path.write_text(text)
                    tally.add("YAML bombs", title, measured(look_at_yaml, path, {}))
        tally.show()
    return bool(tally.bad)


if __name__ == "__main__":
    given = [float(one) for one in sys.argv[1:]]
    defaults = [2000.0, 300.0, 1.0, 0.0]
    numbers = [*given, *defaults[len(given) :]]
    sys.exit(main(int(numbers[0]), int(numbers[1]), int(numbers[2]), numbers[3]))
