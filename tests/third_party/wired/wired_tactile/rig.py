"""Records what the pad at WIRED_LINK sends, for as long as the scene lasts."""

import os
import time
from contextlib import contextmanager
from functools import partial

from tactbench.plugin.devices import DriverSettings, open_link
from wired_tactile.driver import build


class WiredRig:
    reference = plan = ()

    def __init__(self, context):
        self.assumptions = self.drawn = {}
        self._link = os.environ.get("WIRED_LINK", "loop://")

    @contextmanager
    def open(self, sensor, scene, *, seed):
        with build(DriverSettings(partial(open_link, self._link))) as self._driver:
            self.streams = self._driver.streams
            self._seconds = scene.profile.duration.to("s")
            yield self

    def __iter__(self):
        self._driver.start()
        until_s = time.monotonic() + self._seconds
        while (left_s := until_s - time.monotonic()) > 0:
            yield from self._driver.read(left_s)
