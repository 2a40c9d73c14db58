"""Drivers of somebody else's that go wrong once the sensor is pressed."""

import numpy as np

from tactbench.rigs.parallel_manipulator.net_ft.driver import NetFtDriver


class NanDriver(NetFtDriver):
    """Above 1 N gives NaN in a channel that is not the pressing one."""

    def read(self, timeout_s):
        blocks = super().read(timeout_s)
        for block in blocks:
            block.data[block.data[:, 2] > 1.0, 0] = np.nan
        return blocks


class RaisingDriver(NetFtDriver):
    """Above 0.1 N raises what no driver should."""

    def read(self, timeout_s):
        blocks = super().read(timeout_s)
        if any((block.data[:, 2] > 0.1).any() for block in blocks):
            raise ZeroDivisionError("a driver's own error")
        return blocks
