"""The checks of contact are met, and would not be if the physics were wrong."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from tactbench.rigs.twin.boundary_elements import kernels, operator
from tactbench.rigs.twin.closed_forms.adhesion import Jkr
from tactbench.rigs.twin.contact import layer
from tactbench.rigs.twin.verification.contact import GROUP, checks

CHECKS = {check.name: check for check in checks()}


def misses(name: str) -> set[str]:
    return {verdict.name for verdict in CHECKS[name].run() if not verdict.met}


def test_checks_have_names_of_their_own():
    assert len(CHECKS) == len(checks())
    assert {check.group for check in checks()} == {GROUP}


@pytest.mark.parametrize("name", CHECKS)
def test_every_verdict_is_met_and_says_why(name):
    verdicts = CHECKS[name].run()
    assert max(Counter(verdict.name for verdict in verdicts).values()) == 1
    for verdict in verdicts:
        assert verdict.source
        assert verdict.met, f"{verdict.name}: {verdict.found:.3e} not in [{verdict.low:.3g}, {verdict.high:.3g}]"


@pytest.fixture
def broken(monkeypatch):
    """Replaces a function for one test, and forgets the transforms made with it."""
    yield monkeypatch.setattr
    monkeypatch.undo()
    forget()


def forget() -> None:
    operator.operator.cache_clear()
    operator._influence.cache_clear()


@pytest.mark.parametrize("name", ["hertz", "flat-punch", "point-load", "partial-slip"])
def test_a_half_space_one_per_cent_too_soft_is_seen(name, broken):
    true = kernels.HalfSpace.influence
    broken(kernels.HalfSpace, "influence", lambda self, cells, cell: 1.01 * true(self, cells, cell))
    forget()
    assert misses(name)


@pytest.mark.parametrize("name", ["thin-layers", "layer-elements"])
def test_a_layer_two_per_cent_too_soft_for_long_waves_is_seen(name, broken):
    true = kernels.compliance_shape
    broken(kernels, "compliance_shape", lambda q, poisson: true(q, poisson) * (1 + 0.02 / (1 + q)))
    forget()
    assert misses(name)


def test_a_default_solver_two_per_cent_too_soft_is_seen(broken):
    true = layer.compliance_shape
    broken(layer, "compliance_shape", lambda q, poisson: 1.02 * true(q, poisson))
    assert misses("penalty")


def test_a_kernel_that_is_not_even_is_seen(broken):
    true = operator.Operator.displacement
    broken(operator.Operator, "displacement", lambda self, p: true(self, p) + 1e-9 * np.roll(p, 1, axis=0))
    found = misses("kernel-laws")
    assert {name.split(": ")[1] for name in found} >= {"reciprocity", "mirrored pressure, mirrored sinking"}


def test_pressures_that_do_not_superpose_are_seen(broken):
    true = operator.Operator.displacement
    broken(operator.Operator, "displacement", lambda self, p: true(self, p) + 1e-9 * p**2)
    assert "half-space: superposition" in misses("kernel-laws")


def test_a_depth_that_forgets_a_length_is_seen(broken):
    true = kernels.Layer.influence
    broken(kernels.Layer, "influence", lambda self, cells, cell: true(self, cells, cell) + 1e-6)
    forget()
    assert misses("scaling")


@pytest.mark.parametrize("method", ["force_n", "depth_mm"])
def test_a_sticky_contact_one_per_cent_off_is_seen(method, broken):
    true = getattr(Jkr, method)
    broken(Jkr, method, lambda self, a: 1.01 * true(self, a))
    assert misses("jkr")
