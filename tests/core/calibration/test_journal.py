"""Draws are written down one by one, and never done twice."""

import json
from functools import partial

import pytest

from tactbench.core.calibration.journal import Journal
from tactbench.core.calibration.result import draws_csv
from tactbench.core.calibration.run import carry_out_missing
from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.matrix.progress import Silence
from tests.core.calibration.toy import procedure, work

MADE_BY = {"tactbench": "0", "commit": "c"}


def _run(path, *, n=30, jobs=1, spec=None, seed=5, work=work, made_by=MADE_BY):
    spec = spec or procedure()
    journal = Journal(path, spec, seed, made_by)
    return carry_out_missing(spec, seed, n, journal, jobs=jobs, progress=Silence(), work=work), journal


class Ended(BaseException):
    pass


def _stops_at(number, trial):
    if trial.number == number:
        raise Ended
    return work(trial)


def _noting(path, trial):
    with path.open("a") as file:
        file.write(f"{trial.number}\n")
    return work(trial)


def test_a_run_that_was_ended_goes_on_to_the_same_file(tmp_path):
    whole, _ = _run(tmp_path / "whole.jsonl")
    with pytest.raises(TactbenchError, match="draw 11 was ended"):
        _run(tmp_path / "cut.jsonl", work=partial(_stops_at, 11))
    assert len((tmp_path / "cut.jsonl").read_text().splitlines()) == 1 + 11
    rest, journal = _run(tmp_path / "cut.jsonl", work=partial(_noting, tmp_path / "done"))
    assert (tmp_path / "done").read_text().split() == [str(number) for number in range(11, 30)]
    assert (tmp_path / "cut.jsonl").read_bytes() == (tmp_path / "whole.jsonl").read_bytes()
    assert draws_csv(procedure(), rest) == draws_csv(procedure(), whole)
    assert journal.seconds == pytest.approx(15.0)


def test_the_order_of_jobs_changes_no_draw(tmp_path):
    alone, _ = _run(tmp_path / "one.jsonl")
    several, _ = _run(tmp_path / "three.jsonl", jobs=3)
    assert several == alone


def test_a_failed_draw_is_a_line_with_its_reason_and_stops_nothing(tmp_path):
    found, _ = _run(tmp_path / "a.jsonl", n=9)
    assert [draw.status for draw in found] == ["done"] * 7 + ["failed", "done"]
    assert json.loads((tmp_path / "a.jsonl").read_text().splitlines()[8])["reason"] == "seven"


def test_a_line_cut_off_by_a_crash_is_done_again(tmp_path):
    path = tmp_path / "a.jsonl"
    _run(path, n=6)
    whole = path.read_bytes()
    path.write_bytes(whole[:-30])
    again, _ = _run(path, n=6)
    assert path.read_bytes() == whole
    assert [draw.number for draw in again] == list(range(6))
    path.write_bytes(whole[:20])  # not even the first line was finished
    _run(path, n=6)
    assert path.read_bytes() == whole


def test_draws_of_another_procedure_or_seed_are_never_mixed_in(tmp_path):
    path = tmp_path / "a.jsonl"
    _run(path, n=3)
    other = procedure().model_dump(mode="json")
    other["nuisances"][0]["prior"]["high"] = 2.0
    for change in ({"seed": 6}, {"spec": procedure(nuisances=other["nuisances"])}):
        with pytest.raises(UsageError, match="another procedure or seed"):
            _run(path, n=3, **change)
    # What is read off finished draws may change, and so may their number.
    more, _ = _run(path, n=4, spec=procedure(tolerance=3.0, draws=99))
    assert len(more) == 4


def test_other_makers_are_remarked_on(tmp_path):
    path = tmp_path / "a.jsonl"
    _run(path, n=3)
    other = {"tactbench": "0", "commit": "d"}
    _, looked = _run(path, n=3, made_by=other)
    assert looked.made_by == MADE_BY  # looking at what is there makes nothing
    _, journal = _run(path, n=4, made_by=other)
    assert "commit c" in journal.remark
    for one in (journal, _run(path, n=4)[1]):
        assert one.made_by == {**MADE_BY, "continued with": "tactbench 0, commit d"}
    assert "commit d" in _run(path, n=4)[1].remark
    assert _run(path, n=4, made_by=other)[1].remark == ""


def test_a_file_that_is_no_journal_is_refused(tmp_path):
    for text in ("not json\n", "[1]\n"):
        (tmp_path / "a.jsonl").write_text(text)
        with pytest.raises(UsageError, match="not a journal"):
            Journal(tmp_path / "a.jsonl", procedure(), 5, MADE_BY)


def _breaks(trial):
    raise MemoryError("none left")


def test_a_process_that_is_ended_from_outside_writes_no_line(tmp_path):
    path = tmp_path / "a.jsonl"
    with pytest.raises(TactbenchError, match="process of draw 0 was ended"):
        _run(path, n=3, work=_breaks)
    assert not path.exists()
