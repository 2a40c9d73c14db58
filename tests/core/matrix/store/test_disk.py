"""Full disks and folders that refuse: a clear message, and everything finished before is kept and valid."""

import os
import subprocess
import sys
from contextlib import contextmanager, suppress

import pytest

from tactbench.core.errors import FolderError
from tactbench.core.matrix.store import Store
from tests.conftest import ROOT, Shell

from .made import answers, done, ended, kept, key


@contextmanager
def small_disk(folder, size="size=600k"):
    """A real file system, of 600 kB unless said otherwise."""
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tactbench-test", str(folder)], capture_output=True)
    if mounted.returncode:
        pytest.skip("a file system can be mounted by root only")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def test_a_full_disk_keeps_what_was_finished_and_goes_on_when_there_is_room(tmp_path):
    with small_disk(tmp_path / "disk") as disk:
        store = Store(disk / "out")
        finished = []

        def fill():
            for number in range(1000):
                store.keep(key(number), done(f"c{number}", remarks=[f"{number} " * 99]), {"test": answers(200)})
                finished.append(f"c{number}")

        with store.hold(), pytest.raises(FolderError) as error:
            fill()
        assert "the disk is full" in str(error.value)
        assert str(disk / "out") in str(error.value)
        assert error.value.exit_code == 2
        assert len(finished) > 5
        assert not list(disk.rglob("*.partial"))
        found = Store(disk / "out")
        assert [row["cell"] for row in found.rows()] == finished
        assert all(len(found.answers(row["key"])["test"]) == 200 for row in found.rows())
        with suppress(OSError), (disk / "filler").open("wb", buffering=0) as filler:
            while True:
                filler.write(b"x" * 512)
        with pytest.raises(FolderError, match="the disk is full"):
            found.note(ended("d", log="x" * 30_000))
        assert (disk / "out" / "index.jsonl").read_bytes().endswith(b"\n")
        (disk / "filler").unlink()
        for number in range(4):
            (disk / "out" / "cells" / f"{key(number)}.h5").unlink()
        with Store(disk / "out").hold() as again:
            kept(again, "last")
        assert Store(disk / "out").rows()[-1]["cell"] == "last"


def test_a_read_only_folder_is_refused_before_anything_is_run_and_can_be_read(tmp_path):
    with small_disk(tmp_path / "disk") as disk:
        with Store(disk / "out").hold() as store:
            kept(store, "a")
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        with pytest.raises(FolderError, match="Read-only") as error, Store(disk / "out").hold():
            pass
        assert "--out DIR" in str(error.value)
        found = Store(disk / "out")
        assert [row["cell"] for row in found.rows()] == ["a"]
        assert len(found.answers(key("a"))["test"]) == 3


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused(tmp_path):
    (tmp_path / "out").mkdir(mode=0o500)
    with pytest.raises(FolderError, match="Permission denied"), Store(tmp_path / "out").hold():
        pass


