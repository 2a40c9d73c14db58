"""What laying the BioTac's dome out flat does to conduction in its film.

The twin conducts on one flat sheet; on the dome (x > 0) that sheet is too short along the meridian and too wide
around it. Here the same plain finite volumes are solved twice, on the sheet's metric and on the hemisphere's own, at
rest and under caps pressed on the pad and near the tip (the deflection is the twin's own, cell by cell, in both). Discs
are sampled in the metric at hand. The discretisation is cruder than the twin's: only the difference says something.

Usage: python benchmarks/unrolling.py
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from tactbench.rigs.twin.contact.core import with_core
from tactbench.rigs.twin.contact.press import Press
from tactbench.rigs.twin.contact.skins import medium_of
from tactbench.rigs.twin.geometry import Contact, gap_mm, skin_grid
from tactbench.sensors.biotac.film import film_at_rest, refined, spectral_interpolation, with_tail
from tactbench.sensors.biotac.spec import SPEC

PAR, SKIN = SPEC.parameters, SPEC.skin
CORE, FILM = PAR["core_radius"].to("mm"), PAR["film_radius"].to("mm")
OUTER = SKIN.sheet.outer_radius.to("mm")
PER_RADIAN = SKIN.sheet.dome.arc_per_radian.to("mm")
GRID = skin_grid(SKIN.sheet)
FINE, TAIL = with_tail(refined(GRID, 2, shrink_s=FILM / OUTER), PAR["film_tail"].to("mm"))
S_FILM = FINE.s_mm * FILM / OUTER
DX, DS = float(FINE.x_mm[1] - FINE.x_mm[0]), float(S_FILM[1] - S_FILM[0])


def stretches(*, true: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return what a sheet's millimetre is along and around the finger, at each x."""
    if not true:
        return np.ones_like(FINE.x_mm), np.ones_like(FINE.x_mm)
    phi = np.clip(FINE.x_mm / PER_RADIAN, 0.0, math.pi / 2)
    on_dome = FINE.x_mm > 0
    return np.where(on_dome, FILM / PER_RADIAN, 1.0), np.cos(phi)


def readings(film: np.ndarray, *, true: bool) -> np.ndarray:
    """Return the 19 electrodes' counts over a (nx, ns) film."""
    along, around = stretches(true=true)
    nx, ns = film.shape
    number = np.arange(nx * ns).reshape(nx, ns)
    rows, columns, values = [], [], []

    def join(one: np.ndarray, other: np.ndarray, conductance: np.ndarray) -> None:
        for a, b in ((one, other), (other, one)):
            rows.extend((a.ravel(), a.ravel()))
            columns.extend((a.ravel(), b.ravel()))
            values.extend((conductance.ravel(), -conductance.ravel()))

    mean = lambda a, b: 2 * a * b / (a + b)  # noqa: E731
    half = (along[1:] + along[:-1]) / 2, (around[1:] + around[:-1]) / 2
    join(number[1:], number[:-1], mean(film[1:], film[:-1]) * (DS * half[1] / (DX * half[0]))[:, None])
    join(number[:, 1:], number[:, :-1], mean(film[:, 1:], film[:, :-1]) * (DX * along / (DS * around))[:, None])
    load = np.zeros(nx * ns + 19)
    leak = 1e3 / (PAR["conductivity"].to("S/m") * PAR["reference_resistor"].to("ohm"))

    def disc(x: float, s: float, radius: float) -> np.ndarray:
        sub = (np.arange(8) + 0.5) / 8 - 0.5
        xs, ss = (FINE.x_mm[:, None] + sub * DX - x), (S_FILM[:, None] + sub * DS - s)
        inside = (xs[:, None, :, None] * along[:, None, None, None]) ** 2 + (
            ss[None, :, None, :] * around[:, None, None, None]
        ) ** 2 <= radius**2
        share = inside.mean(axis=(2, 3)) * (along * around)[:, None]
        return share * (math.pi * radius**2 / share.sum())

    for electrode, channel in enumerate(SPEC.channels("taxel")):
        x, y, z = (1e3 * value for value in channel.position_m)
        axial = x if x <= 0 else PER_RADIAN * math.asin(min(x / CORE, 1.0))
        area = disc(axial, FILM * math.atan2(y, -z), 0.6)
        contact = area * (3 / film + 4 / (math.pi * 0.6))
        touched = area > 0
        own = np.full(touched.sum(), nx * ns + electrode)
        join(number[touched], own, contact[touched])
        rows.append(own[:1]), columns.append(own[:1]), values.append(np.array([leak]))
    for pair in ("front", "back"):
        x, arc = PAR[f"excitation_x_{pair}"].to("mm"), PAR[f"excitation_arc_{pair}"].to("mm") * FILM / CORE
        for side in (-arc, arc):
            area = disc(x, side, 0.8)
            driven = area * (3 / film + 4 / (math.pi * 0.8))
            rows.append(number.ravel()), columns.append(number.ravel()), values.append(driven.ravel())
            load[: nx * ns] += driven.ravel()
    matrix = coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))).tocsc()
    return 4095 * spsolve(matrix, load)[nx * ns :]


def main() -> None:
    """Print the table."""
    rest = np.maximum(np.broadcast_to(film_at_rest(SKIN, FINE.s_mm), (FINE.x_mm.size, FINE.s_mm.size)), 0.06)
    to_x = np.vstack([np.zeros((TAIL, GRID.x_mm.size)), spectral_interpolation(GRID.x_mm.size, FINE.x_mm.size - TAIL)])
    to_s = spectral_interpolation(GRID.s_mm.size, FINE.s_mm.size).T
    flat0, true0 = readings(rest, true=False), readings(rest, true=True)
    tip = [6, 7, 8, 9]
    others = [number for number in range(19) if number not in tip]
    print(f"at rest: tip's electrodes {np.round(flat0[tip])} on the sheet, {np.round(true0[tip])} on the dome; "
          f"the others differ by at most {np.abs(flat0 - true0)[others].max():.0f} counts")  # fmt: skip
    print("change from rest under 2 and 5 N, rms counts: sheet, difference to the dome; tip's electrodes, the others")
    for radius in (10.0, 40.0, math.inf):
        for x in (-5.0, 0.0):
            medium = medium_of(SKIN, GRID)
            contact = Contact(radius, x, 0.0)
            gap = gap_mm(GRID, contact, OUTER, SKIN.sheet.dome)
            press = Press(medium, gap, contact, core=lambda made: with_core(made, SKIN))
            for force in (2.0, 5.0):
                film = np.maximum(rest - to_x @ press(force).deflection_mm @ to_s, 0.06)
                sheet, dome = readings(film, true=False) - flat0, readings(film, true=True) - true0
                rms = [np.sqrt(np.mean(part**2)) for part in (sheet[tip], (sheet - dome)[tip], sheet[others],
                                                              (sheet - dome)[others])]  # fmt: skip
                print(f"  R {radius:5g} mm, x {x:4.1f}, {force:g} N: tip {rms[0]:6.1f} {rms[1]:6.1f}   "
                      f"others {rms[2]:6.1f} {rms[3]:6.1f}")  # fmt: skip


if __name__ == "__main__":
    main()
