"""A retreat without a driver: for whoever finds the motor's line with nobody at it."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from tactbench.plugin import UsageError
from tactbench.plugin.devices import ByteLink, Clock, Link, LinkClosed, LinkError, LinkTimeout
from tactbench.rigs.parallel_manipulator.motor.codec import LONGEST_ANSWER, Kind, LineReader, encode, line_time_s
from tactbench.rigs.parallel_manipulator.motor.exchange import HOST_S
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions

OPEN_S = 1.0
"""For so long a port is tried that is still held (assumed; free 5 ms after its holder was killed, measured elsewhere,
docs/hardware.md)."""
AGAIN_S = 0.25
"""After which it is sent once more where the motor does not come nearer (assumed)."""


def retreat_command(options: FaulhaberOptions) -> bytes:
    """Return the bytes of a retreat: speed, place, start; the same wherever the motor is.

    Raises
    ------
    UsageError
        If the options name no place or no speed.
    RigError
        If the drive does not have that speed.
    """
    if options.retreat_m is None or options.retreat_speed_m_s is None:
        raise UsageError("The motor has no place to retreat to.", hint="Give retreat_m and retreat_speed_m_s.")
    profile = options.profile()
    parts = [
        ("SP", profile.speed(options.retreat_speed_m_s)),
        ("LA", profile.increments(options.retreat_m)),
        ("M", None),
    ]
    return b"".join(encode(name, argument, node=options.node) for name, argument in parts)


def retreat_blind(open_link: Callable[[], Link], options: FaulhaberOptions, clock: Clock, within_s: float) -> float:
    """Open the motor's line, let it retreat, and watch it do so; return the position at the end [m].

    The drive keeps its positions and whether it acknowledges; nothing else is assumed of what stood on the line. What
    half a command may stand there is ended first, so that the first answer may be a refusal.

    Parameters
    ----------
    open_link
        Opens the line; tried again for a second while somebody holds it.
    options
        Of the drive.
    clock
        Of the link.
    within_s
        The time for the way.

    Raises
    ------
    LinkError
        If the line cannot be opened, or is gone: nothing is known then.
    LinkTimeout
        If the motor does not say that it is there in time.
    """
    command, target_m = retreat_command(options), options.retreat_m
    assert target_m is not None
    began_ns = clock()
    link = _opened(open_link, clock, began_ns + round(1e9 * OPEN_S))
    profile = options.profile()
    near_m = max(options.corridor_m or 0.0, 2.0 * profile.position_m(1))
    answer_s = 3.0 * line_time_s(LONGEST_ANSWER, options.baud) + HOST_S
    reader, there = LineReader(), 0
    place_m: float | None = None
    nearest_m: float | None = None
    with link:
        link.write(b"\r" + command)
        sent_ns = clock()
        deadline = began_ns + round(1e9 * within_s)
        while clock() < deadline:
            link.write(encode("POS", node=options.node))
            requested_ns, place_m = clock(), None
            while place_m is None and clock() - requested_ns < 1e9 * answer_s:
                with suppress(LinkTimeout):
                    for line in reader.feed(link.read(answer_s).data):
                        if line.kind is Kind.VALUE:
                            place_m = profile.position_m(line.value)
            there = there + 1 if place_m is not None and abs(place_m - target_m) <= near_m else 0
            if there == 2 and place_m is not None:  # One could be the late answer to another question.
                return place_m
            nearer = place_m is not None and (nearest_m is None or abs(place_m - target_m) < nearest_m)
            if nearer:
                assert place_m is not None
                nearest_m, sent_ns = abs(place_m - target_m), clock()
            elif not there and clock() - sent_ns > 1e9 * AGAIN_S:
                link.write(b"\r" + command)
                sent_ns = clock()
    where = "does not say where it is" if place_m is None else f"is at {place_m:g} m"
    raise LinkTimeout(
        f"The motor was told to retreat to {target_m:g} m, and {where} {within_s:.1f} s later.",
        hint="Stand clear, cut its supply, and see what is in its way.",
    )


def _opened(open_link: Callable[[], Link], clock: Clock, until_ns: int) -> ByteLink:
    while True:
        try:
            link = open_link()
        except LinkClosed:
            raise
        except LinkError:
            if clock() > until_ns:
                raise
            time.sleep(1e-3)
            continue
        if not isinstance(link, ByteLink):
            link.close()
            raise UsageError(f"The motor cannot be spoken to through {link.address}.")
        return link


def stand_blind(open_link: Callable[[], Link], options: FaulhaberOptions, clock: Clock) -> None:
    """Open the motor's line and let it stand, under control of its speed: for a motor whose place is not known.

    Raises
    ------
    LinkError
        If the line cannot be opened, or does not take it.
    """
    with _opened(open_link, clock, clock() + round(1e9 * OPEN_S)) as link:
        link.write(b"\r" + encode("V", 0, node=options.node))
