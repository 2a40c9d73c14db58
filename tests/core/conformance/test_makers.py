"""Mistakes and sound packages of makers that the checks were not written from: what is found, and what passes."""

from __future__ import annotations

import pytest

from tactbench.core.conformance.check import CHECKS
from tactbench.core.conformance.run import run_checks, subjects_named
from tactbench.core.plugins.registry import load_registry
from tests.core.conformance.makers import FOUND_BY, SILENT, SOUND, planted, said_of
from tests.core.conformance.makers import MISTAKES as ALTERED
from tests.core.conformance.test_mistakes import KIND, MISTAKES, SHELF, written


@pytest.fixture(scope="module")
def flawed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flawed")
    every = planted(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.syspath_prepend(SHELF)
        yield load_registry(), folder, every


@pytest.mark.parametrize("number", range(1, len(ALTERED) + 1))
def test_a_mistake_is_found_but_where_it_cannot_be_told(flawed, number):
    said = said_of(*flawed, number)
    assert bool(said) == (number not in SILENT), said
    assert FOUND_BY.get(number, "") in said


def test_every_check_has_found_one():
    found = {check for *_, check, _ in MISTAKES} | set(FOUND_BY.values())
    assert {one.name for one in CHECKS if not one.name.startswith("recording")} <= found


@pytest.fixture(scope="module")
def registry(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sound")
    for number, (package, pairs) in enumerate(SOUND.values(), 2001):
        right, wrong = zip(*pairs, strict=True) if pairs else ((), ())
        written(folder, number, package, right, wrong)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        patch.syspath_prepend(SHELF)
        yield load_registry()


@pytest.mark.parametrize("name", SOUND)
def test_a_sound_one_passes(registry, name):
    package, _ = SOUND[name]
    number = 2001 + list(SOUND).index(name)
    (subject,) = subjects_named(registry, f"planted{number}-{package}", (KIND[package],))
    report = run_checks(subject, isolated=False, without=("import-is-light",))
    assert report.ok, str(report)
    assert report.level == "silver"
