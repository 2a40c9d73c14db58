"""Construction of the contact solver and the transducer for one simulated recording."""

from __future__ import annotations

import functools
import math
import sys
from collections.abc import Callable

import numpy as np

from tactbench.plugin import (
    FloatArray,
    NotApplicable,
    PluginContractError,
    Quantity,
    RigError,
    SensorDescriptor,
    load_object,
)
from tactbench.plugin.simulation import (
    BondedLayer,
    FluidBackedShell,
    FoamPad,
    SkinGrid,
    SkinState,
    Transducer,
    TransducerFactory,
)
from tactbench.rigs.twin.contact.media import Medium, foam_medium, layer_medium
from tactbench.rigs.twin.contact.press import AnyPress, LocalPress, Press, whole_skin
from tactbench.rigs.twin.geometry import gap_mm, skin_grid
from tactbench.rigs.twin.synthesis import Fidelity, Synthesis

Read = Callable[[SkinState], FloatArray]
_MAY_BE_ZERO = frozenset({
    "poisson", "shear", "tension", "cover_tension", "cover_bending", "clamp_stiffness", "residual_film",
})  # fmt: skip


def pressed(run: Synthesis, names: list[str], fidelity: Fidelity) -> tuple[AnyPress, Read]:
    """Return the solver of the loads of `run`, and the function that reads the channels `names` from a solved skin.

    Raises
    ------
    NotApplicable
        If the transducer cannot give a channel.
    RigError
        If the chosen contact solver does not support this skin.
    """
    press = press_of(run, fidelity)
    if not names:
        return press, whole_skin
    grid = press.medium.grid
    read = _reader(run.sensor, grid, names)
    if not ("shear" in run.lent or run.sensor.spec.reads_shear):
        return press, read
    from tactbench.rigs.twin.contact.tangential import pressed_state, tangential_of

    along = tangential_of(run.skin, grid) if "shear" in run.lent else None
    return press, lambda state: read(state if state.shear_mpa is not None else pressed_state(state, along))


def press_of(run: Synthesis, fidelity: Fidelity) -> AnyPress:
    """Return the contact solver of `run`; raises the errors of :func:`pressed`."""
    skin = run.skin
    grid = skin_grid(skin.sheet, fidelity.cells(skin.sheet))
    gap = gap_mm(grid, run.contact, skin.sheet)
    if fidelity.solver == "local":
        return LocalPress(skin, medium_of(skin, grid), gap, run.contact)
    core = None
    if "core" in run.lent and isinstance(skin, FluidBackedShell):
        from tactbench.rigs.twin.contact.shell import with_core

        core = functools.partial(with_core, skin=skin)
    tolerance, fluid_pressure = fidelity.newton_tolerance, "fluid-pressure" in run.lent
    return Press(medium_of(skin, grid), gap, run.contact, core=core, fluid_pressure=fluid_pressure, tolerance=tolerance)


def _reader(sensor: SensorDescriptor, grid: SkinGrid, names: list[str]) -> Read:
    """Return the sensor's transducer, wrapped in a check that each result is (len(names),) finite numbers."""
    try:
        factory: TransducerFactory = load_object(sensor.transducer or "")
        transducer: Transducer = factory(sensor.spec, grid, names)
    except RigError as error:
        raise NotApplicable(f"The transducer of {sensor.name} cannot be built: {error}", hint=error.hint) from error

    def read(state: SkinState) -> FloatArray:
        readings = np.asarray(transducer(state), dtype=np.float64)
        if readings.shape != (len(names),) or not np.all(np.isfinite(readings)):
            raise PluginContractError(
                f"The transducer of {sensor.name} returned shape {readings.shape} at {state.force_n:g} N; "
                f"expected ({len(names)},) finite readings.",
                hint="Return one finite number for each wanted channel.",
            )
        return readings

    return read


def slide_of(run: Synthesis) -> tuple[tuple[float, float], float] | None:
    """Return a slide's direction and static friction; None without a slide or a channel that responds to shear."""
    slide = run.scene.slide
    if slide is None or "shear" not in run.lent or not run.load.largest_n > 0:
        return None
    angle = slide.direction.to("rad")
    return (math.cos(angle), math.sin(angle)), slide.surface.static_friction.to("1")


def medium_of(skin: FluidBackedShell | FoamPad | BondedLayer, grid: SkinGrid) -> Medium:
    """Return the medium on `grid` of a skin in a sensor's spec.

    Raises
    ------
    RigError
        If a parameter is not physical.
    """
    for name in type(skin).model_fields:
        stated, zero = getattr(skin, name), name in _MAY_BE_ZERO
        most = 0.5 if name == "poisson" else sys.float_info.max
        if isinstance(stated, Quantity) and not (0 < stated.value <= most or (zero and stated.value == 0)):
            raise RigError(
                f"The skin's {name} is {stated}; it must be finite, {'at least' if zero else 'above'} 0"
                f"{' and at most 0.5' if most < 1 else ''}.",
                hint="Correct the skin in the sensor's spec.",
            )
    if isinstance(skin, FluidBackedShell):
        from tactbench.rigs.twin.contact import shell

        return shell.medium(skin, grid)
    return foam_medium(skin, grid) if isinstance(skin, FoamPad) else layer_medium(skin, grid)
