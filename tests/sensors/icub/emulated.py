"""Emulated boards at the far end of a link: in virtual time, and on buses in real time."""

from __future__ import annotations

import os
import select
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from tactbench.plugin.devices import (
    CanFrame,
    CanLink,
    DeviceEmulator,
    DriverSettings,
    EmulatorSettings,
    Link,
    LinkTimeout,
    Senses,
    open_link,
)
from tactbench.sensors.icub.channels import STREAMS
from tactbench.sensors.icub.driver import FingertipDriver, build
from tactbench.sensors.icub.emulator import Bus, build_emulator
from tests.links.ends import Pty

NAMES = [channel.name for channel in STREAMS[0].channels]


def rising(now_s: float) -> Mapping[str, float]:
    """Counts that tell taxels and times apart: they fall by one in 20 ms."""
    return {name: 200.0 - number - (int(50 * now_s + 0.25) % 100) for number, name in enumerate(NAMES)}


def emulator(senses: Senses = rising, faults: tuple[str, ...] = (), **options: Any) -> Bus:
    return build_emulator(EmulatorSettings(senses, np.random.default_rng(1), options, faults))


class VirtualLink(CanLink):
    """A bus whose time goes on while somebody waits for it."""

    def __init__(self, bus: DeviceEmulator) -> None:
        super().__init__("can://emulated", self.now_ns)
        self.bus = bus
        self.now_s = 0.0
        self.seen: list[CanFrame] = []
        """All frames on the bus, in order, with their times."""
        self._waiting: deque[CanFrame] = deque()

    def now_ns(self) -> int:
        return round(1e9 * self.now_s)

    def put(self, frame: CanFrame) -> None:
        """Let somebody else on the bus send a frame now."""
        frame = CanFrame(frame.id, frame.data, frame.extended, self.now_ns())
        self.seen.append(frame)
        self._waiting.append(frame)

    def receive(self, timeout_s: float) -> CanFrame:
        self._usable(timeout_s)
        until_s = self.now_s + timeout_s
        while not self._waiting:
            due_s = self.bus.next_s()
            if due_s > until_s:
                self.now_s = until_s
                raise self._nothing_came(timeout_s)
            self.now_s = max(self.now_s, due_s)
            self._take(self.bus.poll(self.now_s))
        return self._waiting.popleft()

    def send(self, frame: CanFrame) -> None:
        self._usable()
        self.seen.append(CanFrame(frame.id, frame.data, frame.extended, self.now_ns()))
        self._take(self.bus.feed(frame, self.now_s))

    def _take(self, sent: Any) -> None:
        frames = [frame for _, frame in sent]
        self.seen += frames
        self._waiting += frames

    def _release(self) -> None:
        pass


def in_virtual_time(
    senses: Senses = rising, faults: tuple[str, ...] = (), **options: Any
) -> tuple[FingertipDriver, VirtualLink]:
    link = VirtualLink(emulator(senses, faults, **options))
    return build(DriverSettings(lambda: link, STREAMS, options, link.now_ns)), link


class FarEnd(Protocol):
    """Where an emulator speaks to a bus."""

    def receive(self, timeout_s: float) -> CanFrame: ...

    def send(self, frame: CanFrame) -> None: ...


def serve(bus: DeviceEmulator, far: FarEnd, stop: threading.Event) -> None:
    """Let an emulator speak in real time until `stop` is set or the link is closed."""
    while not stop.is_set():
        sent = []
        try:
            wait_s = min(max(bus.next_s() - time.monotonic(), 0.0), 0.05)
            sent += bus.feed(far.receive(wait_s), time.monotonic())
        except LinkTimeout:
            pass
        for _, frame in [*sent, *bus.poll(time.monotonic())]:
            far.send(frame)


@contextmanager
def served(bus: DeviceEmulator, far: FarEnd) -> Iterator[None]:
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(bus, far, stop))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


class LawicelAdapter:
    """A CAN adapter with Lawicel's commands behind a pseudo-terminal; it answers none of them, python-can asks none."""

    def __init__(self, port: Pty) -> None:
        self._port = port
        self._buffer = b""

    def receive(self, timeout_s: float) -> CanFrame:
        until_s = time.monotonic() + timeout_s
        while True:
            line, end, rest = self._buffer.partition(b"\r")
            if end:
                self._buffer = rest
                if line[:1] == b"t":
                    return CanFrame(int(line[1:4], 16), bytes.fromhex(line[5:].decode())[: int(line[4:5])])
                continue
            wait_s = max(0.0, until_s - time.monotonic())
            if not select.select([self._port.master], [], [], wait_s)[0]:
                raise LinkTimeout("no command")
            self._buffer += os.read(self._port.master, 4096)

    def send(self, frame: CanFrame) -> None:
        os.write(self._port.master, f"t{frame.id:03X}{len(frame.data)}{frame.data.hex().upper()}\r".encode())


def driver_on(address: str, **options: Any) -> FingertipDriver:
    def opened() -> Link:
        return open_link(address)

    return build(DriverSettings(opened, STREAMS, options))
