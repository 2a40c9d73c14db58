"""The oracles of friction hold, and notice what is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tactbench.rigs.twin import partial_slip
from tactbench.rigs.twin.contact import slide_table
from tactbench.rigs.twin.effects import slip_event
from tactbench.rigs.twin.layer_kernel import shear_shapes
from tactbench.rigs.twin.verification import shear, tangential

CHECKS = {check.name: check for check in tangential.checks()}


@pytest.mark.parametrize("name", CHECKS)
def test_the_oracle_is_met(name):
    for verdict in CHECKS[name].run():
        assert verdict.met, verdict


def _missed(name):
    return {verdict.name for verdict in CHECKS[name].run() if not verdict.met}


def test_an_exponent_of_partial_slip_is_noticed(monkeypatch):
    wrong = lambda s: np.asarray(1.0 - (1.0 - s) ** 1.4)  # noqa: E731
    monkeypatch.setattr(tangential, "share_of_force", wrong)
    assert _missed("cattaneo") == {"force from tractions", "stick radius", "stiffness without slip, over that in slip"}
    assert "energy per cycle" in _missed("mindlin-cycle")


def test_a_stiffness_of_the_wrong_body_is_noticed(monkeypatch):
    # 8 a G*: that of a contact without slip.
    monkeypatch.setattr(tangential, "sliding_stiffness", lambda a, g: 8.0 * a * g)
    assert "displacement from tractions" in _missed("cattaneo")
    assert "energy per cycle" in _missed("mindlin-cycle")
    assert partial_slip.sliding_stiffness(np.array([3.0]), 2.0)[0] == pytest.approx(32.0)


def test_a_slip_caught_too_early_is_noticed(monkeypatch):
    early = lambda mode, u, speed: 0.999 * slip_event.slip_s(mode, u, speed)  # noqa: E731
    monkeypatch.setattr(tangential, "slip_s", early)
    assert "velocity when caught, less the surface's" in _missed("slip-event")
    monkeypatch.setattr("tactbench.rigs.twin.effects.stick_slip.slip_s", early)
    assert {"period at 5 mm/s", "force drop at 5 mm/s"} <= _missed("stick-slip")


@pytest.mark.parametrize("shape", [0, 1, 2])
def test_a_wrong_shape_of_a_layer_along_itself_is_noticed(shape, monkeypatch):
    def wrong(q, poisson):
        return tuple(-right if n == shape else right for n, right in enumerate(shear_shapes(q, poisson)))

    monkeypatch.setattr("tactbench.rigs.twin.contact.tangential.shear_shapes", wrong)
    assert _missed("cattaneo-skin" if shape else "boussinesq")


def test_a_whole_contact_that_slips_is_noticed(monkeypatch):
    monkeypatch.setattr(shear, "dragged_state", lambda *args: slide_table.dragged_state(*args[:-1], 0.0))
    assert "traction at 30% of slip, rms, of the largest friction" in _missed("cattaneo-skin")


def test_friction_that_forgets_its_load_is_noticed(monkeypatch):
    real = tangential.Dragged

    class Forgetful(real):
        def _lets_go(self, t, x, end):
            return real._lets_go(self, t, x, end) if t < 3 else (min(t + 0.05, end), x + 0.05 * self.drive.speed_mm_s)

    monkeypatch.setattr(tangential, "Dragged", Forgetful)
    # Sticking beyond the limit: the elastic force is held at it, the swing back is larger than the friction allows.
    assert _missed("friction-limit")


def test_an_explicit_bristle_is_noticed(monkeypatch):
    def euler(t_s, speed, limit, start):
        z = [start]
        for dt, g in zip(np.diff(t_s), limit, strict=False):
            z.append(z[-1] + dt * (speed - abs(speed) * z[-1] / g))
        return np.array(z)

    monkeypatch.setattr(tangential, "bristle", euler)
    assert {"one step of 2 dt less two of dt", "after a step of 1000 s"} <= _missed("bristle")


def test_a_mode_with_the_wrong_damping_is_noticed(monkeypatch):
    real = tangential.shaken
    louder = lambda t, u, mode: real(t, u, slip_event.Mode(mode.omega, 0.9 * mode.damping))  # noqa: E731
    monkeypatch.setattr(tangential, "shaken", louder)
    assert _missed("skin-mode") == {"resonance x 2 z"}
    assert math.isfinite(tangential.period_s(1.0))
