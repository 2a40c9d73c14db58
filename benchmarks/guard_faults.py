"""Presses on a spring through the guard of the linear motor, with faults drawn at random, in virtual time.

    python benchmarks/guard_faults.py [SCHEDULES [SEED]]

Each schedule presses once and has one fault or two at random moments: of the rig (hangs, wrong or forbidden beats), of
the force sensor and its network, of the motor, its drive and its line. After it: the largest force that the spring saw,
the state of the guard, whether the motor is out. A schedule that takes longer than its virtual time has hung.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tactbench.devices.emulation.real_time import RealTimeDevices
from tactbench.devices.guard_messages import GuardRefusesError, Report, Trigger
from tactbench.plugin.devices import (
    Beat,
    CommandKind,
    DriverSettings,
    EmulatedDevice,
    EmulatedDevices,
    EmulatorSettings,
    Guard,
    GuardState,
    Limits,
    LocalGuard,
)
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver
from tactbench.rigs.parallel_manipulator.motor.emulator import MotorEmulator, MotorFault
from tactbench.rigs.parallel_manipulator.net_ft.driver import AXES, NetFtDriver
from tactbench.rigs.parallel_manipulator.net_ft.emulator import DatagramFault, RdtEmulator

RETREAT_M, SKIN_M = -5e-3, 0.0
"""The motor stands at the first when it is switched on; the spring begins at the second."""
NOISE_N = 5e-3
COUNTS = {"counts_per_newton": 1e6, "counts_per_newton_metre": 1e6}
STATED: dict[str, Any] = {
    "lower_m": -6e-3,
    "upper_m": 3e-3,
    "speed_m_s": 0.02,
    "acceleration_m_s2": 1.0,
    "corridor_m": 2e-6,
    "increment_m": 1e-6,
    "peak_current_a": 1.6,
    "homing": "here",
    "home_m": RETREAT_M,
    "retreat_m": RETREAT_M,
    "retreat_speed_m_s": 0.05,
    "orientation": "horizontal",
}


@dataclass(frozen=True)
class Setting:
    """One press."""

    baud: int = 115200
    stiffness_n_m: float = 20e3
    period_s: float = 20e-3
    ceiling_n: float = 6.0
    setpoint_n: float = 5.0
    seed: int = 1
    force_age_s: float = 13e-3
    same_samples: int = 50
    heartbeat_s: float | None = None
    """None: three periods, and 30 ms at least."""
    time: Literal["virtual", "real"] = "virtual"

    @property
    def limits(self) -> Limits:
        """Of its guard."""
        return Limits(
            force_ceiling_n=self.ceiling_n,
            travel_ceiling_n=0.2,
            torque_ceiling_nm=0.2,
            touch_n=0.1,
            clear_n=0.05,
            clear_s=20e-3,
            confirmed=True,
            travel_m=(-5.5e-3, 2e-3),
            step_m=0.25 / self.stiffness_n_m,
            speed_m_s=0.02,
            heartbeat_s=self.heartbeat_s or max(3 * self.period_s, 30e-3),
            force_age_s=self.force_age_s,
            same_samples=self.same_samples,
            channel=2,
            sign=1,
            zero=(0.0,) * 6,
        )

    @property
    def allowed_n(self) -> float:
        """What the step rule promises, and five times the noise."""
        limits = self.limits
        return float(limits.force_ceiling_n + self.stiffness_n_m * (limits.step_m + STATED["corridor_m"]) + 5 * NOISE_N)


class ListeningMotor(MotorEmulator):
    """Keeps what it is told, each piece with its second."""

    def __init__(self, *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        self.told: list[tuple[float, bytes]] = []

    def feed(self, piece: Any, now_s: float) -> Any:
        """Take what came from the host."""
        self.told.append((now_s, piece))
        return super().feed(piece, now_s)


class Pressed:
    """A motor in front of a spring, a force sensor behind it, both emulated, and what they have been through.

    Attributes
    ----------
    largest_n
        That the spring has seen, at each tick of the motor.
    sensed
        Changes what the force sensor reads: called with (six numbers, second).
    """

    def __init__(self, setting: Setting, **faults: list[Any]) -> None:
        # Emulators share the machine with whom they serve: in real time they are coarser, so as not to be late.
        self.rate_hz = 250.0 if setting.time == "real" else 1000.0
        self.setting = setting
        self.largest_n = 0.0
        self._places: deque[tuple[float, float]] = deque(maxlen=20_000)
        self.sensed: Callable[[list[float], float], list[float]] = lambda wrench, at_s: wrench
        rng = np.random.default_rng(setting.seed)
        own = np.random.default_rng(setting.seed + 1)
        self.motor = ListeningMotor(EmulatorSettings(lambda at_s: {}, own, {**STATED, "baud": setting.baud}))
        self.motor.press_against(self._load)
        self.motor.faults = faults.get("motor", [])

        def wrench(at_s: float) -> list[float]:
            self._places.append((at_s, self.position_m))
            pressing = self.force_n + rng.normal(0, NOISE_N)
            return self.sensed([*rng.normal(0, NOISE_N, 2), pressing, *rng.normal(0, 1e-4, 3)], at_s)

        options = {**COUNTS, "rate_hz": self.rate_hz}
        self.force = RdtEmulator(
            EmulatorSettings(lambda at_s: dict(zip(AXES, wrench(at_s), strict=True)), rng, options)
        )
        self.force.faults = faults.get("force", [])
        devices = {
            "motor": EmulatedDevice("bytes", self.motor, tuple(faults.get("motor_link", ()))),
            "force": EmulatedDevice("datagram", self.force, tuple(faults.get("force_link", ()))),
        }
        self.devices = RealTimeDevices(devices) if setting.time == "real" else EmulatedDevices(devices)
        self.clock = self.devices.clock

    @property
    def position_m(self) -> float:
        """Of the motor, as its drive counts it."""
        return float(self.motor.position_m)

    @property
    def force_n(self) -> float:
        """On the spring now."""
        force = self.setting.stiffness_n_m * max(0.0, self.position_m - SKIN_M)
        self.largest_n = max(self.largest_n, force)
        return force

    def deepest_m(self, since_s: float) -> float:
        """Return the deepest place of the motor at any force sample since a second of the clock."""
        return max((place for at_s, place in self._places if at_s >= since_s), default=-math.inf)

    def _load(self, place_m: float) -> float:
        return self.setting.stiffness_n_m * max(0.0, place_m - SKIN_M)

    def settings(self) -> dict[str, dict[str, Any]]:
        """Return the options of both devices."""
        return {"motor": {**STATED, "baud": self.setting.baud}, "force": {**COUNTS, "rate_hz": self.rate_hz}}

    def guard(
        self, force_driver: Callable[[DriverSettings], Any] = NetFtDriver, kept: Path | None = None
    ) -> LocalGuard:
        """Return a guard over drivers of both, in this process."""
        options = self.settings()
        motor = FaulhaberDriver(
            DriverSettings(self.devices.opener("motor"), options=options["motor"], clock=self.clock)
        )
        force = force_driver(DriverSettings(self.devices.opener("force"), options=options["force"], clock=self.clock))
        return LocalGuard({"motor": motor}, force, self.clock, self.devices.advance, kept=kept)


@dataclass
class Press:
    """A rig that presses: approach, steps to a force, hold, out; a beat a period.

    Attributes
    ----------
    change
        Called with each beat before it is sent; may return another one, or None: no beat.
    """

    guard: Guard
    setting: Setting
    clock: Callable[[], int]
    change: Callable[[Beat, float], Beat | None] = lambda beat, since_s: beat
    hold_s: float = 0.4
    phase: str = "approach"
    reports: list[Report] = field(default_factory=list)
    sequence: int = 0
    began_ns: int = 0
    _held_s: float = 0.0

    def run(self, most_s: float = 8.0) -> Report:
        """Press until it is over, or the guard is no longer armed; return the last report."""
        self.began_ns = self.clock()
        last = self.guard.arm(self.setting.limits)
        self.reports.append(last)
        began_ns = due_ns = self.clock()
        while self.phase != "over" and self.clock() - began_ns < 1e9 * most_s:
            self.sequence += 1
            since_s = 1e-9 * (self.clock() - began_ns)
            beat = self.change(self._beat(last), since_s)
            if beat is not None:
                last = self.guard.beat(beat)
                self.reports.append(last)
                self._go_on(last)
            if last.state is not GuardState.ARMED:
                break
            due_ns += round(1e9 * self.setting.period_s)
            self.guard.advance(due_ns)
        return last

    def _beat(self, last: Report) -> Beat:
        limits = self.setting.limits
        beat = Beat(self.clock(), self.phase, force_sequence=last.force_sequence)
        match self.phase:
            case "approach" if not last.moving:
                return replace(beat, command=CommandKind.MOVE_TO, position_m=SKIN_M - 0.1e-3, speed_m_s=0.02)
            case "touch" | "ramp" | "hold":
                missing = (0.2 if self.phase == "touch" else self.setting.setpoint_n) - last.force_n
                wish = 0.3 * missing / self.setting.stiffness_n_m if self.phase != "touch" else limits.step_m
                return replace(beat, command=CommandKind.STEP, distance_m=min(max(wish, -limits.step_m), limits.step_m))
            case "unload" if not last.moving:
                return replace(beat, command=CommandKind.MOVE_TO, position_m=RETREAT_M, speed_m_s=0.02)
        return beat

    def _go_on(self, last: Report) -> None:
        at_rest = not last.moving
        if self.phase == "approach" and at_rest and abs(last.position_m - (SKIN_M - 0.1e-3)) < 1e-5:
            self.phase = "touch"
        elif self.phase == "touch" and last.force_n > 0.1:
            self.phase = "ramp"
        elif self.phase == "ramp" and last.force_n > 0.97 * self.setting.setpoint_n:
            self.phase, self._held_s = "hold", 0.0
        elif self.phase == "hold":
            self._held_s += self.setting.period_s
            if self._held_s > self.hold_s:
                self.phase = "unload"
        elif self.phase == "unload" and at_rest and abs(last.position_m - RETREAT_M) < 1e-5:
            self.phase = "over"


# Faults ---------------------------------------------------------------------------------------------------------------

FORCE_UNKNOWN = {Trigger.FORCE_OLD, Trigger.FORCE_GAP, Trigger.FORCE_LOST}
SILENT = {Trigger.AXIS_SILENT, Trigger.AXIS_LOST, Trigger.AXIS_FAULT}


@dataclass(frozen=True)
class Kind:
    """A kind of fault, and what it must lead to."""

    where: Literal["rig", "sensed", "motor", "force", "motor_link", "force_link"]
    triggers: set[Trigger]
    text: str = ""
    """Of an emulator's fault, with ``{start}``, ``{end}``."""
    out: bool = True
    """Whether the motor can still retreat."""


