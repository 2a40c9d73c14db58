"""How fast emulated devices run in virtual time: seconds of theirs for one of the processor's.

    python benchmarks/virtual_time.py [SENSOR [SECONDS [FORCE_SENSOR]]]

Nothing is pressed: what an emulator senses costs a look-up in a recording, beside which this leaves nothing out.
"""

from __future__ import annotations

import sys
import time

from tactbench.core.plugins.registry import load_registry
from tactbench.plugin.devices import EmulatedDevices, RigFile, drivers_of, emulators_of


def main() -> None:
    """Run devices and print the factor."""
    sensor, seconds, force = (*sys.argv[1:], *("biotac", "60", "")[len(sys.argv) - 1 :])
    said = {"rig": "bench", "sensors": {sensor: {"link": "emulated"}}}
    if force:
        said["force"] = {"device": force, "link": "emulated"}
    file = RigFile.model_validate(said)
    registry = load_registry()
    with EmulatedDevices(emulators_of(file, registry, sensor, lambda t_s: {})) as devices:
        links = {name: devices.opener(name) for name in (sensor, "force")}
        drivers = drivers_of(file, registry, sensor, links, devices.clock)
        rows = dict.fromkeys((stream.name for driver in drivers.values() for stream in driver.streams), 0)
        for driver in drivers.values():
            driver.start()
        begin_s, end_ns = time.process_time(), devices.clock() + round(1e9 * float(seconds))
        while devices.clock() < end_ns:
            for number, driver in enumerate(drivers.values()):
                for block in driver.read(0.0 if number else 0.02):
                    rows[block.stream] += len(block.data)
        spent_s = time.process_time() - begin_s
        for driver in drivers.values():
            driver.close()
    factor = float(seconds) / spent_s
    print(f"{sensor} {force}: {float(seconds):g} s in {spent_s:.2f} s of the processor, {factor:.1f} times real time")
    print(", ".join(f"{count} rows of {name}" for name, count in rows.items()))


if __name__ == "__main__":
    main()
