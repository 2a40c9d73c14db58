"""``tactbench doctor --jog``: move one axis of a rig by small steps, while the force is monitored and shown."""

from __future__ import annotations

import math
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.errors import RigError, TactbenchError, UsageError
from tactbench.core.plugins.registry import Registry, load_object
from tactbench.core.spec.rig_file import FORCE, ForceEntry, RigFile
from tactbench.core.tables.terminal import remark
from tactbench.devices.driver import Driver
from tactbench.devices.emulation.virtual_time import EmulatedDevices
from tactbench.devices.force_watch import ForceWatch
from tactbench.devices.guard_messages import Limits
from tactbench.devices.positioner import Positioner
from tactbench.devices.rig_devices import PressingForce, drivers_of

if TYPE_CHECKING:
    from tactbench.core.plugins.interfaces import RigCheck
    from tactbench.links.link import Clock

STEP_M, LONGEST_M, SPEED_M_S = 0.1e-3, 1e-3, 1e-3
"""Step of `+` and `-` [m]; longest step [m]; speed [m/s] (assumed: slow enough to reach the emergency stop)."""
LOOK_S, OLD_S = 2e-3, 0.1
"""Longest wait for a force sample, and largest age of a sample [s] (assumed: three samples of a slow sensor)."""


def jog_axis(rig: RigFile | None, would: RigCheck | None, registry: Registry, name: str) -> None:
    """Open an axis and the force sensor of a checked rig file, and move the axis by commands typed at a terminal.

    Raises
    ------
    UsageError
        If there is no rig file, no such axis in it, or no force sensor.
    LinkError, RigError
        If axis or force sensor does not answer, or fails.
    """
    file = would.file if would else None
    if rig is None or file is None or would is None or file.force is None or name not in file.devices:
        known = ", ".join(file.devices) if file and file.force else "none with a force sensor"
        raise UsageError(f"No rig file has an axis {name!r}.", hint=f"Axes in --rig-file: {known}.")

    clock: Clock = time.monotonic_ns
    with ExitStack() as stack:
        links: dict[str, Any] = {}
        if file.checked_for_one_clock().emulated:
            emulators = load_object(registry.rigs[file.rig].emulators or "")(rig, registry)
            devices = stack.enter_context(EmulatedDevices(emulators.devices))
            clock, links = devices.clock, {one: devices.opener(one) for one in emulators.devices}
        drivers = drivers_of(file, registry, next(iter(file.sensors)), links, clock, (name, FORCE))
        for driver in drivers.values():
            stack.callback(driver.close)
        axis = drivers[name]
        if not isinstance(axis, Positioner):
            raise UsageError(f"The device {name} is not an axis.", hint="Give an axis of the rig after --jog.")
        move_by_steps(name, axis, drivers[FORCE], file.force, would.travel_ceiling_n)


def move_by_steps(name: str, axis: Positioner, force: Driver, entry: ForceEntry, ceiling_n: float) -> None:
    """Take the force's zero, home the axis if needed, and move it by the operator's answers until an empty answer.

    The axis halts if the norm of the force reaches `ceiling_n`, or if the force is not known; after that only a step
    back is carried out.
    """
    clock, pressing = axis.clock, PressingForce(entry, force.streams)
    for device in (force, axis):
        device.identify()
        device.start()
    (stream,) = force.streams
    watch, until_ns, blocks = ForceWatch(stream), clock() + round(1e9 * max(entry.zero_s, OLD_S)), []
    while clock() < until_ns:
        blocks += force.read(LOOK_S)
        axis.update(0.0)
    pressing.take_zero(blocks)
    limits = Limits(
        force_ceiling_n=ceiling_n, travel_ceiling_n=ceiling_n, touch_n=ceiling_n / 2, travel_m=axis.facts.limits,
        step_m=LONGEST_M, speed_m_s=SPEED_M_S, heartbeat_s=OLD_S, force_age_s=OLD_S, channel=pressing.column,
        sign=pressing.sign, zero=tuple(pressing.zero.tolist()),
        same_samples=10**9 if entry.emulated else Limits.same_samples,  # an emulated sensor at rest has no noise
    )  # fmt: skip

    back = 0

    def look(since_ns: int = 0) -> str:
        """Read axis and force until a force sample from after `since_ns`; return the problem of the force, if any."""
        problem, until_ns = None, clock() + round(1e9 * OLD_S)
        while True:
            axis.update(0.0)
            found = [watch.take(block, limits, travelling=True) for block in force.read(LOOK_S)]
            problem = next(filter(None, found), None)
            if problem or watch.t_ns >= since_ns or clock() > until_ns:
                return ": ".join(problem or watch.old(clock(), limits) or ())

    def answer_to(text: str) -> str:
        """Return the answer to a prompt; the force samples received while it was shown are dropped."""
        nonlocal watch
        answer = str(click.prompt(text, default="", show_default=False, prompt_suffix="", err=True)).strip()
        force.stop()
        force.start()
        watch = ForceWatch(stream)
        return answer

    def move(step_m: float) -> None:
        """Carry out a step if the force permits it or the step leads back; halt at a problem with the force."""
        nonlocal back
        way = int(math.copysign(1, step_m))
        if (wrong := look(clock())) and way != back:
            raise RigError(f"The axis moves no further in this direction: {wrong}.", hint="Move it back.")
        most_n, halted = abs(watch.force_n) + ceiling_n, ""
        axis.move_to(axis.position + step_m, min(SPEED_M_S, axis.facts.speed))
        while axis.moving:
            wrong = look()
            if wrong and not halted and (way != back or not abs(watch.force_n) < most_n):
                axis.halt()
                halted = wrong
        back = -way
        if halted:
            remark(f"The {name} was halted: {halted}")

    try:
        if not (axis.homed or axis.find_home()):
            clear = "Is it clear of the sensor, and the emergency stop within reach? Type yes to home it. "
            if answer_to(f"The {name} is not homed. {clear}") != "yes":
                return
            axis.home(lambda: bool(look()))
        if not axis.enabled:
            axis.enable()
        while True:
            wrong = look(clock())
            where = f"{name} at {1e3 * axis.position:.3f} mm, {watch.force_n:+.3f} N{f' ({wrong})' if wrong else ''}"
            answer = answer_to(f"{where}. + or -: {1e3 * STEP_M:g} mm; a number: step in mm; Enter alone: end. ")
            if not answer:
                return
            try:
                step_m = {"+": STEP_M, "-": -STEP_M}.get(answer) or 1e-3 * float(answer)
                if not abs(step_m) <= LONGEST_M:
                    raise UsageError(f"A step of {answer} mm is longer than the permitted {1e3 * LONGEST_M:g} mm.")
                move(step_m)
            except ValueError:
                remark(f"{answer!r} is neither + nor - nor a number of mm.")
            except TactbenchError as error:
                remark(str(error))
    finally:
        if axis.moving:
            axis.halt()
