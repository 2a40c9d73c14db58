"""What a draw, or a setting beside the draws, asks of the simulation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from tactbench.core.spec.calibration import CalibrationSpec, Fixed, Nuisance, Setting, Variation
from tactbench.core.spec.scene import Simulation


def simulation_of(spec: CalibrationSpec, sensor: str, values: Mapping[str, float]) -> Simulation:
    """Return how the procedure asks for scenes of `sensor`, with the drawn `values` of its nuisances."""
    own = {one.sets: values[one.name] for one in spec.nuisances if not one.sensors or sensor in one.sensors}
    stated = spec.simulation.model_dump()
    return Simulation.model_validate({**stated, "nuisances": {**stated["nuisances"], **own}})


def as_procedure(spec: CalibrationSpec, variation: Variation, setting: Setting) -> CalibrationSpec:
    """Return the procedure whose draws are the seeds of one setting: what it gives is fixed, nothing is drawn."""
    given = tuple(
        Nuisance(
            name=f"given_{place}", sets=one.name, sensors=one.sensors, prior=Fixed(kind="fixed", value=one.value),
            reason=setting.label, source="assumed",
        )
        for place, one in enumerate(setting.given, start=1)
    )  # fmt: skip
    outputs = tuple(spec.output(name) for name in variation.outputs)
    return spec.model_copy(update={"nuisances": given, "outputs": outputs, "variations": ()})


def procedures(spec: CalibrationSpec) -> Iterator[CalibrationSpec]:
    """Yield the procedure of every setting."""
    for variation in spec.variations:
        for setting in variation.settings:
            yield as_procedure(spec, variation, setting)
