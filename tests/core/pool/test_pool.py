"""Processes of the pool: what an item leaves behind, what ends them, and nobody at the end."""

import os
import signal
import stat
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from tactbench.core.errors import Crashed, OutOfMemory, TimedOut
from tactbench.core.pool import processes
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.pool import Pool as EitherPool
from tests.core.pool.patience import ending, gone, pause, until
from tests.core.pool.remote_work import misbehave, square
from tests.core.pool.works import flees, leaves, work

LIMITS = Limits(timeout_s=20.0, memory_mb=64)
POOLS = {
    "isolated": lambda: Pool(1, LIMITS),
    "isolated-2": lambda: Pool(2, LIMITS),
    "reused": lambda: Pool(1, LIMITS, reuse=True),
    "reused-2": lambda: Pool(2, LIMITS, reuse=True),
}


@pytest.fixture(params=POOLS)
def pool(request):
    return POOLS[request.param]()


@pytest.fixture(autouse=True)
def nobody_and_nothing_left():
    """Whatever a test does: no process and no descriptor stays."""
    open_ones = Path("/proc/self/fd")
    children, descriptors = processes.children(os.getpid()), len(list(open_ones.iterdir()))
    yield
    assert processes.children(os.getpid()) == children
    assert len(list(open_ones.iterdir())) <= descriptors


def test_an_item_is_taken_once_the_last_outcome_was_dealt_with():
    heard, when = [], []
    for item, _ in Pool(1).each(lambda item: pause.wait(0.1), (when.append(len(heard)) or n for n in range(4))):
        heard.append(item)
    assert when == [0, 1, 2, 3]


def test_nobody_is_beside_an_item_that_is_the_only_one_at_work():
    strangers = processes.children(os.getpid())

    def alone(item):
        children = Path(f"/proc/{os.getppid()}/task/{os.getppid()}/children").read_text().split()
        beside = set(map(int, children)) - strangers - {os.getpid()}
        return until(lambda: all(gone(pid) for pid in beside), 5.0)  # the last one is going

    assert dict(Pool(1).each(alone, range(4))) == dict.fromkeys(range(4), True)


def test_what_an_item_has_left_is_ended_while_others_are_at_work_and_theirs_is_not(pool, tmp_path):
    left = tmp_path / "left"

    def works(item):
        if item == "leaves":
            (tmp_path / "unnamed").write_text(f"{leaves()} {flees()}")
            (tmp_path / "unnamed").rename(left)
            return True
        own = leaves(), flees()
        assert until(left.exists)
        assert until(lambda: all(gone(pid) for pid in left.read_text().split()))
        pause.wait(0.1)  # for whoever might take ours for those
        return not any(gone(pid) for pid in own)

    assert dict(pool.each(works, ["leaves", "watches", "looks"])) == {"leaves": True, "watches": True, "looks": True}


def test_what_an_item_left_that_crashed_is_ended_while_others_are_at_work(pool, tmp_path):
    left = tmp_path / "left"

    def works(item):
        if item == "crashes":
            (tmp_path / "unnamed").write_text(f"{leaves()} {flees()}")
            (tmp_path / "unnamed").rename(left)
            os.abort()
        assert until(left.exists)
        return until(lambda: all(gone(pid) for pid in left.read_text().split()))

    found = dict(pool.each(works, ["crashes", "watches", "looks"]))
    assert type(found.pop("crashes")) is Crashed
    assert found == {"watches": True, "looks": True}


def test_children_that_the_caller_starts_meanwhile_are_left_alone(pool, tmp_path):
    def works(item):
        (tmp_path / str(item)).write_text(str(flees()))
        if item % 2:
            os.abort()  # what it has left behind has this process for its parent now

    own = [sys.executable, "-c", "import sys; sys.exit(int(sys.stdin.read()))"]
    running = pool.each(works, range(4))
    next(running)
    with ending(own, stdin=subprocess.PIPE, text=True) as child:
        assert len(list(running)) == 3
        assert child.poll() is None
        child.communicate("7", timeout=30)
        assert child.returncode == 7, "and it is this test that hears how it ended"
    assert all(gone((tmp_path / str(item)).read_text()) for item in range(4))


@pytest.mark.parametrize("heard", [0, 1, 2])
def test_an_iteration_given_up_leaves_nobody(pool, heard):
    running = pool.each(work, ["fine", "flees", "leaves", "hangs", "fine"])
    for _ in range(heard):
        next(running)
    running.close()


