"""Protocols by name, and the options that a name may end in."""

import pytest

from tactbench.core.errors import NotApplicable, TactbenchError
from tactbench.core.evaluation.protocols import PROTOCOLS, is_probe, protocol_called, shots, without_options
from tactbench.core.evaluation.sets import windowed

from .made import force_task


@pytest.mark.parametrize(
    ("name", "every", "k"),
    [("deployable@every=4", 4, None), ("deployable@k=0", 1, 0), ("deployable@every=9,k=3", 9, 3)],
)
def test_options_of_a_protocol(name, every, k):
    found = protocol_called(name)
    assert (found.name, found.every, found.k) == (name, every, k)
    assert without_options(name) == "deployable"
    rest = {"name", "every", "k"}
    assert found.model_dump(exclude=rest) == PROTOCOLS["deployable"].model_dump(exclude=rest)


@pytest.mark.parametrize(
    "name", ["deploiable", "deployable@", "deployable@every=0", "deployable@k=-1", "deployable@k=3,every=4",
             "deployable@every=4k=3", "deployable@,k=3", "deployable@seed=1"],
)  # fmt: skip
def test_what_is_no_protocol_is_refused(name):
    with pytest.raises(TactbenchError):
        protocol_called(name)


@pytest.mark.parametrize("field", [{"three_sigma": True}, {"first_row_only": True}, {"k": 0}])
def test_windows_need_the_samples_as_they_are(field):
    rules = protocol_called("deployable").model_copy(update=field)
    with pytest.raises(NotApplicable, match="window=4"):
        windowed(None, force_task(), rules, 4, 1)


def test_one_protocol_is_a_probe_and_few_shots_have_their_number():
    assert [name for name in (*PROTOCOLS, "unknown") if is_probe(name)] == ["first-frame"]
    assert [shots(split) for split in ("few-shot-10", "few-shot-0", "few-shot", "roles")] == [10, None, None, None]
