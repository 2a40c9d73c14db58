"""Presses of ``benchmarks/guard_faults.py``, through a guard in this process or in one of its own."""

import importlib.util
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from tactbench.plugin import load_object
from tactbench.plugin.devices import DeviceSettings, GuardProcess, ProcessSettings


def load(name):
    if name not in sys.modules:
        path = Path(__file__).parents[3] / "benchmarks" / f"{name}.py"
        spec = importlib.util.spec_from_file_location(name, path)
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return sys.modules[name]


FAULTS = load("guard_faults")
PACKAGE = "tactbench.rigs.parallel_manipulator"
NET_FT = f"{PACKAGE}.net_ft.driver:NetFtDriver"
# In real time, emulators and rig share a process and perhaps a busy machine: a force may be old, a beat late, and an
# answer of the motor, too, whose driver is told of a slow line.
PATIENT = {"time": "real", "force_age_s": 1.0, "heartbeat_s": 1.0, "setpoint_n": 2.0}
SLOW_LINE = {"baud": 2400}


class Rig:
    """A guard, emulated devices and what presses."""

    def __init__(self, kind, tmp_path, setting, force_driver, **faults):
        self.setting = setting
        self.world = FAULTS.Pressed(setting, **faults)
        self.clock = self.world.clock
        if kind == "local":
            self.guard = self.world.guard(load_object(force_driver))
        else:
            addresses, options = self.world.devices.addresses, self.world.settings()
            self.log, self.clock = tmp_path / "guard.log", time.monotonic_ns
            self.guard = GuardProcess(
                ProcessSettings(
                    {
                        "motor": DeviceSettings(
                            f"{PACKAGE}.motor.driver:FaulhaberDriver",
                            addresses["motor"],
                            options["motor"] | SLOW_LINE,
                        )
                    },
                    DeviceSettings(force_driver, addresses["force"], options["force"]),
                    str(self.log),
                )
            )

    def press(self, change=lambda beat, since_s: beat, hold_s=0.1, most_s=15.0):
        """Press until it is over or the guard is no longer armed; return the press."""
        press = FAULTS.Press(self.guard, self.setting, self.clock, change, hold_s=hold_s)
        press.run(most_s)
        return press

    def ended(self, seconds=3.0):
        """Return the first report that is neither of an armed nor of a retreating guard."""
        until_ns = self.clock() + round(1e9 * seconds)
        while self.clock() < until_ns:
            report = self.guard.beat(FAULTS.Beat(self.clock()))
            if report.state not in (FAULTS.GuardState.ARMED, FAULTS.GuardState.RETREATING):
                return report
            self.guard.advance(self.clock() + 10_000_000)
        return report

    @property
    def out(self):
        return abs(self.world.position_m - FAULTS.RETREAT_M) < 20e-6


@contextmanager
def rig(kind, tmp_path, setting=None, force_driver=NET_FT, **faults):
    """Yield a rig whose guard is started; `setting` of a guard in a process is made patient."""
    setting = setting or FAULTS.Setting()
    if kind == "process":
        setting = FAULTS.replace(setting, **PATIENT)
    made = Rig(kind, tmp_path, setting, force_driver, **faults)
    try:
        made.guard.start()
        yield made
    finally:
        with made.world.devices:
            made.guard.close()