@pytest.mark.filterwarnings("ignore:Exception ignored in. <_io.FileIO")  # one just opened closes itself
@pytest.mark.parametrize("after_s", [n / 200 for n in range(1, 13)])
def test_ctrl_c_leaves_nobody_whenever_it_comes(pool, after_s):
    def rings():
        # Set in here: on a busy machine the alarm may ring before the next line, and an interrupt out there would end
        # the whole test process.
        signal.setitimer(signal.ITIMER_REAL, after_s)
        for _ in pool.each(work, ["fine"] * 1000):
            pass

    before = signal.signal(signal.SIGALRM, lambda number, frame: signal.raise_signal(signal.SIGINT))
    try:
        with pytest.raises(KeyboardInterrupt):
            rings()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)  # one that rings later would end it as well
        signal.signal(signal.SIGALRM, before)


def test_a_process_that_ends_between_two_items_costs_none():
    pids = []
    for _, pid in Pool(1, reuse=True).each(work, ["whoami"] * 4):
        pids.append(pid)
        os.kill(pid, signal.SIGKILL)
    assert len(set(pids)) == 4
    assert all(isinstance(pid, int) for pid in pids)


def test_an_item_that_ends_every_process_ends_two_at_most():
    """One that cannot even begin is not tried for ever."""

    def works(item):
        return item

    ends = os.getpid()
    os.register_at_fork(after_in_child=lambda: os._exit(7) if ends and os.getppid() == ends else None)
    try:
        ((_, outcome),) = Pool(1).each(works, ["item"])
    finally:
        ends = 0
    assert type(outcome) is Crashed
    assert "exit code 7" in str(outcome)


def test_memory_is_limited_item_by_item(pool):
    asked = ["fine", "eats", "fine", "eats", "prints"]
    found = list(pool.each(work, asked))
    assert sorted(item for item, _ in found) == sorted(asked)
    ended = [type(outcome) is OutOfMemory for item, outcome in found if item == "eats"]
    assert ended == [True, True]
    assert {outcome for item, outcome in found if item != "eats"} == {"fine", "printed"}


def test_limits_begin_with_the_item_and_not_with_its_process():
    pool = Pool(1, Limits(timeout_s=0.6, memory_mb=64))
    grown = []
    for _, outcome in pool.each(lambda item: pause.wait(0.35), range(4)):
        assert outcome is False
        grown.append(bytearray(b"\1" * (100 * 2**20)))  # what this process holds, none of its children took


def test_with_a_device_to_close_no_item_begins_before_the_last_outcome_is_dealt_with(tmp_path):
    pool = Pool(1, Limits(grace_s=5.0), reuse=True)
    running = pool.each(lambda path: path.write_text("begun"), [tmp_path / "one", tmp_path / "two"])
    next(running)
    pause.wait(0.2)
    assert not (tmp_path / "two").exists()
    running.close()
    assert not (tmp_path / "two").exists()


def test_an_item_that_ends_its_process_costs_itself_only_also_where_the_next_was_asked_for_already():
    for ends in ("aborts", "vanishes", "kills"):
        began = time.monotonic()
        found = list(Pool(1, reuse=True).each(work, ["fine", ends, "fine", ends, "prints"]))
        assert [(item, type(outcome) is Crashed) for item, outcome in found] == [
            ("fine", False), (ends, True), ("fine", False), (ends, True), ("prints", False),
        ]  # fmt: skip
        assert time.monotonic() - began < 20


def writes_to_every_pipe(item):
    for descriptor in range(3, 64):
        try:
            if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                os.write(descriptor, b"\xff" * 40)
        except OSError:
            continue
    time.sleep(60)


def test_bytes_that_are_no_result_end_their_item_at_once():
    found = dict(Pool(1).each(lambda item: writes_to_every_pipe(item) if item else "fine", [1, 0]))
    assert found[0] == "fine"
    assert type(found[1]) is Crashed
    assert "no result" in str(found[1])


def test_a_child_without_stderr_that_is_asked_to_end_never_returns():
    def closes(item):
        os.close(2)
        try:
            time.sleep(60)
        finally:
            print("said", file=sys.stderr, flush=True)

    pid = os.getpid()
    ((_, outcome),) = Pool(1, Limits(timeout_s=0.2, grace_s=20.0)).each(closes, ["item"])
    assert os.getpid() == pid
    assert type(outcome) is TimedOut


