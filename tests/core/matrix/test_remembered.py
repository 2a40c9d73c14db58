"""What was read is remembered only as long as the file is surely the same."""

import json
import os
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.matrix.recorded import Recorded, StatSignature, stat_signature

LATER_NS = 10**10


def later():
    return time.time_ns() + LATER_NS


def learnt(path, file, clock=later):
    memory = Recorded(path, clock)
    stat = file.stat()
    memory.learn(stat_signature(file), stat_signature(file), {"digest": file.read_text()})
    memory.save()
    return stat


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "file"
    path.write_text("a")
    return path


def test_a_file_at_rest_is_remembered(tmp_path, file):
    learnt(tmp_path / "memory", file)
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {"digest": "a"}


def test_facts_of_a_file_are_learnt_bit_by_bit(tmp_path, file):
    memory = Recorded(tmp_path / "memory", later)
    memory.learn(stat_signature(file), stat_signature(file), {"digest": "a"})
    memory.learn(stat_signature(file), stat_signature(file), {"sensor": "s", "scene": None})
    assert memory.facts(stat_signature(file)) == {"digest": "a", "sensor": "s", "scene": None}


@pytest.mark.parametrize(
    "clock", [time.time_ns, lambda: time.time_ns() - LATER_NS], ids=["young", "clock stepped back"]
)
def test_a_young_file_or_one_from_the_future_is_not_remembered(tmp_path, file, clock):
    memory = Recorded(tmp_path / "memory", clock)
    file.write_text("b")
    memory.learn(stat_signature(file), stat_signature(file), {"digest": "b"})
    assert memory.facts(stat_signature(file)) == {}


def test_a_disk_that_counts_whole_seconds_needs_longer_rest(tmp_path, file):
    os.utime(file, ns=(0, file.stat().st_mtime_ns // 10**9 * 10**9))
    second_ns = 10**9
    learnt(tmp_path / "memory", file, lambda: file.stat().st_ctime_ns + second_ns)
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {}
    learnt(tmp_path / "memory", file, lambda: file.stat().st_ctime_ns + 3 * second_ns)
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {"digest": "a"}


def test_other_bytes_of_the_same_length_with_the_old_time_put_back_are_noticed(tmp_path, file):
    stat = learnt(tmp_path / "memory", file)
    file.write_text("b")
    os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    assert (file.stat().st_size, file.stat().st_mtime_ns) == (stat.st_size, stat.st_mtime_ns)
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {}


def test_another_file_renamed_into_the_place_is_noticed(tmp_path, file):
    stat = learnt(tmp_path / "memory", file)
    other = tmp_path / "other"
    other.write_text("b")
    os.utime(other, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    other.replace(file)
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {}


def test_a_file_that_changed_while_it_was_read_is_not_remembered(tmp_path, file):
    memory = Recorded(tmp_path / "memory", later)
    before = stat_signature(file)
    file.write_text("longer")
    memory.learn(before, stat_signature(file), {"digest": "a"})
    assert memory.facts(stat_signature(file)) == memory.facts(before) == {}


def seen(size, changed_ns, tick_ns):
    """What a disk whose clock moves every `tick_ns` says of a file."""
    stamp = changed_ns // tick_ns * tick_ns
    return StatSignature("1:7", size, stamp, stamp)


@given(
    st.sampled_from([1_000_000, 10_000_000, 1_000_000_000, 2_000_000_000]),
    st.lists(st.sampled_from(["write", "read", "save"]) | st.integers(0, 3 * 10**9), max_size=30),
)
def test_whatever_happens_and_however_coarse_the_disk_counts_a_fact_is_true(tmp_path_factory, tick_ns, steps):
    path = tmp_path_factory.getbasetemp() / "coarse"
    path.unlink(missing_ok=True)
    now, changed, content = [1_700_000_000_123_456_789], 1_700_000_000_123_456_789, 0
    memory = Recorded(path, lambda: now[0])
    for step in steps:
        if step == "write":
            changed, content = now[0], content + 1
        elif step == "read":
            memory.learn(seen(1, changed, tick_ns), seen(1, changed, tick_ns), {"digest": str(content)})
        elif step == "save":
            memory.save()
            memory = Recorded(path, lambda: now[0])
        else:
            now[0] += step
        assert memory.facts(seen(1, changed, tick_ns)).get("digest", str(content)) == str(content)


@pytest.mark.parametrize(
    "content",
    [b"", b"rubbish", b"[]", b"{}", b'{"format": "another", "files": {}}', b"[" * 100_000, b"\xff\xfe"],
    ids=["empty", "rubbish", "list", "no format", "another format", "deep", "no text"],
)
def test_a_memory_that_is_rubbish_is_as_good_as_none(tmp_path, file, content):
    (tmp_path / "memory").write_bytes(content)
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {}
    learnt(tmp_path / "memory", file)
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {"digest": "a"}


@pytest.mark.parametrize("entry", [None, 3, [], [1, 2, 3], [1, 2, 3, "text"], [1, 2, 3, {"digest": 4}]])
def test_an_entry_of_another_shape_is_passed_over(tmp_path, file, entry):
    stat = learnt(tmp_path / "memory", file)
    content = json.loads((tmp_path / "memory").read_text())
    (place,) = content["files"]
    content["files"][place] = (
        [stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, {"digest": 4}] if entry == [] else entry
    )
    (tmp_path / "memory").write_text(json.dumps(content))
    assert Recorded(tmp_path / "memory").facts(stat_signature(file)) == {}


def test_what_was_not_asked_for_is_kept(tmp_path, file):
    other = tmp_path / "other"
    other.write_text("b")
    learnt(tmp_path / "memory", other)
    learnt(tmp_path / "memory", file)
    memory = Recorded(tmp_path / "memory")
    assert (memory.facts(stat_signature(file)), memory.facts(stat_signature(other))) == (
        {"digest": "a"},
        {"digest": "b"},
    )


def test_nothing_about_paths_is_written_down(tmp_path, file):
    learnt(tmp_path / "memory", file)
    assert str(tmp_path) not in (tmp_path / "memory").read_text()
