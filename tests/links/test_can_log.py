"""CAN logs and the traps of their times."""

from __future__ import annotations

import can
import pytest

from tactbench.core.errors import LinkClosed
from tactbench.plugin.devices import LinkEnded, LinkError, open_link

EPOCH_S = 1_700_000_000.25
OFFSETS_S = [0.0, 0.0000015, 0.02, 0.04, 3600.5]
ASC_HEAD = "date Tue Nov 14 10:13:20.250 pm 2023\nbase hex  timestamps {kind}\ninternal events logged\n"


def write(file, begin_s, offsets_s=OFFSETS_S):
    with can.Logger(file) as log:
        for number, offset_s in enumerate(offsets_s):
            log.on_message_received(
                can.Message(timestamp=begin_s + offset_s, arbitration_id=0x4E0 + number, data=b"\x40",
                            is_extended_id=False, channel=0)
            )  # fmt: skip


def frames(link):
    found = []
    while True:
        try:
            found.append(link.receive(0))
        except LinkEnded:
            return found


@pytest.mark.parametrize("begin_s", [EPOCH_S, 1000.0, 0.0])
@pytest.mark.parametrize(("suffix", "tolerance_ns"), [("asc", 501), ("blf", 250)])
def test_times_count_from_the_start_whatever_the_epoch(tmp_path, begin_s, suffix, tolerance_ns):
    """ASC has microseconds, so half of one and float64's share; a BLF stamp as a float64 since 1970, 250 ns."""
    write(tmp_path / f"log.{suffix}", begin_s)
    with open_link(f"can://log/{tmp_path}/log.{suffix}") as link:
        found = frames(link)
    assert [frame.id for frame in found] == [0x4E0 + number for number in range(5)]
    # The offsets as float64 keeps them beside the epoch.
    stated_ns = [((begin_s + offset_s) - begin_s) * 1e9 for offset_s in OFFSETS_S]
    assert [frame.t_ns for frame in found] == pytest.approx(stated_ns, abs=tolerance_ns)
    assert link.backward == 0


def test_the_start_is_what_the_file_states(tmp_path):
    write(tmp_path / "a.blf", EPOCH_S)
    write(tmp_path / "b.blf", 1000.0)
    (tmp_path / "c.asc").write_text(ASC_HEAD.format(kind="absolute"))
    starts = []
    for name in ("a.blf", "b.blf", "c.asc"):
        with open_link(f"can://log/{tmp_path}/{name}") as link:
            starts.append(link.started)
    assert starts == ["2023-11-14T22:13:20.250000+00:00", "", "Tue Nov 14 10:13:20.250 pm 2023"]


def test_relative_times_are_refused(tmp_path):
    file = tmp_path / "log.asc"
    file.write_text(ASC_HEAD.format(kind="relative") + "   0.020000 1  4E0             Rx   d 1 40\n")
    with pytest.raises(LinkError, match="Export the log with absolute"):
        open_link(f"can://log/{file}")


def test_stamps_that_go_back_are_counted(tmp_path):
    file = tmp_path / "log.asc"
    lines = [f"   {t_s:.6f} 1  4E0             Rx   d 1 40\n" for t_s in (0.0, 0.3, 0.1, 0.2)]
    file.write_text(ASC_HEAD.format(kind="absolute") + "".join(lines))
    with open_link(f"can://log/{file}") as link:
        assert [frame.t_ns for frame in frames(link)] == [0, 300_000_000, 100_000_000, 200_000_000]
        assert link.backward == 1


def test_a_log_is_only_read(tmp_path):
    write(tmp_path / "log.asc", EPOCH_S)
    with open_link(f"can://log/{tmp_path}/log.asc") as link, pytest.raises(LinkError, match="is a log"):
        link.send(link.receive(0))
    link.close()
    with pytest.raises(LinkClosed):
        link.receive(0)


@pytest.mark.parametrize("content", [b"", b"LOGG", b"no log at all" * 40], ids=["empty", "cut", "other"])
def test_what_is_no_blf_is_refused(tmp_path, content):
    (tmp_path / "log.blf").write_bytes(content)
    with pytest.raises(LinkError):
        open_link(f"can://log/{tmp_path}/log.blf")


def test_a_damaged_log_says_how_far_it_went(tmp_path):
    file = tmp_path / "log.asc"
    lines = ["   0.000000 1  4E0             Rx   d 1 40\n", "   0.010000 1  4E0             Rx   d 1 ZZ\n"]
    file.write_text(ASC_HEAD.format(kind="absolute") + "".join(lines))
    with open_link(f"can://log/{file}") as link:
        link.receive(0)
        with pytest.raises(LinkError, match="damaged after 1 frames"):
            link.receive(0)
