"""Statistics of the comparison with real fingers, on arrays whose answer is known."""

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from studies.likeness.__main__ import PAGE, table, written
from studies.likeness.figures import BIOTAC, ICUB, STATISTICS
from studies.likeness.patterns import Trial, compare_plates, explained, predicted


def test_every_figure_has_a_statistic_and_a_range_around_its_value():
    for figure in (*BIOTAC, *ICUB):
        assert figure.statistic in STATISTICS
        assert figure.low <= figure.typical <= figure.high


# The recordings' third component is positive, where the simulation's is negative: the pad faces -z.
REAL, SWAPPED = np.diag([1.0, 1.0, -1.0]), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("turn", [np.eye(3), REAL, SWAPPED, SWAPPED @ REAL])
def test_a_trial_is_predicted_by_one_of_the_same_finger_whichever_way_its_axes_point(turn):
    rng = np.random.default_rng(2)
    normals = rng.standard_normal((19, 3))

    def trial(n, turn):
        ways = rng.standard_normal((n, 3)) * [0.4, 0.4, 0.0] - [0, 0, 1.0]
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        size = rng.uniform(20, 200, (n, 1))
        return Trial(size * (ways @ normals.T) + rng.standard_normal((n, 19)), ways @ turn)

    twin = trial(1500, np.eye(3))
    found = compare_plates((trial(400, turn), trial(100, turn)), twin)
    assert found["ceiling: the second trial by the first"][1] > 0.95
    assert found["the second trial by the simulation"][1] > 0.95
    bins = {name: states for name, (states, _) in found.items() if "tilts" in name}
    assert sum(bins.values()) == 100, "every state is in a bin"
    assert bins["median correlation, tilts of 90 to 181 degrees"] == 0, "a bin without a state stands there"
    other = trial(100, np.eye(3))
    assert explained(other.change, predicted(other, Trial(twin.change[::-1], twin.direction), 1)) < 0.5


def test_the_page_says_what_the_simulation_gives():
    page = PAGE.read_text(encoding="utf-8")
    with threadpool_limits(1):
        assert written(page, {"icub": table("icub", ICUB)}) == page, "python -m studies.likeness --write"