def test_a_file_in_the_folders_place_is_refused(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(FolderError, match="cannot be written"), Store(tmp_path / "out").hold():
        pass


def test_the_command_line_stops_with_a_clear_message_and_goes_on_later(tmp_path, monkeypatch):
    """The real run on a real disk that fills up: exit code 2, no traceback, and the same scores in the end."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    import trivial

    shelf = trivial.install(tmp_path / "plugin")
    asked = ("run", "--task", "nothing-asked", "--estimator", "nothing", "--recordings", str(shelf), "--repeats", "30",
             "--no-latency")  # fmt: skip
    plain, plugin = Shell(tmp_path), (str(tmp_path / "plugin"),)
    plain(*asked, "--out", "plain", plugins=plugin)
    with small_disk(tmp_path / "disk") as disk:
        (disk / "filler").write_bytes(b"x" * 400 * 1024)
        stopped = plain(*asked, "--out", str(disk / "out"), plugins=plugin, code=2)
        assert "the disk is full" in stopped.stderr
        assert str(disk / "out") in stopped.stderr
        assert "the same command goes on" in stopped.stderr
        assert "Traceback" not in stopped.stderr
        before = {row["cell"]: row for row in Store(disk / "out").rows()}
        assert 5 < len(before) < 30
        (disk / "filler").unlink()
        subprocess.run(["mount", "-o", "remount,size=4000k", str(disk)], check=True)
        plain(*asked, "--out", str(disk / "out"), plugins=plugin)
        assert (disk / "out" / "scores.json").read_bytes() == (tmp_path / "plain" / "scores.json").read_bytes()
        assert {row["cell"]: row for row in Store(disk / "out").rows()}.items() >= before.items()


def test_a_limit_on_the_size_of_files_is_told(tmp_path):
    code = (
        "import resource, sys\nfrom pathlib import Path\nfrom tactbench.core.errors import FolderError\n"
        "from tests.core.matrix.store.made import kept\nfrom tactbench.core.matrix.store import Store\n"
        "store = Store(Path(sys.argv[1]))\nkept(store, 'a')\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1500, 1500))\n"
        "try:\n    kept(store, 'b')\nexcept FolderError as error:\n    print(error)\n"
    )
    done_ = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], check=True, capture_output=True, text=True, cwd=ROOT
    )
    assert "larger than this process may write" in done_.stdout
    assert [row["cell"] for row in Store(tmp_path).rows()] == ["a"]
    assert not list(tmp_path.rglob("*.partial"))


def test_a_disk_too_full_for_a_recording_stops_the_run_and_fails_no_cell(tmp_path):
    with small_disk(tmp_path / "disk") as disk:
        (disk / "filler").write_bytes(b"x" * 540 * 1024)
        stopped = Shell(tmp_path)(
            "run", "--repeats", "1", "--sensor", "icub", "--task", "curvature", "--out", str(disk / "out"), code=2
        )
        assert "No space left on device" in stopped.stderr
        assert str(disk / "out" / "recordings") in stopped.stderr
        assert "Traceback" not in stopped.stderr
        assert Store(disk / "out").rows() == []


def test_a_disk_that_turns_read_only_while_recording_is_told_on_one_screen(tmp_path):
    with small_disk(tmp_path / "disk", "size=60m") as disk:
        command = [
            sys.executable,
            "-m",
            "tactbench",
            "run",
            "--repeats",
            "1",
            "--sensor",
            "icub",
            "--task",
            "curvature",
        ]
        env = {**os.environ, "PYTHONPATH": str(ROOT)}
        with subprocess.Popen([*command, "--out", disk / "out"], stderr=subprocess.PIPE, text=True, env=env) as process:
            begun = next(line for line in process.stderr if "/15 " in line)
            # Over itself: a disk that a process is writing to cannot be remounted.
            subprocess.run(["mount", "--bind", disk, disk], check=True)
            subprocess.run(["mount", "-o", "remount,bind,ro", disk], check=True)
            try:
                told = begun + process.stderr.read()
                assert process.wait(60) == 2
            finally:
                subprocess.run(["umount", "-l", disk], check=True)
        assert "Read-only file system" in told
        assert "Traceback" not in told
        assert Store(disk / "out").rows() == []


def test_a_process_that_ends_while_it_writes_a_finished_recording_leaves_no_half_of_it(tmp_path):
    code = (
        "import os, signal, sys\nfrom tactbench.core.cli import main\nsynced = os.fsync\n"
        "def sync(descriptor):\n"
        "    if os.readlink(f'/proc/self/fd/{descriptor}').endswith('.completing'):\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
        "    synced(descriptor)\n"
        "os.fsync = sync\nmain(sys.argv[1:])\n"
    )
    asked = ("run", "--repeats", "1", "--sensor", "ideal", "--task", "force", "--estimator", "ols")
    done_ = subprocess.run(
        [sys.executable, "-c", code, *asked, "--jobs", "2", "--out", str(tmp_path)],
        capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip
    assert done_.returncode == 1, done_.stderr
    assert "SIGKILL" in done_.stdout + done_.stderr
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".partial", ".completing", ".h5")]
