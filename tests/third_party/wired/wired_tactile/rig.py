"""Records what the pad sends, for as long as the scene lasts."""

import time
from contextlib import contextmanager
from functools import partial

from tactbench.plugin.devices import DriverSettings, open_link
from wired_tactile.driver import build


class WiredRig:
    reference = plan = ()

    def __init__(self, context):
        self.assumptions = self.drawn = {}

    @contextmanager
    def open(self, sensor, scene, *, seed):
        with build(DriverSettings(partial(open_link, "loop://"))) as self._driver:
            self.streams = self._driver.streams
            self._seconds = scene.profile.duration.to("s")
            yield self

    def __iter__(self):
        self._driver.start()
        until_s = time.monotonic() + self._seconds
        while (left_s := until_s - time.monotonic()) > 0:
            yield from self._driver.read(left_s)
