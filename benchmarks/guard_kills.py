"""Rig and guard killed in the middle of a press, in real time: how soon the retreat is on the motor's line.

    python benchmarks/guard_kills.py [--heartbeat SECONDS] [TIMES [SCENARIO …]]

Emulated motor and force sensor run here, on a pseudo-terminal and UDP; the rig is a process of its own, and the guard a
process of that one. Times are from the signal to the first byte of the retreat on the motor's line. Without
--heartbeat, T_dead is three periods: 30 ms at 115200 baud, 90 ms at 9600. A press that ends before the signal, because
the machine was too busy to keep its beat, is not counted, and said. So is the load at the end.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import guard_faults as faults

from tactbench.plugin import TactbenchError
from tactbench.plugin.devices import DeviceSettings, GuardLostError, GuardProcess, ProcessSettings
from tactbench.rigs.parallel_manipulator.motor.codec import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver, retreat_command

PACKAGE = "tactbench.rigs.parallel_manipulator"
PERIODS_S = {115200: 10e-3, 9600: 30e-3}
REACTION_S = 8e-3
"""Age of the force 1 ms, a look of the guard 1 ms, its scheduling 6 ms (a measured 99.9th percentile)."""
FORCE_AGE_S = 0.2
"""Longer than a rig's: emulators in Python are late by tens of milliseconds on a busy machine."""


# The rig's process ----------------------------------------------------------------------------------------------------


def rig(text: str) -> None:
    """Press and hold until something ends it; say on stdout what happens."""
    given = json.loads(text)
    setting = faults.Setting(**given["setting"])
    process = given["process"]
    axes = {name: DeviceSettings(**device) for name, device in process["axes"].items()}
    guard = GuardProcess(ProcessSettings(**{**process, "axes": axes, "force": DeviceSettings(**process["force"])}))
    sibling = 0
    if given["sibling"]:
        # It has a copy of every socket, and no idea of it.
        sibling = os.fork()
        if sibling == 0:
            time.sleep(8.0)
            os._exit(0)

    def say(**values: Any) -> None:
        print(json.dumps(values), flush=True)

    said = ""

    def change(beat: Any, _since_s: float) -> Any:
        nonlocal said
        if press.phase != said:
            said = press.phase
            say(phase=said)
        return beat

    press = faults.Press(guard, setting, time.monotonic_ns, change, hold_s=20.0)
    try:
        guard.start()
        say(guard=guard._process.pid, sibling=sibling)
        last = press.run(20.0)
        say(ended=str(last.trigger))
    except GuardLostError as error:
        say(lost=error.message)
    except TactbenchError as error:
        say(error=error.message)
    finally:
        guard.close()


# Scenarios ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Scenario:
    """Who gets which signal, and how soon the retreat must be there."""

    who: tuple[str, ...]
    number: int = signal.SIGKILL
    sibling: bool = False
    retreats: bool = True
    within: Callable[[float, float], float] = lambda dead_s, reaction_s: dead_s + reaction_s


SCENARIOS = {
    "kill rig": Scenario(("rig",)),
    "kill rig, a sibling alive": Scenario(("rig",), sibling=True),
    "stop rig": Scenario(("rig",), signal.SIGSTOP, sibling=True),
    "terminate guard": Scenario(("guard",), signal.SIGTERM),
    "kill guard": Scenario(("guard",), within=lambda dead_s, reaction_s: 2 * dead_s),
    "stop guard": Scenario(("guard",), signal.SIGSTOP, within=lambda dead_s, reaction_s: 2 * dead_s),
    "kill both": Scenario(("rig", "guard"), retreats=False),
}


@dataclass(frozen=True)
class Result:
    """What became of one."""

    late_s: float
    """From the signal to the first byte of the retreat; not a number: there was none."""
    allowed_s: float
    host_late_s: float
    """By how much the longest of many short sleeps here was longer than asked for."""
    out: bool
    moved_m: float
    """By how much the motor went on into the skin after the signal, at most."""
    step_m: float
    largest_n: float
    log: tuple[dict[str, Any], ...]
    said: tuple[dict[str, Any], ...]


