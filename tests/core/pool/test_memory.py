"""What processes hold: a child that still has its parent's memory is not counted again."""

import os
import subprocess
import sys

import pytest

from tactbench.core.pool import memory

SPAWN = """
import os, sys
held = bytearray(b"\\1" * (100 * 2**20))
print("held", flush=True)
# posix_spawn(3) is a vfork: this child has its parent's memory until the pipe has a writer and it may begin.
os.posix_spawn("/bin/true", ["true"], {}, file_actions=[(os.POSIX_SPAWN_OPEN, 0, sys.argv[1], os.O_RDONLY, 0)])
sys.stdin.read()
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory of other processes is read on Linux only")
def test_a_child_that_has_its_parents_memory_is_counted_once(tmp_path):
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    with subprocess.Popen(
        [sys.executable, "-c", SPAWN, fifo], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "held\n"
        while not memory.descendants(process.pid):
            assert process.poll() is None
        held = memory.taken_mb(process.pid, 0.0)
        fifo.open("w").close()
        process.stdin.close()
        assert process.wait(60) == 0
    assert 100 <= held < 160  # an interpreter takes some 10 MB beside what it holds; twice would be above 200
