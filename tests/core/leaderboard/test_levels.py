"""The level that `check` has computed stands beside the sensor, where the rows were made with what was checked."""

import json

import pytest

from tactbench.core.leaderboard.levels import (
    OTHER_VERSION,
    identity_of,
    write_level,
)
from tactbench.core.matrix.store import Store
from tests.core.matrix import made

PAD = {"distribution": "acme", "version": "1.2", "package": "acme_pad", "source": "abc", "commit": ""}
MADE_WITH = {"tactbench": "0.1.0", "commit": "1234", "plugins": [PAD]}


@pytest.fixture
def kept(tmp_path):
    """A result folder of an older commit."""
    with Store(tmp_path / "kept").hold() as store:
        store.begin(MADE_WITH)
        made.kept(store, "pad/force/twin/karl2016/mean/1", sensor="pad", simulated=False)
    return tmp_path / "kept"


def test_check_keeps_the_level_and_every_table_shows_it(verbs, kept):
    assert "level" not in verbs("leaderboard", "kept", "--wide").stdout
    file = kept / "conformance" / "ideal.json"
    assert str(file.relative_to(kept.parent)) in verbs("check", "ideal", "--out", "kept").stderr
    facts = json.loads(file.read_text()) | {"sensor": "pad"}  # which the kept results are of
    assert (facts["level"], facts["failed"], facts["modes"]) == ("silver", 0, ["passive"])
    write_level(kept, "pad", facts)
    assert OTHER_VERSION in verbs("leaderboard", "kept").stdout  # those rows are of an older commit
    store = Store(kept)
    (made_by,) = {row["made_by"] for row in store.rows()}
    write_level(kept, "pad", {**facts, "identity": identity_of("tactbench", store.provenance(made_by))})
    shown = json.loads(verbs("leaderboard", "kept", "--format", "json").stdout)
    assert {row["shown"]["level"] for row in shown} == {"silver"}