def run(name: str, baud: int, seed: int, heartbeat_s: float | None = None) -> Result | None:
    """Carry a scenario out; None: the press ended by itself before, on a machine too busy.

    `heartbeat_s` is T_dead; None: three periods.
    """
    scenario, rng = SCENARIOS[name], random.Random(seed)
    setting = faults.Setting(
        baud=baud,
        period_s=PERIODS_S[baud],
        force_age_s=max(FORCE_AGE_S, heartbeat_s or 0.0),
        time="real",
        seed=seed,
        heartbeat_s=heartbeat_s,
    )
    world = faults.Pressed(setting)
    options, addresses = world.settings(), world.devices.addresses
    limits = setting.limits
    with world.devices, tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "guard.log"
        settings = ProcessSettings(
            {"motor": DeviceSettings(f"{PACKAGE}.motor.driver:FaulhaberDriver", addresses["motor"], options["motor"])},
            DeviceSettings(f"{PACKAGE}.net_ft.driver:NetFtDriver", addresses["force"], options["force"]),
            str(log),
        )
        given = {"setting": asdict(setting), "process": asdict(settings), "sibling": scenario.sibling}
        process = subprocess.Popen(
            [sys.executable, __file__, "--rig", json.dumps(given)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        said: list[dict[str, Any]] = []
        numbers = {"rig": process.pid}
        try:
            if not _until(process.stdout, said, "ramp"):
                return None
            numbers |= {who: said[0][who] for who in ("guard", "sibling")}
            time.sleep(rng.uniform(0.0, 0.4))
            now_s, deepest_m = 1e-9 * world.clock(), world.position_m
            target_m = world.motor.drive.target_m
            for who in scenario.who:
                os.kill(numbers[who], scenario.number)
            late_s, host_late_s, out = _watched(world, now_s, 3.0 if scenario.retreats else 0.5)
            deepest_m = max(deepest_m, world.deepest_m(now_s))
            if name == "stop rig":
                os.kill(process.pid, signal.SIGCONT)
            if process.poll() is None and "guard" in scenario.who:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(5.0)
                said += [json.loads(line) for line in process.stdout]
            if "guard" not in scenario.who or scenario.number == signal.SIGTERM:
                _ended(log)
            lines = log.read_text(encoding="utf-8").splitlines()
        finally:
            for who in numbers:
                with suppress(ProcessLookupError):
                    if numbers[who]:
                        os.kill(numbers[who], signal.SIGKILL)
            process.wait()
            process.stdout.close()
    dead_s = limits.heartbeat_s
    facts = FaulhaberDriver.facts_of(FaulhaberOptions(**options["motor"]))
    allowed_s = scenario.within(dead_s, REACTION_S + facts.stop_latency_s)
    entries = tuple(json.loads(line) for line in lines if line.startswith("{"))
    return Result(
        late_s, allowed_s, host_late_s, out, deepest_m - target_m, limits.step_m, world.largest_n, entries, tuple(said)
    )


def _until(lines: IO[str], said: list[dict[str, Any]], phase: str) -> bool:
    for line in lines:
        said.append(json.loads(line))
        if said[-1].get("phase") == phase:
            return True
    return False


def _watched(world: Any, since_s: float, most_s: float) -> tuple[float, float, bool]:
    """Return when the retreat began on the motor's line, how late the host was, and whether the motor came out."""
    command = retreat_command(FaulhaberOptions(**world.settings()["motor"]))
    until_s = since_s + most_s
    late_s, host_late_s, out = float("nan"), 0.0, False
    while 1e-9 * world.clock() < until_s and not out:
        asked_s = time.perf_counter()
        time.sleep(2e-3)
        host_late_s = max(host_late_s, time.perf_counter() - asked_s - 2e-3)
        out = abs(world.position_m - faults.RETREAT_M) < 10e-6
    sent = b""
    for at_s, piece in world.motor.told:
        if at_s >= since_s:
            sent += piece
            if command.split(b"\r")[0] + b"\r" in sent:
                late_s = at_s - since_s
                break
    return late_s, host_late_s, out


def _ended(log: Path) -> None:
    """Wait until the guard has written that it leaves: at once on an idle machine, 10 s at most on a busy one."""
    for _ in range(1000):
        if '"left"' in log.read_text(encoding="utf-8"):
            return
        time.sleep(0.01)


def main() -> None:
    """Run scenarios and print a table."""
    if sys.argv[1:2] == ["--rig"]:
        rig(sys.argv[2])
        return
    arguments, heartbeat_s = sys.argv[1:], None
    if arguments[:1] == ["--heartbeat"]:
        heartbeat_s, arguments = float(arguments[1]), arguments[2:]
    times = int(arguments[0]) if arguments else 10
    wrong = 0
    for name in arguments[1:] or SCENARIOS:
        for baud in PERIODS_S:
            found: list[Result] = []
            seed = missed = 0
            while len(found) < times and missed < 3 * times:
                seed += 1
                result = run(name, baud, seed, heartbeat_s)
                missed += result is None
                found += [] if result is None else [result]
            if not found:
                wrong += 1
                print(f"{name:28s} {baud:6d}  no press of {missed} has come to its signal: the machine is too busy")
                continue
            late = sorted(1e3 * result.late_s for result in found)
            over = sum(not result.late_s <= result.allowed_s for result in found) if SCENARIOS[name].retreats else 0
            not_out = sum(not result.out for result in found) if SCENARIOS[name].retreats else 0
            wrong += over + not_out
            print(
                f"{name:28s} {baud:6d}  {len(found)} times, {missed} ended before: "
                f"retreat after {late[len(late) // 2]:5.1f} ms median, {late[-1]:5.1f} ms worst, "
                f"{1e3 * found[0].allowed_s:5.1f} ms allowed, {over} over, {not_out} not out; "
                f"went on {1e6 * max(result.moved_m for result in found):.0f} um at most, "
                f"a step is {1e6 * found[0].step_m:.0f} um; "
                f"sleeps late by {1e3 * max(result.host_late_s for result in found):.0f} ms at most",
                flush=True,
            )
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
