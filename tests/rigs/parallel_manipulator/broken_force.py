"""A driver of somebody else's, whose forces are no numbers once the sensor is pressed by a newton."""

from dataclasses import replace

import numpy as np

from tactbench.rigs.parallel_manipulator.force_torque.net_ft.driver import NetFtDriver


class BrokenDriver(NetFtDriver):
    """Gives NaN in one channel that is not the pressing one."""

    def read(self, timeout_s):
        return [replace(block, data=broken(block.data)) for block in super().read(timeout_s)]


def broken(data):
    return np.where((data[:, 2:3] > 1.0) & (np.arange(data.shape[1]) == 0), np.nan, data)


def build(settings):
    return BrokenDriver(settings)
