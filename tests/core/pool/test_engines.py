"""What all engines promise: one answer an item, whatever the item does."""

import os
import signal
import subprocess
import sys
import time
from functools import partial

import pytest

from tactbench.core.errors import Crashed, NotApplicable, OutOfMemory, Raised, TimedOut
from tactbench.core.pool.in_process import InProcess
from tactbench.core.pool.limits import Limits
from tactbench.core.pool.pool import Pool as EitherPool
from tests.core.pool.works import work

Pool = partial(EitherPool, fork=True)  # the clock of a test's timeout is a thread

LIMITS = Limits(timeout_s=1.0, memory_mb=64)
PATIENT = Limits(timeout_s=60.0, memory_mb=64)
"""For items that do not hang: a busy machine is no fault of theirs."""


def guards(limits):
    return {
        "isolated": Pool(1, limits),
        "isolated-3": Pool(3, limits),
        "reused": Pool(1, limits, reuse=True),
        "reused-2": Pool(2, limits, reuse=True),
    }


GUARDED, HURRIED = guards(PATIENT), guards(LIMITS)
EVERY = {"in-process": InProcess(PATIENT), **GUARDED}


@pytest.fixture(params=GUARDED)
def guarded(request):
    return GUARDED[request.param]


@pytest.fixture(params=EVERY)
def engine(request):
    return EVERY[request.param]


def outcomes(engine, *whats):
    """Return what came of each; every item must come once."""
    found = list(engine.each(work, whats))
    assert sorted(what for what, _ in found) == sorted(whats)
    return dict(found)


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize(
    ("what", "kind", "says"),
    [
        ("raises", Raised, "ValueError: no such luck"),
        ("exits", Raised, "SystemExit: 3"),
        ("interrupts", Raised, "KeyboardInterrupt"),
        ("refuses", NotApplicable, "not this one Try another."),
        ("aborts", Crashed, "signal 6 (SIGABRT)"),
        ("terminates", Crashed, "signal 15 (SIGTERM)"),
        ("kills", Crashed, "signal 9 (SIGKILL)"),
        ("vanishes", Crashed, "exit code 0"),
        ("eats", OutOfMemory, "more than 64 MB"),
        ("unspeakable", Raised, "cannot be sent as JSON"),
        ("closes", Crashed, "gave no result"),
    ],
)
@pytest.mark.parametrize("name", ["isolated", "reused-2"])
def test_whatever_an_item_does_it_does_to_itself(name, what, kind, says):
    found = outcomes(GUARDED[name], "fine", what, "prints")
    assert (found["fine"], found["prints"]) == ("fine", "printed")
    assert type(found[what]) is kind
    assert says in str(found[what])


@pytest.mark.parametrize(
    ("what", "kind"),
    [("raises", Raised), ("exits", Raised), ("interrupts", Raised), ("hangs", TimedOut),
     ("eats", OutOfMemory), ("refuses", NotApplicable)],
)  # fmt: skip
def test_in_process_everything_short_of_the_processs_end_is_a_result(what, kind):
    hurried = InProcess(LIMITS)
    found = {**outcomes(EVERY["in-process"], "fine", "prints"), **outcomes(hurried, what)}
    assert (found["fine"], found["prints"]) == ("fine", "printed")
    assert type(found[what]) is kind


def test_a_crash_knows_its_signal_and_where_it_was(guarded):
    crash = outcomes(guarded, "aborts")["aborts"]
    assert crash.signal == signal.SIGABRT
    assert "works.py" in crash.traceback_text
    assert "in aborts" in crash.traceback_text
    assert crash.spent_s >= 0


@pytest.mark.parametrize("name", ["isolated-3", "reused-2"])
def test_what_hangs_is_ended_and_told_where_and_what_it_printed(name):
    found = outcomes(HURRIED[name], "hangs", "deaf")  # alone: what does not hang may take longer on a busy machine
    assert [type(late) for late in found.values()] == [TimedOut, TimedOut]
    assert all("longer than 1 s" in str(late) for late in found.values())
    assert found["deaf"].traceback_text == "", "one who hears no signal does not say where it was"
    late = found["hangs"]
    assert "in hangs" in late.traceback_text
    assert late.log.startswith("about to hang\n")
    assert late.spent_s == pytest.approx(1.0, abs=0.9)  # a busy machine looks late, never early
    assert late.spent_s >= 1.0


def test_a_traceback_crosses_the_border_between_processes(guarded):
    error = outcomes(guarded, "raises")["raises"]
    assert error.status == "failed"
    assert 'raise ValueError("no such luck")' in error.traceback_text


def test_what_is_printed_reaches_no_stream_of_ours(engine, capfd):
    outcomes(engine, "prints")
    assert capfd.readouterr() == ("", "")


def test_endless_talk_is_cut_to_its_end(guarded):
    def chatty(what):
        from tactbench.core.pool.log import printed

        work(what)
        return printed()

    ((_, said),) = guarded.each(chatty, ["chatters"])
    assert len(said) == 2**16
    assert said.endswith("the end\n")


@pytest.mark.parametrize("name", [*GUARDED])
def test_who_forks_is_heard_once(name):
    found = list(GUARDED[name].each(work, ["forks", "fine", "forks"]))
    assert sorted(outcome for _, outcome in found) == ["fine", "one", "one"]


