"""Numbers read off answers: bands by commanded force, noise of predictions, thinned rows."""

import numpy as np
import pytest

from tactbench.core.calibration.readoff import commanded_n, roughness
from tactbench.core.errors import DataError
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.scene import Scene
from tests.core.evaluation.made import sensor

ONE = np.zeros(6000, dtype=np.int64)
META = RecordingMeta(
    name="a", sensor=sensor(), rig="made", clock="none", scene=Scene(name="a", profile=ForceRamp(samples=6000))
)


def test_roughness_is_the_noise_of_predictions_whatever_their_slope():
    rng = np.random.default_rng(2)
    straight = np.linspace(-3, 40, 6000)
    # A straight line drops out but for rounding.
    assert roughness(straight, ONE, 41) < 1e-13
    # 6000 numbers in differences that share a third of their terms: the sd is known to about 2 %; four of them.
    assert roughness(straight + 0.2 * rng.standard_normal(6000), ONE, 41) == pytest.approx(0.2, rel=0.08)


def test_roughness_never_crosses_recordings():
    two = np.repeat([0, 1], 3000)
    step = np.where(two == 0, 0.0, 100.0)
    assert roughness(step, two, 41) == 0
    assert roughness(step, ONE, 41) > 1
    with pytest.raises(DataError, match="83 predictions"):
        roughness(step[:80], ONE[:80], 41)


def test_the_commanded_force_is_the_scenes():
    rows = np.array([0, 719, 720, 3360, 5999])
    # Hold to 7.2 s (row 720 of 6000 in 60 s), then straight to 5 N at 60 s.
    expected = [0, 0, 0, 5 * (33.6 - 7.2) / 52.8, 5 * (59.99 - 7.2) / 52.8]
    np.testing.assert_allclose(commanded_n([META], np.zeros(5, dtype=np.int64), rows), expected, rtol=1e-12, atol=1e-12)
