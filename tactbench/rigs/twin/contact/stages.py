"""Contact of one simulated recording: its solver and transducer, and the effects that press the skin and read it."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import (
    FloatArray,
    NotApplicable,
    PluginContractError,
    Quantity,
    RigError,
    Scalar,
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
from tactbench.rigs.twin.contact.load_table import LoadTable, build_table
from tactbench.rigs.twin.contact.media import Medium, foam_medium, layer_medium
from tactbench.rigs.twin.contact.press import AnyPress, LocalPress, Press, check_reach, remarks, whole_skin
from tactbench.rigs.twin.geometry import check_contact, gap_mm, skin_grid
from tactbench.rigs.twin.synthesis import FINE, RUNGS, Fidelity, Settled, Synthesis

if TYPE_CHECKING:
    from tactbench.rigs.twin.contact.tangential import SlideTable

READ_FROM_THE_SKIN = ("taxel", "dc_pressure")
"""Kinds of channels that a sensor's transducer computes."""
_MOST_TABLES = 64
TABLE_SHARE = 1 / 3
"""Share of a tolerance that the load table may use; the contact solver may use the rest."""
_PROBES = (0.3, 1.0)
"""Shares of the largest load at which a contact solver is compared with the next more accurate one."""
_CHOSEN: dict[str, tuple[str, float]] = {}


@dataclass(frozen=True)
class _Tabulated:
    table: LoadTable
    slide: SlideTable | None
    touched_core: bool
    closing_mm: float
    remarks: Mapping[str, Scalar]


_TABLES: dict[str, _Tabulated] = {}


def press_skin(run: Synthesis) -> None:
    """Solve the contact for the loads of the recording; raise an error if the grid cannot resolve it."""
    sheet = run.skin.sheet
    check_contact(skin_grid(sheet, run.fidelity.cells(sheet)), run.contact)
    skin_under_load(run)


def forget_tables() -> None:
    """Drop all load tables that this process has kept: the next recording solves its contact again."""
    _TABLES.clear()


def read_skin(run: Synthesis) -> None:
    """Add each channel's response: its gain times the change from rest of its reading under the effective force.

    A slide adds the change by the tangential force at the same normal force; a vibration of the skin adds its amplitude
    times the slope of the reading with depth.
    """
    tabulated, names = _tables(run), read_names(run)
    table, slide = tabulated.table, tabulated.slide
    for track in run.tracks:
        for kind, own in track.by_kind().items():
            if kind not in READ_FROM_THE_SKIN:
                continue
            among = [names.index(track.channels[column].name) for column in own]
            force_n = track.effective_n.get(kind, track.force_n)
            response = table(force_n)[:, among] - table.readings[0, among]
            if slide is not None and run.sliding is not None:
                seen = run.sliding(track.t_s)
                response += slide(force_n, track.force_n, seen.force_n, seen.stick_ratio)[:, among]
            if track.vibration_mm is not None:
                response += track.vibration_mm[:, None] * table.per_mm(table, force_n)[:, among]
            if track.gain is not None:
                response *= track.gain[own]
            track.readings[:, own] += response


def skin_under_load(run: Synthesis) -> LoadTable:
    """Return the table of the contact over the load for skin and channels; it is computed at the first call."""
    return _tables(run).table


def _tables(run: Synthesis) -> _Tabulated:
    largest, names = run.load.largest_n, read_names(run)
    if run.rung_error is None:
        choose_rung(run, names, largest)
    tabulated = _tabulated(run, names, largest)
    _report(run, tabulated)
    return tabulated


def round_contact_mm(run: Synthesis, force_n: FloatArray) -> FloatArray:
    """Return the radius of the contact under (n,) forces, for laws of a round contact.

    For other contacts: the radius of a circle with the same mean square distance of the load, stated in a remark.
    """
    if run.contact.shape is not None:
        run.drawn["remark round"] = (
            f"friction, heat and roughness take the contact of the {run.contact.shape.name} for a circle whose load is "
            "as far from its middle"
        )
    return skin_under_load(run).skin(force_n).contact_radius_mm


def bare_skin(run: Synthesis, largest_n: float) -> LoadTable:
    """Return the load table of the skin up to a load, without channels: for effects that determine the load.

    The load may press a cap in beyond its rim: only the final load is checked, when the channels are read.
    """
    return _tabulated(run, [], largest_n, only_skin=True).table


def read_names(run: Synthesis) -> list[str]:
    """Return the names of the channels that the sensor's transducer computes, in the sensor's order."""
    return [channel.name for track in run.tracks for channel in track.channels if channel.kind in READ_FROM_THE_SKIN]


def _tabulated(run: Synthesis, names: list[str], largest: float, *, only_skin: bool = False) -> _Tabulated:
    spec, tolerance = run.sensor.model_dump_json(), run.scene.simulation.tolerance
    text = (
        f"{spec}|{run.contact}|{largest!r}|{names}|{sorted(run.lent)}|{run.fidelity}|{tolerance}|{only_skin}"
        f"|{slide_of(run)}"
    )
    if text in _TABLES:
        return _TABLES[text]
    press, read = pressed(run, names, run.fidelity)
    tolerances, nodes = _tolerance(run, names), run.fidelity.most_nodes
    table = build_table(press, read, largest_n=largest, tolerance=tolerances, most_nodes=nodes)
    slide, sliding = slide_of(run), None
    if names and slide is not None:
        from tactbench.rigs.twin.contact.tangential import build_slide_table

        sliding = build_slide_table(press, read, table, run.skin, *slide)
    if not only_skin:
        check_reach(press, largest, run.skin.sheet)
    remarked = remarks(press, largest, run.skin.sheet)
    made = _Tabulated(table, sliding, press.touched_core, press.closing_at(largest), remarked)
    if len(_TABLES) == _MOST_TABLES:
        del _TABLES[next(iter(_TABLES))]
    _TABLES[text] = made
    return made