KINDS: dict[str, Kind] = {
    "rig hangs": Kind("rig", {Trigger.BEAT_OLD}),
    "steps too long": Kind("rig", {Trigger.COMMANDS_REFUSED}),
    "steps out of travel": Kind("rig", {Trigger.COMMANDS_REFUSED}),
    "steps not numbers": Kind("rig", {Trigger.COMMANDS_REFUSED}),
    "moves too fast": Kind("rig", {Trigger.COMMANDS_REFUSED}),
    "rig wants 30 N": Kind("rig", {Trigger.FORCE_CEILING, Trigger.COMMANDS_REFUSED}),
    "force stuck": Kind("sensed", {Trigger.FORCE_STUCK}),
    "one sample above the ceiling": Kind("sensed", {Trigger.FORCE_CEILING}),
    "one torque above the ceiling": Kind("sensed", {Trigger.TORQUE_CEILING}),
    "saturated": Kind("force", {Trigger.FORCE_SATURATED}, "saturated:start_s={start},end_s={end}"),
    "four samples lost": Kind("force", FORCE_UNKNOWN, "dropped:start_s={start},end_s={four}"),
    "samples out of order": Kind("force", set(), "out-of-order:start_s={start},every=9"),
    "samples doubled": Kind("force", set(), "doubled:start_s={start},every=5"),
    "force unplugged": Kind("force_link", FORCE_UNKNOWN, "unplug:start_s={start}"),
    "force held up": Kind("force_link", FORCE_UNKNOWN, "late:start_s={start},delay_s=0.05"),
    "motor hot": Kind("motor", {Trigger.AXIS_FAULT}, "motor-fault:start_s={start}", out=False),
    "motor hot for a while": Kind("motor", {Trigger.AXIS_FAULT}, "motor-fault:start_s={start},end_s={end}", out=False),
    "motor answers late": Kind("motor_link", SILENT, "late:start_s={start},delay_s=0.25"),
    "motor's lines garbled": Kind(
        "motor", SILENT | {Trigger.COMMANDS_REFUSED},
        "garbled-line:start_s={start},every=11",
    ),
    "motor unplugged": Kind("motor_link", SILENT, "unplug:start_s={start}", out=False),
}  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What became of one schedule."""

    setting: Setting
    faults: tuple[tuple[str, float], ...]
    """Kind, and virtual second."""
    state: GuardState
    trigger: Trigger | None
    phase: str
    largest_n: float
    position_m: float
    virtual_s: float
    """From the first fault to the end of the guard's work."""
    wrong: tuple[str, ...]


