"""Contact solvers on one core: error against time, own and others', in one run.

Hertz: a paraboloid R = 10 mm on a half-space E* = 1 MPa under 1 N, 8 x 8 mm. Layer: the same paraboloid on a bonded
layer h = 2 mm, E = 1 MPa, nu = 0.3 at 5.3011 N, which axisymmetric finite elements put at a depth of 0.5 mm. Peers
that are not installed get a row that says so. Solvers stop by different rules: what can be compared is time at equal
error of the depth. The boundary elements are those of tests/oracles, which the product's Newton solver is held against.

Rounds are interleaved; times are medians of solves alone, with set-up (kernels, models, factors) in a column of its
own: processor time of all threads, which is wall time on an idle core and does not count what others compute. MuJoCo's
flexes are stepped until they rest and are run once.

Usage: python benchmarks/contact_peers.py [--rounds N] [--csv FILE] [--json FILE] [--without-mujoco]
"""

from __future__ import annotations

import argparse
import csv
import importlib.metadata
import json
import math
import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import numpy as np  # noqa: E402  (reads the number of threads when it is loaded)

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # the references are among the tests
RADIUS, FORCE, SIDE = 10.0, 1.0, 8.0
CONTACT = (0.75 * FORCE * RADIUS) ** (1 / 3)
DEPTH, PEAK = CONTACT**2 / RADIUS, 1.5 * FORCE / (math.pi * CONTACT**2)
LAYER_FORCE, LAYER_DEPTH, LAYER_SIDE = 5.3011, 0.5, 24.0
TAMAAS_TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5)


@dataclass
class Row:
    """One solver at one resolution."""

    problem: str
    solver: str
    grid: str
    error: float = math.nan
    """Of the depth under the force, or of the force at the depth where `quantity` says so; relative."""
    peak_error: float = math.nan
    quantity: str = "depth"
    set_up_ms: float = math.nan
    note: str = ""
    seconds: list[float] = field(default_factory=list)

    @property
    def median_ms(self) -> float:
        """Median time of a solve."""
        return 1e3 * statistics.median(self.seconds) if self.seconds else math.nan


Solve = Callable[[], tuple[float, float]]
"""Solves once; returns the error and the error of the largest pressure."""


def paraboloid(cells: int, side: float) -> np.ndarray:
    """Return the gap on a square grid."""
    x = (np.arange(cells) + 0.5) * (side / cells) - side / 2
    return (x[:, None] ** 2 + x[None, :] ** 2) / (2 * RADIUS)


def own_elements(cells: int, tolerance: float, layer: bool) -> Solve:
    """Return the reference solver of this project's tests."""
    from tests.oracles.boundary_elements import HalfSpace, Layer, paraboloid_mm, press

    kernel = Layer(1.0, 0.3, 2.0) if layer else HalfSpace(1.0)
    side, force, depth = (LAYER_SIDE, LAYER_FORCE, LAYER_DEPTH) if layer else (SIDE, FORCE, DEPTH)
    gap, cell = paraboloid_mm(cells, side, RADIUS), side / cells

    def solve() -> tuple[float, float]:
        found = press(kernel, gap, (cell, cell), force, tolerance=tolerance)
        return found.depth_mm / depth - 1, math.nan if layer else found.pressure_mpa.max() / PEAK - 1

    return solve


def own_newton(cells: int, penalty: float) -> Solve:
    """Return the default solver of this project on the layer, from a cold start."""
    from tactbench.plugin import assumed
    from tactbench.plugin.simulation import BondedLayer, SkinSheet
    from tactbench.rigs.twin.contact.newton import NewtonSolver
    from tactbench.rigs.twin.contact.stages import medium_of
    from tactbench.rigs.twin.geometry import skin_grid

    half = LAYER_SIDE / 2
    skin = BondedLayer(
        sheet=SkinSheet(
            x_min=assumed(-half, "mm", "here"), x_max=assumed(half, "mm", "here"),
            arc=assumed(LAYER_SIDE, "mm", "here"), cells=(cells, cells),
        ),
        young=assumed(1.0, "MPa", "here"), poisson=assumed(0.3, "1", "here"), thickness=assumed(2.0, "mm", "here"),
        contact_stiffness=assumed(penalty, "MPa/mm", "here"),
    )  # fmt: skip
    solver = NewtonSolver(medium_of(skin, skin_grid(skin.sheet)), paraboloid(cells, LAYER_SIDE))
    return lambda: (solver.solve(LAYER_FORCE).depth_mm / LAYER_DEPTH - 1, math.nan)


