"""Drivers of somebody else's that go wrong once the sensor is pressed."""

from dataclasses import replace

import numpy as np

from tactbench.rigs.parallel_manipulator.force_torque.net_ft.driver import NetFtDriver


class NanDriver(NetFtDriver):
    """Above 1 N gives NaN in a channel that is not the pressing one."""

    def read(self, timeout_s):
        return [replace(block, data=broken(block.data)) for block in super().read(timeout_s)]


def broken(data):
    return np.where((data[:, 2:3] > 1.0) & (np.arange(data.shape[1]) == 0), np.nan, data)


class RaisingDriver(NetFtDriver):
    """Above 0.1 N raises what no driver should."""

    def read(self, timeout_s):
        blocks = super().read(timeout_s)
        if any((block.data[:, 2] > 0.1).any() for block in blocks):
            raise ZeroDivisionError("a driver's own error")
        return blocks


def build(settings):
    return NanDriver(settings)


def build_raising(settings):
    return RaisingDriver(settings)
