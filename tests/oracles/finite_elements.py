"""A bonded layer by axisymmetric finite elements, which share nothing with the layer's kernel but the equations.

A paraboloid ``r²/2R`` is pressed to a given depth into it, without friction. Displacements are biquadratic and a
pressure field bilinear (Taylor-Hood), so that nothing locks as nu goes to 1/2.
"""

from __future__ import annotations

import numpy as np

RADIUS, THICKNESS, REACH = 10.0, 2.0, 16.0
"""Indenter, layer and where the layer ends (free), mm: six thicknesses beyond the contact nothing is felt any more."""


def surface_compliance(poisson: float, radii: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the r of the top nodes and the (n, n) vertical displacements under unit vertical ring forces, E = 1."""
    import skfem
    from scipy.sparse import bmat
    from scipy.sparse.linalg import splu

    mesh = skfem.MeshQuad.init_tensor(radii, heights)
    displacement = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad2()), intorder=6)
    pressure = displacement.with_element(skfem.ElementQuad1())
    shear = 0.5 / (1 + poisson)
    lame = poisson / ((1 + poisson) * (1 - 2 * poisson))

    @skfem.BilinearForm
    def stiffness(u, v, w):
        r, strain = w.x[0], 0.0
        for i in range(2):
            for j in range(2):
                strain = strain + 0.25 * (u.grad[i, j] + u.grad[j, i]) * (v.grad[i, j] + v.grad[j, i])
        return 2 * np.pi * 2 * shear * (strain * r + u[0] * v[0] / r)

    @skfem.BilinearForm
    def divergence(u, q, w):
        return -2 * np.pi * q * ((u.grad[0, 0] + u.grad[1, 1]) * w.x[0] + u[0])

    @skfem.BilinearForm
    def bulk(p, q, w):
        return -2 * np.pi * p * q * w.x[0] / lame

    k, b, c = (
        stiffness.assemble(displacement),
        divergence.assemble(displacement, pressure),
        bulk.assemble(pressure),
    )
    system = bmat([[k, b.T], [b, c]], format="csc")
    fixed = displacement.get_dofs(lambda x: np.isclose(x[1], 0)).all()
    axis = displacement.get_dofs(lambda x: np.isclose(x[0], 0)).all(["u^1"])
    free = np.setdiff1d(np.arange(system.shape[0]), np.union1d(fixed, axis))
    top = displacement.get_dofs(lambda x: np.isclose(x[1], THICKNESS)).all(["u^2"])
    top = top[np.argsort(displacement.doflocs[0, top])]
    places = np.searchsorted(free, top)
    loads = np.zeros((free.size, top.size))
    loads[places, np.arange(top.size)] = 1.0
    answer = splu(system[free][:, free]).solve(loads)
    return displacement.doflocs[0, top], answer[places]


def force_at(depth: float, r: np.ndarray, compliance: np.ndarray) -> float:
    """Return the force that holds the paraboloid at a depth: nodes that would pull leave, nodes inside it enter."""
    wanted = depth - r**2 / (2 * RADIUS)
    active = wanted > 0
    for _ in range(50):
        forces = np.zeros_like(r)
        forces[active] = np.linalg.solve(compliance[np.ix_(active, active)], wanted[active])
        inside = compliance @ forces < wanted - 1e-12
        now = (active & (forces >= 0)) | (~active & inside)
        if np.array_equal(now, active):
            return float(forces.sum())
        active = now
    raise AssertionError("the active set of the finite elements did not settle")


def graded(edge: float, fineness: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes that are even up to `edge` and grow beyond, and heights that are fine at the top."""
    step = edge / 8
    fine = np.linspace(0, edge, 24 * fineness + 1)
    outside = edge + step * (np.geomspace(1, 1 + (REACH - edge) / step, 7 * fineness + 1)[1:] - 1)
    return np.concatenate([fine, outside]), THICKNESS * (1 - (1 - np.linspace(0, 1, 6 * fineness + 1)) ** 1.5)