def tamaas_dcfft(cells: int, tolerance: float) -> Solve:
    """Return tamaas's Polonsky-Keer-Rey solver with its non-periodic operator."""
    import tamaas as tm

    tm.initialize(1)
    tm.set_log_level(tm.LogLevel.error)
    model = tm.ModelFactory.createModel(tm.model_type.basic_2d, [SIDE, SIDE], [cells, cells])
    model.E, model.nu = 1.0, 0.0
    tm.ModelFactory.registerNonPeriodic(model, "dcfft")
    gap = paraboloid(cells, SIDE)
    solver = tm.PolonskyKeerRey(model, -gap, tolerance)
    solver.setIntegralOperator("dcfft")

    def solve() -> tuple[float, float]:
        model.traction[:] = 0.0
        solver.solve(FORCE / SIDE**2)
        return math.nan, model.traction.max() / PEAK - 1

    def depth() -> float:
        pressure, sinking = np.array(model.traction), np.zeros((cells, cells))
        model.operators["dcfft"](pressure, sinking)
        return float((sinking + gap)[pressure > 0].mean()) / DEPTH - 1

    solve.after = depth  # type: ignore[attr-defined]
    return solve


def contact_mechanics(cells: int) -> Solve:
    """Return ContactMechanics with its free-space operator, at Hertz's depth."""
    from ContactMechanics import FreeFFTElasticHalfSpace
    from ContactMechanics.Systems import NonSmoothContactSystem
    from SurfaceTopography import Topography

    topography = Topography(-paraboloid(cells, SIDE), (SIDE, SIDE))
    system = NonSmoothContactSystem(FreeFFTElasticHalfSpace((cells, cells), 1.0, (SIDE, SIDE)), topography)

    def solve() -> tuple[float, float]:
        try:
            done = system.minimize_proxy(offset=DEPTH, pentol=1e-4 * DEPTH, maxiter=300)
        except AttributeError as error:  # what it ends in when the limit is hit
            raise RuntimeError("did not converge in 300 iterations") from error
        if not done.success:
            raise RuntimeError("did not converge in 300 iterations")
        return system.compute_normal_force() / FORCE - 1, np.max(system.force) * (cells / SIDE) ** 2 / PEAK - 1

    return solve


