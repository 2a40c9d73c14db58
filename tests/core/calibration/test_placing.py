"""What a draw asks of the simulation: its values under the names that every run uses, for the sensors they are of."""

import pytest
from pydantic import ValidationError

from tactbench.core.calibration.placing import simulation_of
from tactbench.core.spec.scene import Simulation
from tests.core.calibration.toy import procedure


def _spec(name="one", sensors=(), **more):
    nuisance = {"name": name, "sensors": list(sensors), "reason": "r", "source": "assumed",
                "prior": {"kind": "fixed", "value": 2.0}, **more}  # fmt: skip
    return procedure(nuisances=[nuisance])


def test_a_drawn_value_is_set_under_the_name_of_its_nuisance():
    spec = _spec(sets="placement_scatter_mm")
    assert simulation_of(spec, "icub", {"one": 0.25}) == Simulation(nuisances={"placement_scatter_mm": 0.25})
    assert spec.nuisances[0].unit == "mm"


def test_without_another_word_a_nuisance_sets_what_it_is_called():
    assert _spec("force_noise_n").nuisances[0].sets == "force_noise_n"


def test_the_unit_in_a_name_does_not_change_the_draw():
    assert _spec("force_noise_n").nuisances[0].stream == "force_noise"
    assert _spec("noise_of_mine", sets="noise_scale").nuisances[0].stream == "noise_of_mine"


def test_a_nuisance_of_one_sensor_leaves_the_other_as_it_is():
    spec = _spec(sets="noise_scale", sensors=["biotac"])
    assert simulation_of(spec, "icub", {"one": 9.0}) == Simulation()
    assert simulation_of(spec, "biotac", {"one": 9.0}) == Simulation(nuisances={"noise_scale": 9.0})


def test_what_the_procedure_asks_of_the_simulation_stays():
    spec = _spec(sets="noise_scale")
    spec = spec.model_copy(update={"simulation": Simulation(rung="fine", nuisances={"drift_scale": 0.5})})
    asked = simulation_of(spec, "icub", {"one": 9.0})
    assert asked == Simulation(rung="fine", nuisances={"drift_scale": 0.5, "noise_scale": 9.0})


@pytest.mark.parametrize("name", ["placement_scater_mm", "placement.scatter"])
def test_a_name_that_is_none_comes_with_those_that_are(name):
    with pytest.raises(ValidationError, match=r"did you mean 'placement_scatter_mm'.*known: .*force_noise_n"):
        _spec(sets=name)
