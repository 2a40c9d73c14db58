"""Rejection: everything at a huge tolerance, the truth at a small one."""

import math

import numpy as np
import pytest

from tactbench.core.calibration.acceptance import accepted, distances, fitted
from tactbench.core.calibration.draw import parameter_values
from tactbench.core.calibration.ranges import parameter_ranges, predictions, range_of
from tests.core.calibration.toy import TRUTH, draws, procedure

DRAWS = draws(3000)


def test_a_huge_tolerance_returns_the_prior():
    spec = procedure(tolerance=1e9)
    assert accepted(DRAWS, fitted(spec), spec.tolerance) == DRAWS
    assert all(one.before == one.after for one in parameter_ranges(spec, DRAWS))


def test_the_accepted_range_holds_the_truth_and_narrows_with_the_tolerance():
    widths = []
    for tolerance in (3.0, 1.0, 0.5):
        ranges = {one.name: one.after for one in parameter_ranges(procedure(tolerance=tolerance), DRAWS)}
        for name, truth in TRUTH.items():
            assert ranges[name].low <= truth <= ranges[name].high
        widths.append([ranges[name].high - ranges[name].low for name in TRUTH])
    assert np.all(np.diff(widths, axis=0) < 0)


def test_only_what_is_near_in_every_fitted_number_is_accepted():
    spec = procedure(tolerance=0.5)
    kept = accepted(DRAWS, fitted(spec), 0.5)
    assert 0 < len(kept) < len(DRAWS)
    for draw in kept:
        for one in fitted(spec):
            assert abs(draw.outputs[one.output] - one.value) <= 0.5 * one.scale
    assert np.sum(distances(DRAWS, fitted(spec)) <= 0.5) == len(kept)


def test_a_draw_without_a_fitted_number_is_never_accepted():
    spec = procedure(tolerance=1e9)
    lacking = [type(draw)(draw.number, draw.seed, draw.parameters, {"tall": 1.0}) for draw in DRAWS[:3]]
    assert accepted(lacking, fitted(spec), spec.tolerance) == []


def test_held_out_numbers_are_predicted_and_play_no_part():
    spec = procedure(tolerance=0.5)
    by_name = {one.output: one for one in predictions(spec, DRAWS)}
    assert by_name["both"].inside
    moved = [one.model_dump() for one in spec.published]
    moved[2]["value"] = 50.0
    far = {one.output: one for one in predictions(procedure(tolerance=0.5, published=moved), DRAWS)}
    assert far["both"].after == by_name["both"].after
    assert far["both"].inside is False
    # But it decides what "all others" predict for the fitted ones: nothing is near 50.
    assert far["narrow"].left_out is None
    assert far["narrow"].inside_left_out is None


def test_a_range_of_few_is_none_and_of_many_its_quantiles():
    assert range_of(np.arange(9.0)) is None
    found = range_of(np.append(np.arange(101.0), math.nan))
    assert found == (101, 50.0, pytest.approx(10.0), pytest.approx(90.0))
    assert parameter_values(DRAWS[:2], "width").shape == (2,)
