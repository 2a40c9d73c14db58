"""What conducting in a thin film leaves out under the BioTac's tip, where the film is twice as thick as a disc is wide.

The twin conducts in two dimensions, each disc joined by ``A (3/h + 4/(pi a))``. Here one disc on the core, of the
electrodes' radius, is fed through a film of the tip's thickness in three dimensions: axisymmetric finite elements
(scikit-fem, quadratic, graded towards the disc's edge), insulated above and below, grounded at a distance of the next
electrodes; even films, and films that thin or thicken from the disc outwards as the tip's does. First stands the tip
itself in hexahedra, on which the discs are staircases of nodes: coarser, but with the facet's true shape.

Usage: python studies/film_in_three_dimensions.py
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import skfem as fem
from scipy.sparse import diags
from scipy.sparse.linalg import cg
from skfem.models import poisson  # noqa: F401

from tactbench.sensors.biotac import SKIN, SPEC
from tactbench.sensors.biotac.conduction import Disc, Faces, FilmSheet, RimmedDiscs, faces_between
from tactbench.sensors.biotac.meshes import sheet_x
from tactbench.sensors.biotac.transduction import disc_at, mid_film_mm

OUTER, DOME, END = (SKIN.sheet.outer_radius.to("mm"), SKIN.sheet.dome.start.to("mm"), SKIN.sheet.x_max.to("mm"))

RADIUS = SPEC.parameters["electrode_radius"].to("mm")
REACH = 4.0
"""Where the film is grounded, from the disc's centre [mm]: about the distance of the tip's electrodes."""


def in_three_dimensions(thickness: Callable[[np.ndarray], np.ndarray], cells: int) -> float:
    """Return the resistance times sigma [1/mm] from the disc to the ground around it."""
    inner = RADIUS * (1 - np.linspace(1, 0, cells + 1) ** 2)
    outer = RADIUS + (REACH - RADIUS) * np.linspace(0, 1, 3 * cells + 1) ** 2
    height = np.linspace(0, 1, cells + 1) ** 1.5
    mesh = fem.MeshQuad.init_tensor(np.concatenate([inner, outer[1:]]), height)
    mesh = fem.MeshQuad2.from_mesh(mesh)
    places = mesh.doflocs.copy()
    places[1] *= thickness(places[0])
    basis = fem.Basis(fem.MeshQuad2(places, mesh.t), fem.ElementQuad2())

    @fem.BilinearForm
    def conduction(u, v, w):
        return 2 * math.pi * w.x[0] * (u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1])

    matrix = conduction.assemble(basis)
    small = 1e-9
    disc = basis.get_dofs(lambda x: (x[1] < small) & (x[0] < RADIUS + small)).all()
    ground = basis.get_dofs(lambda x: x[0] > REACH - small).all()
    potential = np.zeros(matrix.shape[0])
    potential[disc] = 1.0
    potential = fem.solve(*fem.condense(matrix, x=potential, D=np.union1d(disc, ground)))
    return 1.0 / float(potential @ matrix @ potential)


class _Grounded:
    """A disc of the twin's and everything beyond a circle held."""

    def __init__(self, x: np.ndarray) -> None:
        self._disc = RimmedDiscs(x, x, [Disc(0.0, 0.0, RADIUS)], [Disc(0.0, 0.0, RADIUS)])
        self.count, self.owner, self.under = 1, self._disc.owner, self._disc.under
        self._ground = 1e5 * (np.hypot(x[:, None], x[None, :]) > REACH).ravel()

    def joints(self, film_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self._disc.joints(film_mm)[0], self._ground

    def narrow(self, film_mm: np.ndarray, along_x: np.ndarray, along_s: np.ndarray) -> None:
        self._disc.narrow(film_mm, along_x, along_s)


def in_two_dimensions(thickness: Callable[[np.ndarray], np.ndarray], cells: int) -> float:
    """Return the same by the twin's own film."""
    x = (np.arange(cells) + 0.5) * 2.2 * REACH / cells - 1.1 * REACH
    film = thickness(np.hypot(x[:, None], x[None, :]))
    sheet = FilmSheet(Faces(np.ones((cells - 1, cells)), np.ones((cells, cells - 1))), _Grounded(x))
    return float(sheet.resistances(film)[0, 0])


FROM_MM, SEAM_RAD = -2.0, math.radians(90.0)


def _tip(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Return edges along and around of the film's tip on the sheet; the last ring would be a point."""
    return np.linspace(FROM_MM, END - 0.05, cells + 1), np.linspace(-SEAM_RAD, SEAM_RAD, cells + 1)


def tip_in_three_dimensions(electrode: int, share: float, cells: int, layers: int) -> float:
    """Return the resistance times sigma from one of the tip's electrodes to the film behind the tip: hexahedra.

    The electrode is every node of the core's face within its radius, so that it is known to half a cell.
    """
    x, angle = _tip(cells)
    film = share * SKIN.film.at(x, angle)
    core, skin = (mid_film_mm(x, angle, part, OUTER, DOME) for part in (0 * film, 2 * film))
    mesh = fem.MeshHex.init_tensor(np.arange(cells + 1.0), np.arange(cells + 1.0), np.linspace(0, 1, layers + 1) ** 1.5)
    i, j, depth = mesh.p[0].astype(int), mesh.p[1].astype(int), mesh.p[2]
    places = ((1 - depth)[:, None] * core[i, j] + depth[:, None] * skin[i, j]).T
    basis = fem.Basis(fem.MeshHex(np.ascontiguousarray(places), mesh.t), fem.ElementHex1())
    matrix = fem.models.poisson.laplace.assemble(basis).tocsr()
    disc, _ = _disc_of(electrode)
    (centre,) = mid_film_mm(np.array([disc.x_mm]), np.array([disc.s_mm / OUTER]), np.zeros((1, 1)), OUTER, DOME)[0]
    fed = (depth == 0) & (np.linalg.norm(places.T - centre, axis=1) < RADIUS)
    held = fed | (i == 0)
    inner = np.flatnonzero(~held)
    right = -np.asarray(matrix[inner][:, np.flatnonzero(fed)].sum(axis=1)).ravel()
    system = matrix[inner][:, inner]
    scale = diags(1.0 / system.diagonal())
    found, failed = cg(system, right, rtol=1e-8, M=scale, maxiter=20000)
    assert not failed
    potential = fed.astype(float)
    potential[inner] = found
    return 1.0 / float(potential @ (matrix @ potential))


def _disc_of(electrode: int) -> tuple[Disc, tuple[float, float]]:
    channel = SPEC.channels("taxel")[electrode - 1]
    x, y, z = (1e3 * part for part in channel.position_m)
    place = sheet_x(x, math.hypot(y, z), OUTER, DOME)
    made = disc_at(SPEC, place, math.atan2(y, -z), RADIUS)
    return made, made.stretch


class _Behind:
    """One disc of the twin's, and the film's first row held at its edge."""

    def __init__(self, x: np.ndarray, s: np.ndarray, disc: Disc, along: np.ndarray) -> None:
        self._disc = RimmedDiscs(x, s, [disc], [disc])
        self.count, self.owner, self.under = 1, self._disc.owner, self._disc.under
        self._along = along

    def joints(self, film_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        held = np.zeros(film_mm.shape)
        held[0] = 2 * self._along * film_mm[0]
        return self._disc.joints(film_mm)[0], held.ravel()

    def narrow(self, film_mm: np.ndarray, along_x: np.ndarray, along_s: np.ndarray) -> None:
        self._disc.narrow(film_mm, along_x, along_s)


def tip_in_two_dimensions(electrode: int, share: float, cells: int) -> float:
    """Return the same by the twin's own film."""
    x, angle = _tip(cells)
    faces = faces_between(mid_film_mm(x, angle, share * SKIN.film.at(x, angle), OUTER, DOME))
    centre_x, centre_angle = (x[1:] + x[:-1]) / 2, (angle[1:] + angle[:-1]) / 2
    contacts = _Behind(centre_x, centre_angle * OUTER, _disc_of(electrode)[0], faces.along_x[0])
    return float(FilmSheet(faces, contacts).resistances(share * SKIN.film.at(centre_x, centre_angle))[0, 0])


def main() -> None:
    """Print the tables."""
    print(f"the tip from x = {FROM_MM:g} mm on, electrodes one at a time: thin film against 3-D, at two refinements")
    for electrode in (7, 8, 10):
        for share in (1.0, 0.6):
            thin = tip_in_two_dimensions(electrode, share, 160)
            coarse, true = (tip_in_three_dimensions(electrode, share, *size) for size in ((64, 6), (96, 9)))
            print(f"  E{electrode}, film x {share:g}: thin {thin:.4f}, 3-D {coarse:.4f}, {true:.4f} 1/mm "
                  f"({100 * (thin / true - 1):+.1f} %)")  # fmt: skip
    print(f"disc of {RADIUS:g} mm, ground {REACH:g} mm around: resistance times sigma, 1/mm; thin film against 3-D")
    conductivity = SPEC.parameters["conductivity"].to("S/m") * SPEC.parameters["reference_resistor"].to("ohm") * 1e-3
    for label, thickness in (
        *((f"even, {h:g} mm", lambda r, h=h: np.full_like(r, h)) for h in (0.06, 0.15, 0.3, 0.6, 1.3, 1.8, 2.4)),
        ("2.4 mm, falling by 0.35 a mm", lambda r: 2.4 - 0.35 * np.minimum(r, REACH)),
        ("1.3 mm, rising by 0.5 a mm", lambda r: 1.3 + 0.5 * np.minimum(r, REACH)),
    ):
        coarse, true = (in_three_dimensions(thickness, cells) for cells in (12, 24))
        thin = in_two_dimensions(thickness, 400)
        # What it moves a reading of 3237 counts by, if all of its resistance were this.
        counts = [4095 * conductivity / (conductivity + value) for value in (thin, true)]
        print(f"  {label:<30} 3-D {true:7.4f} (twice as coarse {coarse / true - 1:+.1e})  thin film {thin:7.4f}  "
              f"{100 * (thin / true - 1):+5.1f} %  {counts[0] - counts[1]:+6.1f} counts")  # fmt: skip


if __name__ == "__main__":
    main()