def changed(names: Mapping[str, float], setting: Setting, clock: Callable[[], int]) -> Callable[..., Beat | None]:
    """Return what faults of the rig do to its beats; `names` with the second of the clock at which they begin."""

    def change(beat: Beat, _since_s: float) -> Beat | None:
        now_s = 1e-9 * clock()
        on = {name for name, at_s in names.items() if now_s >= at_s}
        if "rig hangs" in on:
            return None
        limits = setting.limits
        if "steps too long" in on:
            return replace(beat, command=CommandKind.STEP, distance_m=3 * limits.step_m)
        if "steps out of travel" in on:
            return replace(beat, command=CommandKind.MOVE_TO, position_m=2.5e-3, speed_m_s=0.01)
        if "steps not numbers" in on:
            return replace(beat, command=CommandKind.STEP, distance_m=math.nan)
        if "moves too fast" in on:
            return replace(beat, command=CommandKind.MOVE_TO, position_m=RETREAT_M, speed_m_s=1.0)
        if "rig wants 30 N" in on and beat.command is not CommandKind.NONE and beat.state != "approach":
            return replace(beat, command=CommandKind.STEP, distance_m=limits.step_m)
        return beat

    return change


def sensed(names: Mapping[str, float]) -> Callable[[list[float], float], list[float]]:
    """Return what faults of the sensor do to what it reads."""
    held: list[list[float]] = []
    once: set[str] = set()

    def change(wrench: list[float], at_s: float) -> list[float]:
        for name, from_s in names.items():
            if at_s < from_s:
                continue
            if name == "force stuck":
                held.append(wrench)
                return held[0]
            if name not in once:
                once.add(name)
                wrench = list(wrench)
                wrench[0 if "ceiling" in name and "torque" not in name else 3] = 20.0 if "torque" not in name else 0.24
        return wrench

    return change