def finite_elements(fineness: int, layer: bool) -> Solve:
    """Return axisymmetric biquadratic scikit-fem elements; the half-space is a block of 2 m."""
    import skfem
    from scipy.sparse.linalg import splu

    edge, reach, height = (4.0, 16.0, 2.0) if layer else (2.6, 2000.0, 2000.0)
    step = edge / 8
    radii = np.concatenate([
        np.linspace(0, edge, 24 * fineness + 1),
        edge + step * (np.geomspace(1, 1 + (reach - edge) / step, 7 * fineness + 1)[1:] - 1),
    ])  # fmt: skip
    if layer:
        heights = height * (1 - (1 - np.linspace(0, 1, 6 * fineness + 1)) ** 1.5)
    else:
        heights = height - step * (np.geomspace(1, 1 + height / step, 14 * fineness + 1)[::-1] - 1)
    nu = 0.3 if layer else 0.0
    shear, lame = 0.5 / (1 + nu), nu / ((1 + nu) * (1 - 2 * nu))
    basis = skfem.Basis(skfem.MeshQuad.init_tensor(radii, heights), skfem.ElementVector(skfem.ElementQuad2()))
    wanted, truth = (LAYER_DEPTH, LAYER_FORCE) if layer else (DEPTH, FORCE)

    @skfem.BilinearForm
    def stiffness(u, v, w):  # type: ignore[no-untyped-def]
        r, strain = w.x[0], 0.0
        for i in range(2):
            for j in range(2):
                strain = strain + 0.25 * (u.grad[i, j] + u.grad[j, i]) * (v.grad[i, j] + v.grad[j, i])
        spread = (u.grad[0, 0] + u.grad[1, 1]) * r + u[0]
        return 2 * np.pi * (2 * shear * (strain * r + u[0] * v[0] / r)
                            + lame * spread * (v.grad[0, 0] + v.grad[1, 1] + v[0] / r))  # fmt: skip

    def solve() -> tuple[float, float]:
        system = stiffness.assemble(basis).tocsc()
        fixed = basis.get_dofs(lambda x: np.isclose(x[1], 0)).all()
        axis = basis.get_dofs(lambda x: np.isclose(x[0], 0)).all(["u^1"])
        free = np.setdiff1d(np.arange(system.shape[0]), np.union1d(fixed, axis))
        top = basis.get_dofs(lambda x: np.isclose(x[1], height) & (x[0] < edge)).all(["u^2"])
        loads = np.zeros((free.size, top.size))
        places = np.searchsorted(free, top)
        loads[places, np.arange(top.size)] = 1.0
        compliance = splu(system[free][:, free]).solve(loads)[places]
        lift = wanted - basis.doflocs[0, top] ** 2 / (2 * RADIUS)
        active = lift > 0
        for _ in range(50):
            forces = np.zeros(top.size)
            forces[active] = np.linalg.solve(compliance[np.ix_(active, active)], lift[active])
            now = (active & (forces >= 0)) | (~active & (compliance @ forces < lift - 1e-12))
            if np.array_equal(now, active):
                break
            active = now
        return float(forces.sum()) / truth - 1, math.nan

    return solve


def mujoco_flex(cells: tuple[int, int]) -> Solve:
    """Return a box of 12 x 12 x 6 mm of flex elements under a ball, stepped for 3 s; truth: a layer 6 mm thick."""
    import mujoco

    from tests.oracles.boundary_elements import Layer, paraboloid_mm, pressed

    wide, high = cells
    depth, low, up = 0.4, 1.0, 3.0
    for _ in range(40):
        truth = 0.5 * (low + up)
        found = pressed(Layer(1.0, 0.3, 6.0), paraboloid_mm(192, 48.0, RADIUS), 48.0, truth)
        low, up = (truth, up) if found.depth_mm < depth else (low, truth)
    stiff = 'solref="0.02 1" solimp="0.99 0.999 0.001"'
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="0.005" integrator="discrete" gravity="0 0 0"/><worldbody>
      <flexcomp name="pad" type="grid" count="{wide} {wide} {high}" dim="3" radius="0.001" mass="1" pos="0 0 3"
                spacing="{12 / (wide - 1)} {12 / (wide - 1)} {6 / (high - 1)}">
        <elasticity young="1" poisson="0.3" damping="0.05"/><contact selfcollide="none" {stiff}/>
        <pin gridrange="0 0 0 {wide - 1} {wide - 1} 0"/></flexcomp>
      <body mocap="true" pos="0 0 {16 - depth}"><geom type="sphere" size="10" {stiff}/></body>
      </worldbody></mujoco>""")

    def solve() -> tuple[float, float]:
        data, began = mujoco.MjData(model), time.process_time()
        while data.time < 3.0:
            mujoco.mj_step(model, data)
            if time.process_time() - began > 60:
                raise RuntimeError("not at rest after 60 s")
        force, one = 0.0, np.zeros(6)
        for i in range(data.ncon):
            mujoco.mj_contactForce(model, data, i, one)
            force += one[0] * abs(data.contact[i].frame[2])
        return force / truth - 1, math.nan

    return solve


def main() -> None:
    """Run the rounds and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--csv", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--without-mujoco", action="store_true")
    options = parser.parse_args()
    jobs: list[tuple[Row, Callable[[], Solve], str, int]] = []

    def add(row: Row, make: Callable[[], Solve], package: str = "", rounds: int = options.rounds) -> None:
        jobs.append((row, make, package, rounds))

    for n in (64, 128, 256):
        for tolerance in (1e-4, 1e-8):
            add(Row("hertz", f"own boundary elements {tolerance:.0e}", f"{n}²"),
                lambda n=n, t=tolerance: own_elements(n, t, layer=False))  # fmt: skip
        for tolerance in (*TAMAAS_TOLERANCES, 1e-8):
            add(Row("hertz", f"tamaas dcfft {tolerance:.0e}", f"{n}²"),
                lambda n=n, t=tolerance: tamaas_dcfft(n, t), "tamaas")  # fmt: skip
        add(Row("hertz", "ContactMechanics free", f"{n}²", quantity="force"),
            lambda n=n: contact_mechanics(n), "ContactMechanics")  # fmt: skip
    for n in (64, 128, 256):
        add(Row("layer", "own boundary elements 1e-08", f"{n}²"), lambda n=n: own_elements(n, 1e-8, layer=True))
    for n in (48, 96):
        add(Row("layer", "own default Newton, 300 MPa/mm", f"{n}²"), lambda n=n: own_newton(n, 300.0))
    for problem in ("hertz", "layer"):
        for fineness in (1, 2):
            add(Row(problem, "scikit-fem axisymmetric", f"{24 * fineness} in contact", quantity="force"),
                lambda f=fineness, p=problem: finite_elements(f, p == "layer"), "scikit-fem")  # fmt: skip
    if not options.without_mujoco:
        for cells in ((9, 5), (13, 7)):
            add(Row("layer", "MuJoCo flex, h = 6 mm", f"{cells[0]}²x{cells[1]}", quantity="force",
                    note="one run, ball of 10 mm at 0.4 mm"),
                lambda c=cells: mujoco_flex(c), "mujoco", 1)  # fmt: skip
    rows = run(jobs, options.rounds)
    show(rows)
    records = [{**asdict(row), "median_ms": row.median_ms} for row in rows]
    if options.json:
        options.json.write_text(json.dumps(records, indent=1))
    if options.csv:
        with options.csv.open("w", newline="") as target:
            writer = csv.DictWriter(target, fieldnames=list(records[0]))
            writer.writeheader()
            writer.writerows(records)


