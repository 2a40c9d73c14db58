"""A CAN adapter with Lawicel's commands as a model, with an emulated device on its bus: CAN on a serial line."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tactbench.devices.emulator import DeviceEmulator, Sent
from tactbench.links.can_link import CanFrame

OK, ERROR = b"\r", b"\a"
"""End of an answer, and refusal [sourced: LAWICEL AB, CANUSB manual]."""
_LONGEST = 32
"""Bytes: more than the longest command, an extended frame of eight bytes with 26."""
_FRAME = re.compile(r"(?:[tr]([0-9A-Fa-f]{3})|[TR]([0-9A-Fa-f]{8}))([0-8])([0-9A-Fa-f]*)")
_SETTING = re.compile(r"|S[0-9]|s[0-9A-Fa-f]{4}|Z0")
_SAYS = {"V": b"V1013", "N": b"NEMUL", "F": b"F00"}
"""Versions as in the manual's example; a serial number of its own; no flag of the status."""


class LawicelAdapter:
    """An adapter on a serial line; fed and polled like the device on its bus, with bytes in place of frames.

    Commands [sourced: LAWICEL AB, CANUSB manual]: ``O``, ``L``, ``C`` (open, listen, close), ``Sn``, ``sxxyy`` (bit
    rate), ``t``, ``T`` (data frames), ``r``, ``R`` (remote frames, which the device does not see), ``V``, ``N``
    (version, serial number), ``F`` (status), ``Zn`` (time stamps: 0 only), an empty line. The bus has one device and
    takes frames at once [assumed: its pace is the device's].

    Parameters
    ----------
    device
        What hangs on the bus.
    """

    def __init__(self, device: DeviceEmulator) -> None:
        self._device = device
        self._line = bytearray()
        self._open = self._listening = False

    def feed(self, piece: bytes | CanFrame, now_s: float) -> Sequence[Sent]:
        """Take bytes of the host; return what the host gets by `now_s`, each piece with its second."""
        assert isinstance(piece, bytes)
        sent = list(self.poll(now_s))
        for byte in piece:
            if byte != OK[0]:
                self._line.append(byte)
                del self._line[:-_LONGEST]
                continue
            command, self._line = bytes(self._line), bytearray()
            frames: list[Sent] = []
            sent.append((now_s, self._answer(command, now_s, frames)))
            sent += self._encoded(frames)
        return sent

    def poll(self, now_s: float) -> Sequence[Sent]:
        """Return what the device has put on the bus by `now_s`, as the host gets it; nothing while it is closed."""
        return self._encoded(self._device.poll(now_s))

    def next_s(self) -> float:
        """Return when the device has something to do next."""
        return self._device.next_s()

    def _answer(self, command: bytes, now_s: float, frames: list[Sent]) -> bytes:
        """Carry out one command and return its answer; what the device sends at once goes to `frames`."""
        word = command.decode("ascii", "replace")
        found = _FRAME.fullmatch(word)
        if found is not None:
            short, long, length, digits = found.groups()
            identifier, remote = int(short or long, 16), word[0] in "rR"
            if not self._open or self._listening or identifier >= 1 << (11 if short else 29):
                return ERROR
            if len(digits) != (0 if remote else 2 * int(length)):
                return ERROR
            if not remote:
                frames += self._device.feed(CanFrame(identifier, bytes.fromhex(digits), short is None), now_s)
        elif word in ("O", "L"):
            self._open, self._listening = True, word == "L"
        elif word == "C":
            self._open = False
        elif word in _SAYS:
            return _SAYS[word] + OK
        elif not _SETTING.fullmatch(word):
            return ERROR
        return OK

    def _encoded(self, sent: Sequence[Sent]) -> list[Sent]:
        if not self._open:
            return []
        return [(t_s, _text(frame)) for t_s, frame in sent if isinstance(frame, CanFrame)]


def _text(frame: CanFrame) -> bytes:
    head = f"T{frame.id:08X}" if frame.extended else f"t{frame.id:03X}"
    return f"{head}{len(frame.data)}{frame.data.hex().upper()}".encode("ascii") + OK
