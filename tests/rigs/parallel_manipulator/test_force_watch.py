"""Which samples of a force are new, and which are looked at although they are not."""

import numpy as np

from tactbench.devices.force_watch import ForceWatch
from tactbench.devices.guard_messages import Trigger
from tactbench.plugin import Block
from tactbench.rigs.parallel_manipulator.net_ft.driver import NetFtOptions
from tests.rigs.parallel_manipulator.presses import FAULTS

LIMITS = FAULTS.Setting().limits
TOUCH_N = 0.1


class Watched:
    """A watch over a stream, a millisecond a call."""

    def __init__(self):
        self.watch = ForceWatch(NetFtOptions(counts_per_newton=1.0, counts_per_newton_metre=1.0).stream)
        self.now_ns = 0

    def take(self, *samples):
        """Take (number, fz) in one block."""
        self.now_ns += 1_000_000
        numbers, forces = np.array(samples).T
        data = np.zeros((len(samples), 6))
        data[:, 2] = forces
        times = np.full(len(samples), self.now_ns)
        return self.watch.take(Block("force_torque", times, data, None, numbers.astype(np.int64)), LIMITS)


def test_a_sample_that_comes_again_is_no_touch_and_no_news():
    watched = Watched()
    watched.take((1, 0.01), (2, 0.02))
    watched.take((3, 0.5), (3, 0.5), (4, 0.03), (3, 0.5))
    assert not watched.watch.touched(TOUCH_N)
    assert (watched.watch.received, watched.watch.changed, watched.watch.force_n) == (4, 4, 0.03)
    watched.take((5, 0.5))
    assert watched.watch.touched(TOUCH_N)


def test_a_device_that_sends_its_last_sample_for_ever_grows_old():
    watched = Watched()
    watched.take((7, 0.02))
    for _ in range(12):
        assert watched.take((7, 0.02)) is None
        assert watched.watch.old(watched.now_ns, LIMITS) is None
    watched.take((7, 0.02))
    watched.take((7, 0.02))
    assert watched.watch.old(watched.now_ns, LIMITS)[0] is Trigger.FORCE_OLD