def test_in_process_who_forks_is_heard_once():
    code = (
        "from tactbench.core.pool.in_process import InProcess\n"
        "from tests.core.pool.works import work\n"
        "for item, outcome in InProcess().each(work, ['forks', 'fine']):\n"
        "    print(item, outcome, flush=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "forks one\nfine fine\n"


@pytest.mark.parametrize("what", ["leaves", "flees"])
def test_nobody_is_left_behind(guarded, what):
    pid = outcomes(guarded, what, "fine")[what]
    assert isinstance(pid, int)
    assert not alive(pid)


def test_isolated_items_have_a_process_each_and_reused_ones_share():
    pids = [pid for _, pid in Pool(2).each(work, ["whoami"] * 4)]
    assert len(set(pids)) == 4
    assert os.getpid() not in pids
    assert len({pid for _, pid in Pool(1, reuse=True).each(work, ["whoami"] * 4)}) == 1
    assert {pid for _, pid in InProcess().each(work, ["whoami"] * 2)} == {os.getpid()}


def test_no_more_than_jobs_are_at_work_and_items_are_taken_as_there_is_room():
    taken = []

    def items():
        for number in range(6):
            taken.append(number)
            yield number

    ahead = [len(taken) - heard for heard, _ in enumerate(Pool(2).each(lambda item: item, items()))]
    assert max(ahead) <= 3, "two at work, one just heard"
    assert taken == list(range(6))


def test_what_is_prepared_while_an_item_is_taken_its_process_inherits():
    prepared = []

    def items():
        for number in range(3):
            prepared.append(number)
            yield number

    assert dict(Pool(1).each(lambda item: item in prepared, items())) == {0: True, 1: True, 2: True}


def test_no_items_no_processes(engine):
    assert list(engine.each(work, [])) == []


def test_memory_is_counted_beyond_what_is_shared():
    shared = bytearray(100 * 2**20)
    shared[::4096] = b"\1" * len(shared[::4096])

    def reads(item):
        return sum(memoryview(shared)[:: 2**20]) >= 0

    assert dict(Pool(1, Limits(memory_mb=64)).each(reads, [0])) == {0: True}


def test_memory_of_a_child_of_the_cell_counts_even_where_nobody_asks_it():
    def feeds_a_child(item):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(resource.RLIMIT_DATA, (hard, hard))  # the soft guard can be taken off
        if os.fork() == 0:
            work("eats")
        os.wait()

    ((_, outcome),) = Pool(1, Limits(timeout_s=30, memory_mb=256)).each(feeds_a_child, [0])
    assert type(outcome) is OutOfMemory


def test_a_device_has_time_to_be_let_go_of(tmp_path):
    def holds(path):
        try:
            time.sleep(60)
        finally:
            path.write_text("let go")

    path = tmp_path / "device"
    engine = Pool(1, Limits(timeout_s=0.3, grace_s=20.0), reuse=True)
    ((_, outcome),) = engine.each(holds, [path])
    assert type(outcome) is TimedOut
    assert path.read_text() == "let go"


def test_an_iteration_given_up_ends_everybody():
    pids = []

    def told(item):
        os.write(writing, f"{os.getpid()}\n".encode())
        work(item)

    reading, writing = os.pipe()
    running = Pool(2).each(told, ["vanishes", "hangs", "hangs"])
    next(running)
    while len(pids) < 2:
        pids += os.read(reading, 100).split()
    running.close()
    os.close(reading)
    os.close(writing)
    assert not any(alive(int(pid)) for pid in pids)


def test_in_process_the_users_ctrl_c_ends_the_iteration_and_a_plugins_does_not():
    def presses(item):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60)

    def swallows(item):
        try:
            presses(item)
        except BaseException:
            return "never mind"

    for work_here in (presses, swallows):
        with pytest.raises(KeyboardInterrupt):
            list(InProcess().each(work_here, ["item"]))
    ((_, outcome),) = InProcess().each(work, ["interrupts"])
    assert type(outcome) is Raised
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_in_process_leaves_streams_limits_and_alarm_as_they_were(capfd):
    import resource

    before = (sys.stdout, sys.stderr, resource.getrlimit(resource.RLIMIT_DATA), signal.getsignal(signal.SIGALRM))
    outcomes(InProcess(LIMITS), "hangs", "eats", "prints", "raises")
    assert (
        sys.stdout,
        sys.stderr,
        resource.getrlimit(resource.RLIMIT_DATA),
        signal.getsignal(signal.SIGALRM),
    ) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    os.write(1, b"still ours\n")
    assert capfd.readouterr().out == "still ours\n"


def test_children_hear_no_ctrl_c_of_the_terminal(guarded):
    def pressed(item):
        os.kill(os.getpid(), signal.SIGINT)
        return "deaf to it"

    assert dict(guarded.each(pressed, ["item"])) == {"item": "deaf to it"}


def test_errors_of_engines_survive_another_journey():
    import pickle

    error = Crashed("gone", hint="look", signal=6, log="said", traceback_text="where")
    error.spent_s = 2.0
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.signal, again.log, again.traceback_text, again.spent_s, again.status) == (
        "gone look", 6, "said", "where", 2.0, "crashed",
    )  # fmt: skip
