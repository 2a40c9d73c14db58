"""Ways of a platform and presses under the guard of all axes, with faults drawn at random, in virtual time.

    python benchmarks/axes_faults.py [SCHEDULES [SEED]]

Each schedule homes a motor and three rails, moves the rails by way points, presses, and moves them back. At a random
moment something is in the rails' way, or the rig, the force sensor or one of the four axes fails, or two of these. The
largest force is held against a bound that is computed before: ceilings, stiffness, speed, reaction, and the time after
which the fault is noticed. A schedule that takes longer than its virtual time has hung.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import guard_faults as faults
import numpy as np

from tactbench.devices.emulator import LinkFault
from tactbench.devices.guard_messages import GuardRefusesError, Report
from tactbench.plugin.devices import (
    Beat,
    CommandKind,
    DriverSettings,
    EmulatedDevice,
    EmulatedDevices,
    EmulatorSettings,
    GuardState,
    LocalGuard,
    largest_force_n,
)
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver
from tactbench.rigs.parallel_manipulator.motor.emulator import MotorEmulator, MotorFault
from tactbench.rigs.parallel_manipulator.net_ft.driver import NetFtDriver

RAILS = ("joint-1", "joint-2", "joint-3")
WAY_M, POINTS = 1e-3, 8
"""Between two way points, and how many there are."""
TRAVEL_N = 0.5
RAIL: dict[str, Any] = {
    "lower_m": -0.05, "upper_m": 0.05, "speed_m_s": 0.02, "acceleration_m_s2": 1.0, "corridor_m": 4e-6,
    "increment_m": 1e-6, "homing": "here", "baud": 115200, "orientation": "vertical", "brake": True,
}  # fmt: skip
NOTICED_S = {"force stuck": 50e-3, "force unplugged": 13e-3, "force held up": 13e-3, "four samples lost": 5e-3}
"""After which a force that is not known any more is noticed: 50 equal samples, or the age of the force."""
OF_AXES = ("unplugged", "hot", "answers late")


class Machine(faults.Pressed):
    """A motor in front of a spring, three rails, and a spring in the way of the first after `obstacle_m`."""

    def __init__(self, setting: Any, obstacle_m: float, **given: list[Any]) -> None:
        self.obstacle_m = obstacle_m
        self.rails: dict[str, MotorEmulator] = {}
        super().__init__(
            setting, **{name: given.get(name, []) for name in ("motor", "force", "motor_link", "force_link")}
        )
        own = {"motor": self.devices._devices["motor"], "force": self.devices._devices["force"]}
        for number, name in enumerate(RAILS):
            rng = np.random.default_rng([setting.seed, number])
            self.rails[name] = MotorEmulator(EmulatorSettings(lambda at_s: {}, rng, RAIL))
            self.rails[name].faults = given.get(name, [])
            own[name] = EmulatedDevice("bytes", self.rails[name], tuple(given.get(f"{name}_link", ())))
        self.devices = EmulatedDevices(own)
        self.clock = self.devices.clock

    @property
    def force_n(self) -> float:
        """On the sensor now: of the skin, and of what is in the way."""
        rail = self.rails.get("joint-1")
        beyond_m = 0.0 if rail is None else max(0.0, rail.drive.position_m - self.obstacle_m)
        force = self.setting.stiffness_n_m * (max(0.0, self.position_m - faults.SKIN_M) + beyond_m)
        self.largest_n = max(self.largest_n, force)
        return float(force)

    def guard_of_all(self) -> LocalGuard:
        """Return the guard of the four axes."""
        options = {"motor": self.settings()["motor"]} | dict.fromkeys(RAILS, RAIL)
        axes = {
            name: FaulhaberDriver(DriverSettings(self.devices.opener(name), options=own, clock=self.clock))
            for name, own in options.items()
        }
        force = self.settings()["force"]
        driver = NetFtDriver(DriverSettings(self.devices.opener("force"), options=force, clock=self.clock))
        return LocalGuard(axes, driver, self.clock, self.devices.advance)


def travel(guard: LocalGuard, machine: Machine, sign: int, change: Any) -> Report:
    """Move the rails forth or back by way points; return the last report."""
    limits = replace(machine.setting.limits, travel_ceiling_n=TRAVEL_N)
    report = guard.arm(limits)
    points = range(1, POINTS + 1) if sign > 0 else range(POINTS - 1, -1, -1)
    for point in points:
        targets = dict.fromkeys(RAILS, point * WAY_M)
        while True:
            kind = CommandKind.TRAVEL if targets else CommandKind.NONE
            beat = Beat(machine.clock(), "travel", kind, force_sequence=report.force_sequence, targets=targets)
            changed = change(beat, 0.0)
            if changed is not None:
                report = guard.beat(changed)
                targets = targets if report.early else {}
            due_ns = machine.clock() + round(1e9 * machine.setting.period_s)
            guard.advance(due_ns)
            if guard.state is not GuardState.ARMED:
                return report
            if not targets and not report.moving:
                break
    guard.disarm()
    return report


@dataclass(frozen=True)
class Outcome:
    """What became of one schedule."""

    setting: Any
    faults: tuple[tuple[str, float], ...]
    trigger: str
    travel_n: float
    travel_bound_n: float
    press_n: float
    press_bound_n: float
    wrong: tuple[str, ...]


def travel_bound_n(setting: Any, names: list[str], guard: LocalGuard) -> float:
    """Return the largest force of a way, from what is stated and known before."""
    rail = guard._axes["joint-1"]
    speed, acceleration = RAIL["speed_m_s"], RAIL["acceleration_m_s2"]
    # Age of the force and a look of the guard, 1 ms each; its scheduling, 6 ms (a measured 99.9th percentile).
    seen_s = 8e-3 + rail.facts.stop_latency_s + max([NOTICED_S.get(name, 0.0) for name in names], default=0.0)
    moving = largest_force_n(TRAVEL_N, setting.stiffness_n_m, speed, acceleration, seen_s)
    if any(name.startswith("joint-1 ") for name in names):  # a rail that does not answer ends its move by itself
        moving += setting.stiffness_n_m * WAY_M
    return moving + 5 * faults.NOISE_N


def schedule(setting: Any, drawn: tuple[tuple[str, float], ...], obstacle_m: float) -> Outcome:
    """Carry one out."""
    given: dict[str, list[Any]] = {}
    for name, at_s in drawn:
        axis, _, what = name.partition(" ")
        if what == "unplugged" and axis != "force":
            given.setdefault(f"{axis}_link", []).append(LinkFault.parse(f"unplug:start_s={at_s}"))
        elif what == "hot":
            given.setdefault(axis, []).append(MotorFault.parse(f"motor-fault:start_s={at_s}"))
        elif what == "answers late":
            given.setdefault(f"{axis}_link", []).append(LinkFault.parse(f"late:start_s={at_s},delay_s=0.25"))
        elif (kind := faults.KINDS[name]).text:
            text = kind.text.format(start=at_s, end=at_s + 0.3, four=at_s + 4.5e-3)
            parse = faults.DatagramFault.parse if kind.where == "force" else LinkFault.parse
            given.setdefault(kind.where, []).append(parse(text))
    machine = Machine(setting, obstacle_m, **given)
    own = {name: at_s for name, at_s in drawn if name in faults.KINDS}
    machine.sensed = faults.sensed({name: at_s for name, at_s in own.items() if faults.KINDS[name].where == "sensed"})
    guard = machine.guard_of_all()
    bounds = {"travel": travel_bound_n(setting, [name for name, _ in drawn], guard), "press": setting.allowed_n}
    largest = {"travel": 0.0, "press": 0.0}
    guard.start()
    change = faults.changed(own, setting, machine.clock)
    trigger, wrong = None, []
    for phase, sign in (("travel", 1), ("press", 0), ("travel", -1)):
        machine.largest_n = 0.0
        try:
            if sign:
                travel(guard, machine, sign, change)
            else:
                faults.Press(guard, setting, machine.clock, change).run(20.0)
        except GuardRefusesError:
            break
        # The rig says nothing more, and the guard ends what it does.
        until_ns = machine.clock() + round(8e9)
        trigger = guard.trigger
        while guard.state is GuardState.RETREATING and machine.clock() < until_ns:
            guard.advance(machine.clock() + round(10e6))
        largest[phase] = max(largest[phase], machine.largest_n)
        if guard.state is GuardState.RETREATING:
            wrong.append("hung")
        if (guard.state is not GuardState.IDLE and guard.disarm().state is not GuardState.IDLE) or trigger is not None:
            break
    wrong += [f"{phase}: {largest[phase]:.3f} N above {bounds[phase]:.3f} N" for phase in bounds
              if largest[phase] > bounds[phase]]  # fmt: skip
    guard.close()
    servos = [emulator.drive for emulator in machine.rails.values()]
    before = [servo.position_m for servo in servos]
    machine.devices.advance(machine.clock() + round(0.5e9))
    # A rail that answers nothing ends its way point by itself; the others stand.
    moved = max(abs(servo.position_m - at) for servo, at in zip(servos, before, strict=True))
    if moved > 1e-5 and not any(name.startswith("joint") for name, _ in drawn):
        wrong.append("a rail still moves")
    return Outcome(
        setting, drawn, str(trigger), largest["travel"], bounds["travel"], largest["press"], bounds["press"],
        tuple(wrong),
    )  # fmt: skip


def schedules(count: int, seed: int) -> Iterator[Outcome]:
    """Yield the outcomes of random schedules."""
    rng = np.random.default_rng(seed)
    names = [name for name, kind in faults.KINDS.items() if kind.where in ("rig", "sensed", "force", "force_link")]
    names += [f"{axis} {what}" for axis in ("motor", *RAILS) for what in OF_AXES]
    for number in range(count):
        stiffness = float(np.exp(rng.uniform(np.log(4e3), np.log(40e3))))
        setting = faults.Setting(115200, stiffness, 20e-3, seed=1000 * seed + number)
        some = rng.choice(len(names), size=int(rng.integers(0, 3)), replace=False)
        drawn = tuple((names[n], float(rng.uniform(1.6, 9.0))) for n in some)  # all devices are open by then
        # Two in three have something in the way, at a random place.
        obstacle_m = float(rng.uniform(0.3e-3, POINTS * WAY_M)) if rng.integers(3) else 1.0
        yield schedule(setting, drawn, obstacle_m)


def main() -> None:
    """Run the schedules and say what came of them."""
    count, seed = (int(value) for value in (*sys.argv[1:], *("200", "1")[len(sys.argv) - 1 :]))
    began_s, outcomes = time.perf_counter(), []
    for outcome in schedules(count, seed):
        outcomes.append(outcome)
        for wrong in outcome.wrong:
            print(f"WRONG {wrong}: {outcome}", flush=True)
    print(f"{count} schedules, seed {seed}, in {time.perf_counter() - began_s:.0f} s:")
    for name, times in Counter(outcome.trigger for outcome in outcomes).most_common():
        print(f"  {times:4d}  {name}")
    worst = max(outcomes, key=lambda outcome: outcome.travel_n / outcome.travel_bound_n)
    print(f"travelling, nearest to its bound: {worst.travel_n:.3f} N of {worst.travel_bound_n:.3f} N, {worst.faults}")
    worst = max(outcomes, key=lambda outcome: outcome.press_n / outcome.press_bound_n)
    print(f"pressing, nearest to its bound: {worst.press_n:.3f} N of {worst.press_bound_n:.3f} N, {worst.faults}")
    print(f"{sum(bool(outcome.wrong) for outcome in outcomes)} wrong")
    sys.exit(any(outcome.wrong for outcome in outcomes))


if __name__ == "__main__":
    main()
