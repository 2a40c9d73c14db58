"""Which scenes call for it."""

from tactbench.plugin import Scene, SensorSpec
from tactbench.plugin.simulation import Reason


def dead(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer: a sensor that states a share of dead taxels calls for it."""
    share = sensor.parameters.get("dead_taxels")
    if share is None or not share.to("1"):
        return Reason(False, f"{sensor.name} states no dead_taxels", 0.0)
    return Reason(True, f"{share.to('%'):g} % of the taxels are dead")
