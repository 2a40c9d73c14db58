"""The floor of the reference, from the unloaded holds of the force task's own scenes on the twin."""

import numpy as np
import pytest

from tactbench.core.evaluation.reference_floor import Floor, hold_of
from tactbench.plugin import assumed
from tactbench.tasks import force

from .made import REGISTRY, twin

NOISE_N = 0.6875
HOLD_S, END_S, END_N = 7.2, 60.0, 5.0


def references(environment, seeds):
    """Yield (n,) seconds and the (n,) reference force of the task's test scene, one a seed."""
    (planned,) = [one for one in force.SCENES if one.role == "test"]
    asked = planned.scene.model_copy(
        update={"environment": planned.scene.environment.model_copy(update=environment), "observe": ("taxel",)}
    )
    for seed in seeds:
        with twin().open(REGISTRY.sensors["ideal"], asked, seed=seed) as acquisition:
            blocks = [block for block in acquisition if block.stream == "force_torque"]
        yield (
            np.concatenate([block.t_ns for block in blocks]) * 1e-9,
            np.concatenate([block.data[:, 0] for block in blocks]),
        )


def floor_of(found):
    return Floor({place: hold_of(y[t_s < HOLD_S]) for place, (t_s, y) in enumerate(found)}).value


def test_eight_replicates_know_the_twins_noise_to_3_percent():
    """4800 unloaded samples: one standard error is 1.0 %."""
    found = list(references({}, range(1, 9)))
    assert [int((t_s < HOLD_S).sum()) for t_s, _ in found] == [600] * 8
    assert floor_of(found) == pytest.approx(NOISE_N, rel=0.03)


def test_behind_a_low_pass_the_hold_still_tells_the_noise_of_the_press():
    """0.12 s of memory at the filter's 1.3 Hz: the holds of 16 replicates are worth some 500 independent samples."""
    found = list(references({"force_filter": assumed(1.3, "Hz", "a test")}, range(1, 17)))
    floor = floor_of(found)
    press = []
    for t_s, y in found:
        late = t_s > HOLD_S + 2.0  # the filter has settled on the ramp, behind which it stays by a constant
        error = y[late] - (t_s[late] - HOLD_S) * END_N / (END_S - HOLD_S)
        press.append(error.var(ddof=1))
    expected = float(np.sqrt(np.mean(press)))
    assert floor < 0.5 * NOISE_N, "the filter takes most of the noise away"
    assert floor == pytest.approx(expected, rel=0.09), "three standard errors of the holds"
