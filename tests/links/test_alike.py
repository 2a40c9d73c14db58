"""Links of all kinds open, end and fail alike."""

from __future__ import annotations

import itertools
import os
import time
from pathlib import Path

import pytest

from tactbench.core.errors import LinkClosed
from tactbench.plugin.devices import CanFrame, LinkTimeout, LinkUnplugged
from tests.links.ends import ENDS

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")


@pytest.fixture(params=ENDS)
def end(request):
    ticks = itertools.count(1000)
    with ENDS[request.param](lambda: next(ticks)) as end:
        yield end


def test_stamps_come_from_the_clock_given(end):
    end.say()
    first = end.link.receive(5.0)
    end.say()
    second = end.link.receive(5.0)
    if isinstance(first, CanFrame):  # its age by the system's clock is taken off a clock that only counts calls
        assert max(first.t_ns, second.t_ns) < 1100
    else:
        assert 1000 <= first.t_ns < second.t_ns < 1100


@pytest.mark.parametrize("timeout_s", [0, 0.05])
def test_nothing_in_time_is_a_timeout_and_the_link_lives_on(end, timeout_s):
    begin_s = time.monotonic()
    with pytest.raises(LinkTimeout, match=f"within {timeout_s:g} s"):
        end.link.receive(timeout_s)
    # 1 ms: waits of the system's are rounded to its ticks.
    assert time.monotonic() - begin_s >= timeout_s - 1e-3
    end.say()
    assert end.link.receive(5.0).data


def test_closing_twice_is_closing_once_and_then_nothing_works(end):
    end.link.close()
    end.link.close()
    for call in (lambda: end.link.receive(0), end.tell):
        with pytest.raises(LinkClosed, match="is closed"):
            call()


def test_unplugged_is_said_each_time_until_closed(end):
    if end.unplug is None:
        pytest.skip("it has no far end that could go away")
    end.unplug()
    for call in (lambda: end.link.receive(5.0), lambda: end.link.receive(0), end.tell):
        with pytest.raises(LinkUnplugged, match="is gone"):
            call()
    end.link.close()
    with pytest.raises(LinkClosed):
        end.link.receive(0)


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("unplugged", [False, True])
def test_closing_gives_everything_back(name, unplugged):
    if not Path("/proc/self/fd").is_dir():
        pytest.skip("this system does not list a process's open files")

    def use():
        with ENDS[name](time.monotonic_ns) as end:
            if unplugged and end.unplug is not None:
                end.unplug()
                with pytest.raises(LinkUnplugged):
                    end.link.receive(5.0)

    use()  # what libraries open once
    before = len(list(Path("/proc/self/fd").iterdir()))
    use()
    assert len(list(Path("/proc/self/fd").iterdir())) == before