_NO_CHANNELS_TOLERANCE = np.array([0.01, 0.01, 1e-4])
"""Tolerances of depth and contact radius [mm] and of pressure [MPa] for a table without channels: a hundredth of their
values under a few newtons."""


def _tolerance(run: Synthesis, names: list[str]) -> FloatArray:
    """Return the (channels,) wanted bounds of the load table's error: multiples of the noise and rounding (rms).

    They are at most a third of a tolerance stated by the scene, of which the contact solver may use the rest.
    """
    if not names:
        return _NO_CHANNELS_TOLERANCE
    bounds = []
    channels = {channel.name: channel for track in run.tracks for channel in track.channels}
    for name in names:
        channel = channels[name]
        nuisances = run.nuisances(channel.kind)
        hidden = 0.0 if nuisances is None else nuisances.hidden()
        # Without any stated noise: a ten-thousandth of the range, or of one.
        span = channel.upper - channel.lower if channel.upper is not None and channel.lower is not None else 1.0
        bounds.append(hidden if hidden > 0 else 1e-4 * span)
    aim = run.fidelity.table_tolerance_factor * np.array(bounds)
    tolerance = run.scene.simulation.tolerance
    return aim if tolerance is None else np.minimum(aim, TABLE_SHARE * tolerance)


def _report(run: Synthesis, tabulated: _Tabulated) -> None:
    table = tabulated.table
    run.drawn.update(
        table_error_count=float(table.error.max(initial=0.0)),
        solver_residual=table.residual,
        depth_mm=table.depth_mm,
        **tabulated.remarks,
    )
    if run.rung_error is not None:
        total = run.rung_error + float(table.error.max(initial=0.0))
        run.drawn.update(rung=run.rung, rung_error_count=run.rung_error, error_estimate_count=total)
    if "core" not in run.lent:
        return
    if table.touch_down_n is not None:
        low, high = table.touch_down_n
        run.drawn["touch_down_n"] = (low + high) / 2
        run.settled["core"] = Settled(True, f"the film closes at {(low + high) / 2:.2f} N, within 0.01 N", None)
    elif not tabulated.touched_core:
        left = f"{-tabulated.closing_mm:.2f} mm of film are left above the asperities"
        run.settled["core"] = Settled(False, f"never touches the core below {table.loads_n[-1]:g} N: {left}")


def choose_rung(run: Synthesis, names: list[str], largest_n: float) -> None:
    """Give `run` the cheapest contact solver that keeps the scene's tolerance, and the estimate of the solver's error.

    The error is the solver's largest difference to the next more accurate one, over two loads and all channels. The
    last solver's error is at most its difference to the one before: halving the cells at least halves the error.

    Raises
    ------
    RigError
        If no contact solver keeps the tolerance; the message states the smallest error reached.
    """
    tolerance = run.scene.simulation.tolerance
    if tolerance is None:
        return
    # The place of a recording's contact scatters by a tenth of a millimetre: that changes no rung's error much.
    spec, body = run.sensor.model_dump_json(), (run.contact.radius_mm, run.contact.shape)
    key = f"{spec}|{body}|{largest_n}|{names}|{sorted(run.lent)}|{tolerance}|{slide_of(run)}"
    if key not in _CHOSEN:
        _CHOSEN[key] = _cheapest(run, names, largest_n, tolerance)
    run.rung, run.rung_error = _CHOSEN[key]
    run.fidelity = dataclasses.replace(RUNGS[run.rung], most_nodes=FINE.most_nodes)


def _cheapest(run: Synthesis, names: list[str], largest_n: float, tolerance: float) -> tuple[str, float]:
    error, own = float("inf"), _probed(run, names, largest_n, next(iter(RUNGS)))
    for low, high in itertools.pairwise(RUNGS):
        coarser, own = own, _probed(run, names, largest_n, high)
        if coarser is None or own is None:
            continue
        error = float(np.max(np.abs(coarser - own)))
        if error <= (1 - TABLE_SHARE) * tolerance:
            return low, error
    last = list(RUNGS)[-1]
    if error <= 2 * (1 - TABLE_SHARE) * tolerance:
        return last, error / 2
    raise RigError(
        f"No contact solver keeps the scene's tolerance {tolerance:g}: the finest is off by {error / 2:.2g}.",
        hint="Give a larger tolerance, or a sensor spec with more cells.",
    )


def _probed(run: Synthesis, names: list[str], largest_n: float, name: str) -> FloatArray | None:
    """Return the readings' changes from rest at the compared loads; for an observed slide, those in full slip, too.

    None if the contact solver `name` does not support this skin.
    """
    try:
        press, read = pressed(run, names, RUNGS[name])
    except RigError:
        return None
    states = [press(share * largest_n) for share in _PROBES]
    slide = slide_of(run)
    if names and slide is not None:
        from tactbench.rigs.twin.contact.tangential import dragged_state, tangential_of

        along, (direction, friction) = tangential_of(run.skin, press.medium.grid), slide
        states += [dragged_state(state, state, along, direction, friction, 0.0) for state in states]
    rest = read(press(0.0))
    return np.stack([read(state) - rest for state in states])


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