def run(jobs: list[tuple[Row, Callable[[], Solve], str, int]], rounds: int) -> list[Row]:
    """Set every solver up, then solve turn and turn about."""
    solvers: list[tuple[Row, Solve, int]] = []
    for row, make, package, most in jobs:
        try:
            if package:
                row.solver = row.solver.replace(" ", f" {importlib.metadata.version(package)} ", 1)
            began = time.process_time()
            solve = make()
            if most > 1:
                solve()
            row.set_up_ms = 1e3 * (time.process_time() - began)
            solvers.append((row, solve, most))
        except importlib.metadata.PackageNotFoundError:
            row.note = f"not installed: pip install {package}"
        except RuntimeError as error:
            row.note = str(error)
    for turn in range(rounds):
        for row, solve, most in solvers:
            if turn < most and not (row.note and row.note.startswith("not at rest")):
                began = time.process_time()
                try:
                    row.error, row.peak_error = solve()
                except RuntimeError as error:
                    row.note = str(error)
                    continue
                row.seconds.append(time.process_time() - began)
                if turn == 0 and hasattr(solve, "after"):
                    solve.depth = solve.after()
                if hasattr(solve, "depth"):
                    row.error = solve.depth
    for row, _, most in solvers:
        if most > 1 and row.seconds:
            row.set_up_ms = max(row.set_up_ms - row.median_ms, 0.0)
    return [row for row, *_ in jobs]


def show(rows: list[Row]) -> None:
    """Print the table."""
    print(f"cores {os.cpu_count()}, one thread; processor time: median of a solve; set-up: once per grid")
    print(f"{'problem':<8}{'solver':<40}{'grid':<15}{'ms':>9}{'set-up':>9}  {'error':>9} of      {'p0':>9}  note")
    for row in rows:
        print(f"{row.problem:<8}{row.solver:<40}{row.grid:<15}{row.median_ms:>9.2f}{row.set_up_ms:>9.1f}  "
              f"{row.error:>9.1e} {row.quantity:<6} {row.peak_error:>9.1e}  {row.note}")  # fmt: skip


if __name__ == "__main__":
    main()
