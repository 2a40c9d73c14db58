"""Rejection: everything at a huge tolerance, the truth at a small one."""

import math

import numpy as np
import pytest

from tactbench.core.calibration.acceptance import accept, by_fitted, distances, fitted
from tactbench.core.calibration.draw import parameter_values
from tactbench.core.calibration.ranges import parameter_ranges, predictions, range_of
from tests.core.calibration.toy import TRUTH, draws, procedure

DRAWS = draws(3000)


def test_a_huge_tolerance_returns_the_prior():
    spec = procedure(tolerance=1e9)
    assert by_fitted(spec, DRAWS).draws == tuple(DRAWS)
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
    found = by_fitted(spec, DRAWS)
    assert 0 < len(found.draws) == found.near < len(DRAWS)
    assert found.reach <= 0.5
    for draw in found.draws:
        for one in fitted(spec):
            assert abs(draw.outputs[one.output] - one.value) <= 0.5 * one.scale
    assert np.sum(distances(DRAWS, fitted(spec)) <= 0.5) == found.near


def test_a_draw_without_a_fitted_number_is_never_accepted():
    spec = procedure(tolerance=1e9)
    lacking = [type(draw)(draw.number, draw.seed, draw.parameters, {"tall": 1.0}) for draw in DRAWS[:3]]
    assert accept(lacking, fitted(spec), spec.tolerance, 2) == ((), 0, 0.0)


def test_where_too_few_are_near_the_nearest_are_taken_and_say_how_far_they_reach():
    spec = procedure(tolerance=1e-9, at_least=20)
    found = by_fitted(spec, DRAWS)
    away = distances(DRAWS, fitted(spec))
    assert (len(found.draws), found.near) == (20, 0)
    assert found.reach == np.sort(away)[19] > 1e-9
    assert {draw.number for draw in found.draws} == set(np.argsort(away)[:20].tolist())
    # It is a floor, never a ceiling.
    wide = procedure(tolerance=1.0, at_least=20)
    assert len(by_fitted(wide, DRAWS).draws) == by_fitted(procedure(tolerance=1.0), DRAWS).near > 20


def test_held_out_numbers_are_predicted_and_play_no_part():
    spec = procedure(tolerance=0.5)
    by_name = {one.output: one for one in predictions(spec, DRAWS)}
    assert by_name["both"].inside
    moved = [one.model_dump() for one in spec.published]
    moved[2]["value"] = 50.0
    far = {one.output: one for one in predictions(procedure(tolerance=0.5, published=moved), DRAWS)}
    assert far["both"].after == by_name["both"].after
    assert far["both"].inside is False
    # Nor does it choose among the draws that predict it from all others: here those are the fitted ones.
    assert far["both"].left_out == far["both"].after
    # But it decides what "all others" predict for the fitted ones: nothing is near 50.
    assert far["narrow"].left_out is None
    assert far["narrow"].inside_left_out is None


def test_a_range_of_few_is_none_and_of_many_its_quantiles():
    assert range_of(np.arange(9.0)) is None
    found = range_of(np.append(np.arange(101.0), math.nan))
    assert found == (101, 50.0, pytest.approx(10.0), pytest.approx(90.0))
    assert parameter_values(DRAWS[:2], "width").shape == (2,)