def schedule(setting: Setting, faults: tuple[tuple[str, float], ...]) -> Outcome:
    """Press once with faults at virtual seconds, and see what becomes of it."""
    from tactbench.devices.emulator import LinkFault

    at = dict(faults)
    texts: dict[str, list[Any]] = {"motor": [], "force": [], "motor_link": [], "force_link": []}
    parsers: dict[str, Any] = {
        "motor": MotorFault,
        "force": DatagramFault,
        "motor_link": LinkFault,
        "force_link": LinkFault,
    }
    for name, second in faults:
        kind = KINDS[name]
        if kind.text:
            text = kind.text.format(start=second, end=second + 0.3, four=second + 4.5e-3)
            texts[kind.where].append(parsers[kind.where].parse(text))
    world = Pressed(setting, **texts)
    world.sensed = sensed({name: second for name, second in faults if KINDS[name].where == "sensed"})
    guard = world.guard()
    guard.start()
    press = Press(guard, setting, world.clock, changed(at, setting, world.clock))
    wrong: list[str] = []
    armed = True
    try:
        press.run(20.0)
    except GuardRefusesError:
        armed = False
    # The rig says nothing more, and the guard ends what it does.
    until_ns = world.clock() + round(6e9)
    while guard.state in (GuardState.ARMED, GuardState.RETREATING) and world.clock() < until_ns:
        guard.advance(world.clock() + round(10e6))
    ended_s = 1e-9 * world.clock()
    trigger, state = guard.trigger, guard.state
    kinds = [KINDS[name] for name, _ in faults]
    # A rig that has done its press says no more: that is a fault of its own.
    expected = set().union(*(kind.triggers for kind in kinds))
    expected |= {Trigger.BEAT_OLD} if press.phase == "over" else set()
    if armed and trigger not in expected:
        wrong.append(f"trigger {trigger} not among {sorted(expected)}")
    if armed and state is not GuardState.FAULT:
        wrong.append(f"state {state}")
    if world.largest_n > setting.allowed_n:
        wrong.append(f"{world.largest_n:.3f} N above {setting.allowed_n:.3f} N")
    out = abs(world.position_m - RETREAT_M) < 20e-6
    if armed and not out and all(kind.out for kind in kinds):
        wrong.append(f"not out: at {world.position_m:g} m")
    guard.close()
    first_s = min(at.values())
    return Outcome(
        setting, faults, state, trigger, press.phase, world.largest_n, world.position_m, ended_s - first_s, tuple(wrong)
    )


