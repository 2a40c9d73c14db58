"""Who is there beside an item at work: the next one's process, what the last one left behind, and nobody at the end."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from tactbench.core.errors import Crashed, OutOfMemory
from tactbench.core.matrix.engines import cores, family
from tactbench.core.matrix.engines.isolated import Isolated
from tactbench.core.matrix.pool.limits import Limits
from tactbench.core.matrix.engines.processes import Processes
from tests.core.matrix.engines.patience import ending, gone, pause, until
from tests.core.matrix.engines.works import flees, leaves, work

CORES = sorted(os.sched_getaffinity(0))
LIMITS = Limits(timeout_s=20.0, memory_mb=64)
ENGINES = {
    "isolated": lambda: Isolated(1, LIMITS),
    "isolated-2": lambda: Isolated(2, LIMITS),
    "reused": lambda: Processes(1, LIMITS),
    "reused-2": lambda: Processes(2, LIMITS),
}


@pytest.fixture(params=[(name, free) for name in ENGINES for free in (False, True)], ids=str)
def engine(request, monkeypatch):
    """Every engine, as this machine is now and as where cores are always free."""
    name, free = request.param
    if free:
        monkeypatch.setattr(cores, "cores", lambda: 1000)
    return ENGINES[name]()


@pytest.fixture
def one_core():
    """As on a machine with one core: nothing is done ahead."""
    os.sched_setaffinity(0, CORES[:1])
    yield
    os.sched_setaffinity(0, CORES)


@pytest.fixture
def free_cores(monkeypatch):
    """As on a machine where cores are always free: what is done ahead is done."""
    monkeypatch.setattr(cores, "cores", lambda: 1000)


@pytest.fixture
def one_free_core(monkeypatch):
    """As on a machine with one core and nobody else: the next process is there, told of its item and not yet asked.

    With a second core it would be asked at once, if the system was quick to take the last one apart.
    """
    monkeypatch.setattr(cores, "cores", lambda: 1)
    monkeypatch.setattr(cores, "wanted", lambda: 1)


@pytest.fixture(autouse=True)
def nobody_and_nothing_left():
    """Whatever a test does: no process and no descriptor stays."""
    open_ones = Path("/proc/self/fd")
    children, descriptors = family.own_children(), len(list(open_ones.iterdir()))
    yield
    assert family.own_children() == children
    assert len(list(open_ones.iterdir())) <= descriptors


class Handed:
    """Hands out items, says that so many are at hand, and remembers how many outcomes were heard before each."""

    def __init__(self, items, at_hand):
        self.items, self.at_hand, self.heard, self.when = list(items), at_hand, 0, []

    def __iter__(self):
        return self

    def __length_hint__(self):
        return min(self.at_hand, len(self.items))

    def __next__(self):
        if not self.items:
            raise StopIteration
        self.when.append(self.heard)
        return self.items.pop(0)


def taken(at_hand):
    """Return how many outcomes were heard before each of four items was taken."""
    handed = Handed(range(4), at_hand)
    for _ in Isolated(1).each(lambda item: pause.wait(0.1), handed):
        handed.heard += 1
    return handed.when


def test_an_item_whose_taking_is_work_is_not_taken_beside_another():
    assert taken(0) == [0, 1, 2, 3]


def test_an_item_that_is_at_hand_is_taken_before_the_last_outcome_is_dealt_with():
    assert taken(4) == [0, 0, 1, 2]


def test_nobody_is_beside_an_item_that_is_the_only_one_at_work(free_cores):
    strangers = family.own_children()

    def alone(item):
        children = Path(f"/proc/{os.getppid()}/task/{os.getppid()}/children").read_text().split()
        beside = set(map(int, children)) - strangers - {os.getpid()}
        return until(lambda: all(gone(pid) for pid in beside), 5.0)  # the last one is going

    assert dict(Isolated(1).each(alone, range(4))) == dict.fromkeys(range(4), True)


def test_what_an_item_has_left_is_ended_while_others_are_at_work_and_theirs_is_not(engine, tmp_path):
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

    assert dict(engine.each(works, ["leaves", "watches", "looks"])) == {"leaves": True, "watches": True, "looks": True}


def test_what_an_item_left_that_crashed_is_ended_while_others_are_at_work(engine, tmp_path):
    left = tmp_path / "left"

    def works(item):
        if item == "crashes":
            (tmp_path / "unnamed").write_text(f"{leaves()} {flees()}")
            (tmp_path / "unnamed").rename(left)
            os.abort()
        assert until(left.exists)
        return until(lambda: all(gone(pid) for pid in left.read_text().split()))

    found = dict(engine.each(works, ["crashes", "watches", "looks"]))
    assert type(found.pop("crashes")) is Crashed
    assert found == {"watches": True, "looks": True}


def test_children_that_the_caller_starts_meanwhile_are_left_alone(engine, tmp_path):
    def works(item):
        (tmp_path / str(item)).write_text(str(flees()))
        if item % 2:
            os.abort()  # what it has left behind has this process for its parent now

    own = [sys.executable, "-c", "import sys; sys.exit(int(sys.stdin.read()))"]
    running = engine.each(works, range(4))
    next(running)
    with ending(own, stdin=subprocess.PIPE, text=True) as child:
        assert len(list(running)) == 3
        assert child.poll() is None
        child.communicate("7", timeout=30)
        assert child.returncode == 7, "and it is this test that hears how it ended"
    assert all(gone((tmp_path / str(item)).read_text()) for item in range(4))


def test_who_is_no_longer_below_is_not_killed():
    """A number read a moment ago may be a stranger's by now."""
    with ending([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        family._kill_child_of({1}, child.pid)
        assert not until(lambda: child.poll() is not None, 0.2)
        family._kill_child_of({os.getpid()}, child.pid)
        assert child.wait(30) == -signal.SIGKILL


@pytest.mark.parametrize("heard", [0, 1, 2])
def test_an_iteration_given_up_leaves_nobody(engine, heard):
    running = engine.each(work, ["fine", "flees", "leaves", "hangs", "fine"])
    for _ in range(heard):
        next(running)
    running.close()


@pytest.mark.filterwarnings("ignore:Exception ignored in. <_io.FileIO")  # one just opened closes itself
@pytest.mark.parametrize("after_s", [n / 200 for n in range(1, 13)])
def test_ctrl_c_leaves_nobody_whenever_it_comes(engine, after_s):
    def rings():
        # Set in here: on a busy machine the alarm may ring before the next line, and an interrupt out there would end
        # the whole test process.
        signal.setitimer(signal.ITIMER_REAL, after_s)
        for _ in engine.each(work, ["fine"] * 1000):
            pass

    before = signal.signal(signal.SIGALRM, lambda number, frame: signal.raise_signal(signal.SIGINT))
    try:
        with pytest.raises(KeyboardInterrupt):
            rings()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)  # one that rings later would end it as well
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_that_ends_before_it_is_asked_costs_no_item(number, one_free_core):
    found, strangers = {}, family.own_children()
    for item, pid in Isolated(1).each(lambda item: os.getpid(), range(3)):
        found[item] = pid
        ahead = family.own_children() - strangers - {pid}
        assert len(ahead) == (item < 2)
        for one in ahead:
            os.kill(one, number)
        assert until(lambda: all(gone(one) for one in ahead))  # noqa: B023  (called at once)
    assert len(set(found.values())) == 3
    assert not any(isinstance(pid, BaseException) for pid in found.values())


def test_a_process_that_ends_between_two_items_costs_none(one_core):
    pids = []
    for _, pid in Processes(1).each(work, ["whoami"] * 4):
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
        ((_, outcome),) = Isolated(1).each(works, ["item"])
    finally:
        ends = 0
    assert type(outcome) is Crashed
    assert "exit code 7" in str(outcome)


@pytest.mark.parametrize("name", ENGINES)
def test_memory_is_limited_as_it_is_without_anybody_ahead(name, free_cores):
    asked = ["fine", "eats", "fine", "eats", "prints"]
    found = list(ENGINES[name]().each(work, asked))
    assert sorted(item for item, _ in found) == sorted(asked)
    ended = [type(outcome) is OutOfMemory for item, outcome in found if item == "eats"]
    assert ended == [True, True]
    assert {outcome for item, outcome in found if item != "eats"} == {"fine", "printed"}


def test_limits_begin_with_the_item_and_not_with_its_process(free_cores):
    engine = Isolated(1, Limits(timeout_s=0.6, memory_mb=64))
    grown = []
    for _, outcome in engine.each(lambda item: pause.wait(0.35), range(4)):
        assert outcome is False
        grown.append(bytearray(b"\1" * (100 * 2**20)))  # what this process holds, none of its children took


def test_the_next_item_of_a_reused_process_begins_before_the_last_outcome_is_dealt_with(tmp_path, free_cores):
    running = Processes(1).each(lambda path: path.write_text("begun"), [tmp_path / "one", tmp_path / "two"])
    next(running)
    assert until((tmp_path / "two").exists)
    assert [path.name for path, _ in running] == ["two"]


def test_with_a_device_to_close_no_item_begins_before_the_last_outcome_is_dealt_with(tmp_path, free_cores):
    engine = Processes(1, Limits(grace_s=5.0))
    running = engine.each(lambda path: path.write_text("begun"), [tmp_path / "one", tmp_path / "two"])
    next(running)
    pause.wait(0.2)
    assert not (tmp_path / "two").exists()
    running.close()
    assert not (tmp_path / "two").exists()


def test_an_item_that_ends_its_process_costs_itself_only_also_where_the_next_was_asked_for_already(free_cores):
    for ends in ("aborts", "vanishes", "kills"):
        began = time.monotonic()
        found = list(Processes(1).each(work, ["fine", ends, "fine", ends, "prints"]))
        assert [(item, type(outcome) is Crashed) for item, outcome in found] == [
            ("fine", False), (ends, True), ("fine", False), (ends, True), ("prints", False),
        ]  # fmt: skip
        assert time.monotonic() - began < 20


def was_ready(item):
    return READY.get(item) == os.getpid()


READY: dict[int, int] = {}


def _get_ready(item):
    if item == 1:
        sys.exit("nobody is to hear of this")
    if item == 2:
        os._exit(3)
    READY[item] = os.getpid()


was_ready.ready = _get_ready


def test_a_process_gets_ready_for_its_item_before_it_is_asked_and_what_goes_wrong_then_costs_none(one_free_core):
    outcomes = dict(Isolated(1, LIMITS).each(partial(was_ready), range(5)))
    # Nobody is there before the first; the third's process has ended, another one is asked without further ado.
    assert outcomes == {0: False, 1: False, 2: False, 3: True, 4: True}
    assert not READY, "it is the item's process that gets ready, not this one"
