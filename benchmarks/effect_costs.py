"""What effects cost: one that is installed and not needed, and one that is asked for, beside what the plan said.

Installed: the same recordings with thirty more effects installed that no scene calls for. Asked for: a sliding scene
of a minute, in which effects are left out by name; `explain` says what each would cost, then recordings with and
without it are made turn and turn about. CPU seconds, medians.

Usage: OMP_NUM_THREADS=1 python benchmarks/effect_costs.py [ROUNDS]
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Sequence

from tactbench.core.spec.scene import Simulation
from tactbench.plugin import (
    ForceRamp,
    Indenter,
    Placement,
    RigContext,
    Scene,
    SensorDescriptor,
    SensorSpec,
    assumed,
    load_registry,
)
from tactbench.plugin.simulation import EffectDescriptor, Reason, Slide
from tactbench.rigs.twin.contact.stages import forget_tables
from tactbench.rigs.twin.rig import Twin, build

ASKED = ("skin-vibration", "friction", "hum", "wander")
"""Effects that cost milliseconds; what costs microseconds drowns in a recording's own scatter."""


def never(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer that no scene calls for it."""
    return Reason(False, "never", 0.0)


def recorded(twin: Twin, sensor: SensorDescriptor, scene: Scene, *, fresh: bool) -> float:
    """Return the CPU seconds of one recording."""
    if fresh:
        forget_tables()
    began = time.process_time()
    with twin.open(sensor, scene, seed=1) as acquisition:
        for _ in acquisition:
            pass
    return time.process_time() - began


def turn_about(rounds: int, *makers: Sequence[object]) -> list[list[float]]:
    """Return the seconds of each maker's recordings, one of each a round."""
    found: list[list[float]] = [[] for _ in makers]
    for _ in range(rounds):
        for times, (twin, sensor, scene, fresh) in zip(found, makers, strict=True):
            times.append(recorded(twin, sensor, scene, fresh=fresh))
    return found


def main() -> None:
    """Print both tables."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 11
    registry = load_registry()
    effects = tuple(registry.effects)
    plain = build(RigContext(effects=effects))
    more = tuple(
        EffectDescriptor(
            name=f"unneeded-{number}", title="Unneeded", where="nowhere:apply", called_for=f"{__name__}:never",
            produces=("disturbance",), consumes=("skin",),
        )
        for number in range(30)
    )  # fmt: skip
    crowded = build(RigContext(effects=(*effects, *more)))
    assert isinstance(plain, Twin)
    assert isinstance(crowded, Twin)
    print("thirty unneeded effects installed: ms per recording without, with; ratio of the medians")
    for name in ("biotac", "icub"):
        sensor, scene = registry.sensors[name], registry.tasks["curvature"].spec.scenes[0].scene
        recorded(plain, sensor, scene, fresh=True)
        without, with_them = turn_about(rounds, (plain, sensor, scene, False), (crowded, sensor, scene, False))
        a, b = statistics.median(without), statistics.median(with_them)
        print(f"  {name:<8}{1e3 * a:8.2f}{1e3 * b:8.2f}{b / a:8.3f}   ({1e6 * (b - a) / 30:.0f} us an effect)")
    sensor = registry.sensors["biotac"]
    whole = Scene(
        name="slide",
        indenter=Indenter(radius=assumed(20.0, "mm", "benchmark")),
        placement=Placement(scatter=assumed(0.0, "mm", "benchmark")),
        profile=ForceRamp(end=assumed(2.0, "N", "benchmark")),
        slide=Slide(speed=assumed(20.0, "mm/s", "benchmark"), start=assumed(10.0, "s", "benchmark")),
        observe=("taxel", "ac_pressure"),
    )
    print("asked for in a sliding minute: ms that explain said, ms it cost; ratio")
    for name in ASKED:
        # What stands on it is left out as well, so that the effect's own cost is what differs.
        left_out = [f"-{name}"] + (["-skin-vibration"] if name == "friction" else [])
        before = whole.model_copy(update={"simulation": Simulation(effects=tuple(left_out))})
        rows = {row.entry.effect: row for row in plain.explain(sensor, before, rounds=rounds)}
        said = rows[name].cost_s
        after = whole.model_copy(update={"simulation": Simulation(effects=(*left_out, f"+{name}"))})
        without, with_it = turn_about(rounds, (plain, sensor, before, False), (plain, sensor, after, False))
        cost = statistics.median(b - a for a, b in zip(without, with_it, strict=True))
        print(f"  {name:<16}{1e3 * (said or 0):8.2f}{1e3 * cost:8.2f}{cost / said if said else float('nan'):8.2f}")


if __name__ == "__main__":
    main()