def schedules(count: int, seed: int) -> Iterator[Outcome]:
    """Yield the outcomes of random schedules: one fault, or two."""
    rng = np.random.default_rng(seed)
    names = sorted(KINDS)
    for number in range(count):
        baud, period_s = ((115200, 20e-3), (9600, 60e-3))[int(rng.integers(2))]
        stiffness = float(np.exp(rng.uniform(np.log(4e3), np.log(80e3))))
        setting = Setting(baud, stiffness, period_s, seed=1000 * seed + number)
        some = rng.choice(len(names), size=int(rng.integers(1, 3)), replace=False)
        # From about the moment at which the guard is armed to the end of the press.
        span_s = (0.6, 3.0) if baud == 115200 else (1.7, 7.0)
        yield schedule(setting, tuple((names[n], float(rng.uniform(*span_s))) for n in some))


def main() -> None:
    """Run the schedules and say what came of them."""
    count, seed = (int(value) for value in (*sys.argv[1:], *("200", "1")[len(sys.argv) - 1 :]))
    began_s = time.perf_counter()
    outcomes = []
    for outcome in schedules(count, seed):
        outcomes.append(outcome)
        if len(outcomes) % 20 == 0:
            print(f"{len(outcomes)} after {time.perf_counter() - began_s:.0f} s", file=sys.stderr, flush=True)
        for wrong in outcome.wrong:
            print(f"WRONG {wrong}: {outcome}", flush=True)
    over = Counter(str(outcome.trigger) for outcome in outcomes)
    nearest = max(outcomes, key=lambda outcome: outcome.largest_n - outcome.setting.allowed_n)
    print(f"{count} schedules, seed {seed}, in {time.perf_counter() - began_s:.0f} s:")
    for name, times in over.most_common():
        print(f"  {times:4d}  {name}")
    print(
        f"largest force beside what is promised: {nearest.largest_n:.3f} N of {nearest.setting.allowed_n:.3f} N at "
        f"{1e-3 * nearest.setting.stiffness_n_m:.1f} N/mm"
    )
    print(f"longest from fault to the end: {max(outcome.virtual_s for outcome in outcomes):.2f} s virtual")
    print(f"{sum(bool(outcome.wrong) for outcome in outcomes)} wrong")
    sys.exit(any(outcome.wrong for outcome in outcomes))


if __name__ == "__main__":
    main()