def test_children_that_the_system_would_reap_by_itself_are_heard():
    before = signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        assert [type(outcome) for _, outcome in Pool(1).each(work, ["fine", "aborts"])] == [str, Crashed]
    finally:
        signal.signal(signal.SIGCHLD, before)


def served(jobs, limits=LIMITS):
    """A pool of a process that has threads."""
    return EitherPool(jobs, limits, fork=False)


@pytest.fixture(scope="module")
def server():
    """The fork server, which stays; started before the descriptors are counted."""
    assert list(served(1).each(square, [3])) == [(3, 9)]


class TestForkServer:
    """The same guards for a process that has threads."""

    pytestmark = pytest.mark.usefixtures("server")

    def test_every_item_has_one_outcome_whatever_it_does(self):
        outcomes = dict(served(2).each(misbehave, ["fine", "raise", "abort", "lambda", "fine too"]))
        assert (outcomes["fine"], outcomes["fine too"]) == ("fine is well", "fine too is well")
        assert "Try again." in str(outcomes["raise"])
        assert outcomes["abort"].signal == signal.SIGABRT
        assert "cannot be sent" in str(outcomes["lambda"])

    def test_an_item_that_hangs_is_ended(self):
        found = dict(served(1, Limits(timeout_s=0.5)).each(misbehave, ["hang"]))
        assert type(found["hang"]) is TimedOut
        assert "in misbehave" in found["hang"].traceback_text

    def test_what_cannot_be_pickled_has_its_error(self):
        found = dict(served(1).each(square, [2, sys, 3]))
        assert (found[2], found[3]) == (4, 9)
        assert isinstance(found[sys], TypeError)

    def test_order_and_number_do_not_matter(self):
        assert sorted(served(3).each(square, range(20))) == [(number, number**2) for number in range(20)]

    def test_what_crashes_leaves_nobody(self):
        ((_, outcome),) = served(1).each(work, ["flees"])
        assert gone(outcome)


def test_an_item_that_kills_the_fork_server_has_crashed_and_the_others_are_right():
    code = (
        "from multiprocessing import forkserver\n"
        "from tests.core.pool.remote_work import misbehave\n"
        "from tactbench.core.pool.pool import Pool\n"
        "forkserver.ensure_running()\n"  # with nothing imported beforehand
        "for item, outcome in Pool(1, fork=False).each(misbehave, ['fine', 'kill-parent', 'fine']):\n"
        "    print(type(outcome).__name__)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.split() == ["str", "Crashed", "str"]


def test_the_end_of_a_fork_server_is_waited_for():
    code = (
        "import os, signal, threading\n"
        "from multiprocessing import forkserver\n"
        "from pathlib import Path\n"
        "from tactbench.core.pool.processes import await_fork_server_end\n"
        "await_fork_server_end(60)\n"  # there is none
        "forkserver.ensure_running()\n"
        "pid = forkserver._forkserver._forkserver_pid\n"
        "threading.Timer(0.2, os.kill, (pid, signal.SIGKILL)).start()\n"
        "await_fork_server_end(60)\n"
        "print(Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "Z\n"


OWNER = """
import sys
from multiprocessing import forkserver
from pathlib import Path
from tactbench.core.pool.pool import Pool
from tests.core.pool.remote_work import wait_for
if sys.argv[2] == "served":
    forkserver.ensure_running()  # with nothing imported beforehand
for _ in Pool(1, fork=sys.argv[2] == "forked").each(wait_for, [(Path(sys.argv[1]), Path("/no/such/file"))]):
    pass
"""

Pool = partial(EitherPool, fork=True)  # the clock of a test's timeout is a thread


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
@pytest.mark.parametrize("how", ["served", "forked"])
def test_an_item_ends_with_the_process_that_wanted_it(tmp_path, number, how):
    begun = tmp_path / "begun"
    with ending([sys.executable, "-c", OWNER, str(begun), how], stderr=subprocess.PIPE) as owner:
        assert until(lambda: begun.exists() and begun.read_text())
        item = int(begun.read_text())
        owner.send_signal(number)
        owner.communicate(timeout=30)
        assert until(lambda: gone(item))
