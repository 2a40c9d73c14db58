"""Which samples of a force are new, and which are looked at although they are not."""

import numpy as np

from tactbench.devices.force_watch import ForceWatch
from tactbench.devices.guard_messages import Trigger
from tactbench.plugin import Block
from tactbench.rigs.parallel_manipulator.force_torque.net_ft.codec import NetFtOptions
from tests.rigs.parallel_manipulator.presses import FAULTS

LIMITS = FAULTS.Setting().limits
TOUCH_N = 0.1


class Watched:
    """A watch over a stream, a millisecond a call."""

    def __init__(self):
        self.watch = ForceWatch(NetFtOptions(counts_per_newton=1.0, counts_per_newton_metre=1.0).stream)
        self.now_ns = 0

    def take(self, *samples):
        """Take (number, fz) in one block; a number of None: the device counts nothing."""
        self.now_ns += 1_000_000
        numbers = [number for number, _ in samples]
        data = np.zeros((len(samples), 6))
        data[:, 2] = [force for _, force in samples]
        block = Block(
            "force_torque", np.full(len(samples), self.now_ns), data, None,
            None if None in numbers else np.array(numbers),
        )  # fmt: skip
        return self.watch.take(block, LIMITS)


def test_a_sample_that_comes_again_is_no_touch_and_no_news():
    watched = Watched()
    watched.take((1, 0.01), (2, 0.02))
    watched.take((3, 0.5), (3, 0.5), (4, 0.03), (3, 0.5))
    assert not watched.watch.touched(TOUCH_N)
    assert (watched.watch.sequence, watched.watch.changed, watched.watch.force_n) == (4, 4, 0.03)
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


def test_a_value_that_stands_still_is_received_and_has_not_changed():
    for numbers in ([4, 5, 6, 7], [None] * 4):
        watched = Watched()
        watched.take(*zip(numbers, (0.01, 0.02, 0.02, 0.02), strict=True))
        found = watched.watch
        assert found.sequence - found.changed == 2
        assert found.age_s(watched.now_ns) == 0.0


def test_so_many_equal_samples_in_a_row_are_a_stuck_sensor_and_one_fewer_is_none():
    watched = Watched()
    watched.take((1, 0.01))
    for number in range(2, LIMITS.same_samples + 1):
        assert watched.take((number, 0.02)) is None
    assert watched.take((LIMITS.same_samples + 1, 0.02))[0] is Trigger.FORCE_STUCK
