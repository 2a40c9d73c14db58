"""Foreign tables of every shape become recordings; every misfit is refused with its place, and nothing is left."""

import copy
import os

import numpy as np
import openpyxl
import pytest
import scipy.io
import yaml

from tactbench.core.errors import MappingError, TactbenchError
from tactbench.core.recording.mapping import import_tables
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality
from tests.conftest import ROOT

SOURCE = {"tag": "assumed", "reference": "made up for a test"}
TAXELS = {"columns": "1..3", "name": "t{column}", "kind": "taxel", "unit": "count"}
FORCE = {"columns": 4, "name": "fz", "kind": "force", "unit": "N", "given_in": "gf", "sentinels": [-1]}


def mapping(**change):
    said = {
        "version": 1,
        "title": "a test",
        "sensor": {"name": "pad", "title": "a pad", "principle": "capacitive", "principle_source": SOURCE},
        "clock": "host",
        "tables": {
            "table": {
                "files": "*.csv",
                "read": {"format": "csv", "header": False},
                "time": {"column": 0, "unit": "s", "epoch": "start"},
            }
        },
        "recording": {"name": "{file}", "session": "{file}"},
        "streams": {
            "taxels": {"table": "table", "channels": [TAXELS]},
            "force": {"table": "table", "of": "reference", "channels": [FORCE]},
        },
    }
    for path, value in change.items():
        *parents, last = path.split("__")
        inside = said
        for parent in parents:
            inside = inside[parent]
        if value is None:
            inside.pop(last)
        else:
            inside[last] = copy.deepcopy(value)
    return said


@pytest.fixture
def run(tmp_path):
    """Imports the data in ``tmp_path/data`` into ``tmp_path/out``."""
    (tmp_path / "data").mkdir()

    def go(said=None, **change):
        path = tmp_path / "mapping.yaml"
        path.write_text(yaml.safe_dump(mapping(**change) if said is None else said, sort_keys=False))
        return import_tables(path, root=tmp_path / "data", out=tmp_path / "out")

    return go


@pytest.fixture
def put(tmp_path):
    """Writes a text file into the data."""

    def go(name, text, newline="\n"):
        path = tmp_path / "data" / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_bytes(text.replace("\n", newline).encode())

    return go


def rows(n=40, force=lambda row: row * 1.5):
    return "".join(f"{row * 0.01:.2f},{row},{row * 2},{row * 3 % 5},{force(row)}\n" for row in range(n))


def one(report, stream="taxels"):
    (imported,) = report.recordings
    with open_recording(imported.path) as recording:
        recording.verify()
        return recording.read(stream), recording.meta


def refused(run, tmp_path, *says, **change):
    with pytest.raises(TactbenchError) as caught:
        run(**change)
    assert caught.value.exit_code == 2
    assert caught.value.hint
    for text in says:
        assert text in str(caught.value)
    left = list((tmp_path / "out").rglob("*")) if (tmp_path / "out").exists() else []
    assert left == []
    return caught.value


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_table_with_a_clock_a_unit_and_a_sentinel(run, put, newline):
    put("press.csv", rows(force=lambda row: -1 if row % 2 else row), newline)
    report = run()
    force, meta = one(report, "force")
    taxels, _ = one(report)
    assert np.array_equal(taxels.data[:, 1], np.arange(40) * 2)
    assert np.array_equal(taxels.t_ns, np.arange(40) * 10_000_000)
    # -1 is no force: half of the rows have none, and the others are newtons (standard gravity, CGPM 1901).
    assert np.isnan(force.data[1::2]).all()
    assert (force.quality[1::2] == Quality.MISSING).all()
    np.testing.assert_allclose(force.data[::2, 0], np.arange(0, 40, 2) * 9.80665e-3, rtol=1e-15)  # one multiplication
    assert report.missing == {"fz": 20}
    assert meta.counts == {"rows of taxels": 40, "rows of force": 40, "fz without a sample": 20}
    assert (meta.rig, meta.simulated, meta.clock, meta.origin) == ("import", False, "host", "press.csv")


def test_times_since_1970_keep_every_digit(run, put):
    """A float64 of seconds since 1970 is good to 0.2 µs only; the text is exact."""
    put("press.csv", "1743486221.590758001,1,2,3,4\n1743486221.590758002,1,2,3,5\n")
    taxels, _ = one(run(tables__table__time__epoch="unix"))
    assert taxels.t_ns.tolist() == [1743486221590758001, 1743486221590758002]


def test_columns_by_name_ranges_and_combinations(run, put):
    header = "object,slipped," + ",".join(f"{finger}_{n}" for finger in ("ff", "th") for n in (1, 2))
    put("a.csv", f"{header}\npen,0,1,2,3,4\ncup,1,5,6,7,8\n")
    report = run(
        clock="none", tables__table__time=None, tables__table__read={"format": "csv", "header": True},
        streams={"taxels": {"table": "table", "dtype": "uint16", "channels": [
            {"columns": ["ff_1..2", "th_1..2"], "name": "{finger}.{n}", "over": {"finger": ["ff", "th"], "n": "1..2"},
             "kind": "taxel", "unit": "count"}],
            "annotations": {"object": {"column": "object"},
                            "slipped": {"column": "slipped", "values": {0: "stable", 1: "slipped"}}}}},
    )  # fmt: skip
    taxels, meta = one(report)
    assert [channel.name for channel in taxels.spec.channels] == ["ff.1", "ff.2", "th.1", "th.2"]
    assert taxels.data.tolist() == [[1, 2, 3, 4], [5, 6, 7, 8]]
    assert taxels.annotations["slipped"].tolist() == ["stable", "slipped"]
    assert taxels.t_ns is None
    assert any("No clock" in remark for remark in meta.remarks)


RECORDS = {
    "clock": "none",
    "tables__table": {"files": "*.txt", "path": "(?P<object>[a-z]+)_(?P<trial>[0-9]+)",
                      "read": {"format": "records", "first_line": "-10000", "numbers_per_line": [2, 3]}},
    "recording": {"name": "{file}", "session": "s", "trial": "{trial}", "labels": {"object": "{object}"}},
    "streams": {"taxels": {"table": "table", "channels": [{**TAXELS, "columns": "2..4"}]}},
}  # fmt: skip


def test_several_lines_a_row(run, put):
    put("ball_3.txt", "-10000\n1 2 \n3 4 5\n6 7\n8 9 10\n", "\r\n")
    taxels, meta = one(run(**RECORDS))
    assert taxels.data.tolist() == [[3, 4, 5], [8, 9, 10]]
    assert (meta.trial, meta.labels) == ("3", {"object": "ball"})


NPZ = {
    "clock": "none",
    "tables__table": {"files": "*.npz", "read": {"format": "npz", "array": "X", "axes": ["recording", "row", "channel"],
                                                 "per_recording": {"y": "y"}}},
    "words": {"slip": {"of": "y", "values": {0: "no", 1: "yes"}}, "block": {"of": "index", "divided_by": 4}},
    "recording": {"name": "r{index}", "session": "s", "labels": {"slip": "{slip}", "block": "{block}"}},
    "streams": {"taxels": {"table": "table", "dtype": "float32", "channels": [{**TAXELS, "columns": "0..2"}]}},
}  # fmt: skip


def test_an_archive_of_arrays(run, tmp_path):
    X = np.random.default_rng(0).normal(size=(11, 5, 3)).astype(np.float32)
    np.savez_compressed(tmp_path / "data" / "x.npz", X=X, y=np.arange(11) % 2)
    report = run(**NPZ)
    assert [imported.name for imported in report.recordings] == [f"r{index:02d}" for index in range(11)]
    with open_recording(report.recordings[7].path) as recording:
        assert np.array_equal(recording.read("taxels").data, X[7])
        assert recording.meta.labels == {"slip": "yes", "block": "1"}


MAT = {**NPZ, "tables__table": {"files": "*.mat", "read": {**NPZ["tables__table"]["read"], "format": "mat"}}}


def test_a_matlab_file_of_arrays(run, tmp_path):
    X = np.random.default_rng(0).normal(size=(11, 5, 3))
    scipy.io.savemat(tmp_path / "data" / "x.mat", {"X": X, "y": np.arange(11) % 2}, do_compression=True)
    report = run(**MAT)
    with open_recording(report.recordings[7].path) as recording:
        np.testing.assert_allclose(recording.read("taxels").data, X[7], rtol=1e-6)  # stored as float32
        assert recording.meta.labels == {"slip": "yes", "block": "1"}


def workbook(path, table, sheets=("press",), above=0):
    book = openpyxl.Workbook()
    book.active.title = sheets[0]
    for name in sheets[1:]:
        book.create_sheet(name)
    for _ in range(above):
        book.active.append(["measured on a Monday"])
    for line in table:
        book.active.append(line)
    book.save(path)


XLSX = {
    "tables__table__files": "*.xlsx",
    "tables__table__read": {"format": "xlsx", "header": True, "skip_lines": 2, "no_sample": [""]},
}


def test_a_sheet_of_an_excel_workbook(run, tmp_path):
    table = [["t", "a", "b", "c", "f"], *([row * 0.01, row, row / 3, None if row == 3 else 1, row * 1.5]
                                          for row in range(20))]  # fmt: skip
    workbook(tmp_path / "data" / "press.xlsx", table, above=2)
    report = run(**XLSX, streams__taxels__channels=[{**TAXELS, "columns": ["a", "b", "c"]}])
    taxels, _ = one(report)
    assert np.array_equal(taxels.data[:, 0], np.arange(20))
    np.testing.assert_allclose(taxels.data[:, 1], np.arange(20) / 3, rtol=1e-14)  # openpyxl writes 15 digits
    assert report.missing == {"tc": 1}


def test_one_mapping_covers_several_devices(run, put):
    for device in ("a", "b"):
        put(f"{device}/press.csv", rows())
    said = mapping(
        tables__table__files="*/press.csv",
        tables__table__path="(?P<device>[a-z])/",
        recording={"name": "press-{device}", "session": "{device}"},
    )
    said["sensor"] |= {"name": "pad-{device}", "title": "pad {device}"}
    report = run(said)
    assert report.sensors == ("pad-a", "pad-b")
    with open_recording(report.recordings[1].path) as recording:
        assert (recording.meta.sensor.name, recording.meta.sensor.title) == ("pad-b", "pad b")


PROBE = {"path": "(?P<start>[0-9]+)_probe", "read": {"format": "csv", "header": False}}
JOINED = {
    "tables": {
        "sensor": {"files": "*/sensor.csv", **PROBE, "time": {"column": 0, "unit": "s", "epoch": "unknown"}},
        "states": {"files": "*/states.csv", **PROBE, "time": {"column": 0, "unit": "ms", "epoch": "unknown"}},
    },
    "join": {"by": "rows", "times_within_ms": 5},
    "recording": {"name": "{start}", "session": "{start}"},
    "streams": {"taxels": {"table": "sensor", "channels": [TAXELS], "annotations": {"press": {"rows_per": 20}}},
                "force": {"table": "states", "of": "reference", "channels": [{**FORCE, "columns": 1}]}},
}  # fmt: skip


def states(n=40, late_ms=4.0):
    return "".join(f"{row * 10 + late_ms},{row * 2}\n" for row in range(n))


def test_two_tables_row_by_row_each_with_its_clock(run, put):
    put("1_probe/sensor.csv", rows())
    put("1_probe/states.csv", states())
    report = run(**JOINED)
    taxels, meta = one(report)
    force, _ = one(report, "force")
    assert np.array_equal(force.t_ns - taxels.t_ns, np.full(40, 4_000_000))
    assert np.array_equal(taxels.annotations["press"], np.arange(40) // 20)
    assert meta.origin == "1_probe/sensor.csv, 1_probe/states.csv"
    assert report.files_read == 2


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({"1_probe/states.csv": states(39)}, "39 rows"),
        ({"1_probe/states.csv": states(late_ms=5.5)}, "5.5 ms from that of 1_probe/sensor.csv:1"),
        ({"2_probe/states.csv": states()}, "1_probe/sensor.csv needs one file of table 'states' (start 1)"),
        ({"1_probe/states.csv": states(), "2_probe/states.csv": states()}, "belongs to no file"),
    ],
)
def test_tables_that_do_not_belong_together(run, put, tmp_path, files, says):
    put("1_probe/sensor.csv", rows())
    for name, text in files.items():
        put(name, text)
    refused(run, tmp_path, says, **JOINED)


def test_one_file_of_several_sessions(run, put):
    put("a.csv", "".join(f"{row},{row % 3},{row},{row},{row},{'xy'[row % 2]}\n" for row in range(10)))
    report = run(split_by={"session": 5}, recording={"name": "{file}-{session}", "session": "{session}"})
    assert [(imported.name, imported.rows) for imported in report.recordings] == [("a-x", 5), ("a-y", 5)]
    with open_recording(report.recordings[1].path) as recording:
        assert recording.read("taxels").data[:, 1].tolist() == [1, 3, 5, 7, 9]
        assert recording.meta.session == "y"


def test_roles_and_excluded_files(run, put):
    for name in ("one", "two", "bad"):
        put(f"{name}.csv", rows())
    report = run(
        words={"role": {"of": "file", "values": {"one": "train", "two": "test", "bad": "train"}}},
        recording={"name": "{file}", "session": "{file}", "role": "{role}",
                   "labels": {"weight_g": 5, "object": "{file}"}},
        exclude=[{"files": "bad*", "reason": "the author says so"}],
    )  # fmt: skip
    metas = {}
    for imported in report.recordings:
        with open_recording(imported.path) as recording:
            metas[imported.name] = recording.meta
    assert {name: meta.role for name, meta in metas.items()} == {"one": "train", "two": "test", "bad": "train"}
    assert metas["one"].labels == {"weight_g": 5, "object": "one"}
    assert metas["bad"].excluded == "the author says so"
    assert metas["one"].excluded == ""
    assert report.excluded == {"the author says so": 1}


def test_a_sentinel_that_nobody_named_is_refused(run, put, tmp_path):
    """Leaving -1 in a force must be impossible by default."""
    put("press.csv", rows(force=lambda row: -1 if row % 2 else row + 1))
    without = [{name: value for name, value in FORCE.items() if name != "sentinels"}]
    refused(run, tmp_path, "mapping.yaml:", "must state its sentinels", streams__force__channels=without)
    refused(run, tmp_path, "press.csv", "column 4", "-1 in 50.0 %", "sentinels: [-1]",
            streams__force__channels=[{**FORCE, "sentinels": []}])  # fmt: skip
    force, _ = one(run(streams__force__channels=[{**FORCE, "sentinels": [], "keep_repeated": True}]), "force")
    assert not np.isnan(force.data).any()


@pytest.mark.parametrize("name", ["csv", "text"])
def test_a_header_of_numbers_is_a_row(run, put, tmp_path, name):
    put("press.csv", rows() if name == "csv" else rows().replace(",", " "))
    refused(run, tmp_path, "press.csv: its header row has the number '0.00' in column 0",
            tables__table__read={"format": name, "header": True})  # fmt: skip
    assert run(tables__table__read={"format": name, "header": False}).rows == 40


def test_words_for_no_sample(run, put):
    put("press.csv", "0,1,NA,3,\n1,1,2,nan,5\n2,1,3,3,6\n")
    report = run(tables__table__read={"format": "csv", "header": False, "no_sample": ["NA", ""]})
    assert report.missing == {"t2": 1, "t3": 1, "fz": 1}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("0,1,2,3,4\n1,1,2,3\n", ("press.csv:2: 4 cells, where 5",)),
        ("0,1,2,3,4\n1,1,x,3,4\n", ("press.csv:2: column 2: 'x' is not a number",)),
        ("0,1,2,3,4\n1,1,,3,4\n", ("'' is not a number", "no_sample")),
        ("0,1,2,3,4\nsoon,1,2,3,4\n", ("press.csv:2: column 0: 'soon' is not a time",)),
        ("", ("no rows",)),
        ("0,nan,2,3,4\n1,nan,2,3,5\n", ("column 1 (channel t1) has no sample in any of 2 rows",)),
        ("0,1,2,3\n1,1,2,3\n", ("no column 4: it has 4",)),
        ("0\t1\t2\t3\t4\n1\t1\t2\t3\t4\n", ("press.csv is separated by tabs, and not by ','", '"\\t"')),
    ],
)
def test_tables_that_do_not_fit(run, put, tmp_path, text, says):
    put("press.csv", text)
    assert isinstance(refused(run, tmp_path, *says), MappingError)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"streams__force__channels": [{**FORCE, "given_in": "mm"}]}, ("mapping.yaml:", "'mm'", "'N'")),
        ({"streams__force__channels": [{**FORCE, "uint": "N"}]}, ("mapping.yaml:", "'uint'", "Did you mean 'unit'")),
        ({"clock": "none"}, ("mapping.yaml:", "time column")),
        ({"streams__taxels__table": "tabel"}, ("mapping.yaml:", "'tabel'")),
        ({"tables__table__path": "(?P<a>"}, ("mapping.yaml:", "regular expression")),
        ({"tables__table__files": "*.tsv"}, ("No file matches '*.tsv'", "--root")),
        ({"tables__table__path": "(?P<start>[0-9]+)_"}, ("other.csv matches", "expression")),
        ({"recording__name": "{start}"}, ("'start'", "file")),
        ({"recording__name": "same"}, ("other.csv and press.csv", "'same'")),
        ({"recording__role": "training"}, ("'training'", "train, validation, test")),
        ({"streams__taxels__dtype": "uint8", "streams__taxels__channels": [{**TAXELS, "columns": "0..2"}]},
         ("column 0: 0.01 is no uint8",)),
        ({"tables__table__time__epoch": "unix"}, ("the year 1970", "epoch: start")),
        ({"tables__table__time": {"column": 1, "unit": "s", "epoch": "unix"}}, ("the year 1970",)),
    ],
)  # fmt: skip
def test_mappings_that_are_wrong_or_do_not_fit_the_files(run, put, tmp_path, change, says):
    put("press.csv", rows())
    put("other.csv", rows())
    refused(run, tmp_path, *says, **change)


def test_a_failure_half_way_leaves_nothing(run, put, tmp_path):
    put("a.csv", rows())
    put("b.csv", rows() + "0.5,oops,2,3,4\n")
    refused(run, tmp_path, "b.csv:41")


def test_again(run, put, tmp_path):
    """The same import changes nothing; another one under the same name is refused, or replaces if asked to."""
    put("press.csv", rows())
    (first,) = run().recordings
    before = first.path.stat().st_mtime_ns, first.path.read_bytes()
    run()
    assert (first.path.stat().st_mtime_ns, first.path.read_bytes()) == before
    put("press.csv", rows(41))
    with pytest.raises(MappingError, match="--replace"):
        run()
    assert first.path.read_bytes() == before[1]
    report = import_tables(tmp_path / "mapping.yaml", root=tmp_path / "data", out=tmp_path / "out", replace=True)
    assert report.rows == 41
    with open_recording(first.path) as recording:
        assert len(recording.stream("taxels")) == 41


@pytest.mark.parametrize(("make", "says"), [(os.mkdir, "is a directory"), (os.mkfifo, "is not a regular file")])
def test_what_is_no_file_in_place_of_a_table_is_named(run, tmp_path, make, says):
    make(tmp_path / "data" / "press.csv")
    refused(run, tmp_path, f"press.csv (table 'table') {says}")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("columns", ["1..3", "1..4"])
def test_a_force_among_the_sensors_columns_is_warned_of(run, put, columns):
    put("press.csv", rows(force=lambda row: (row - 15) ** 2))
    (made,) = run(streams__taxels__channels=[{**TAXELS, "columns": columns}]).recordings
    warned = [(one.severity, one.channels) for one in made.findings if one.check == "target-among-features"]
    assert warned == ([] if columns == "1..3" else [("warning", ("t4",))])


@pytest.mark.parametrize(
    ("rate_hz", "says"), [(None, "ms read as s?"), (100.0, "ms read as s?"), (1e-4, "s read as ms?")]
)
def test_times_in_a_wrong_unit_are_warned_of(run, put, rate_hz, says):
    put("press.csv", "".join(f"{10 * row},{row},2,3,{row}\n" for row in range(40)))
    stated = {} if rate_hz is None else {"streams__taxels__rate_hz": rate_hz, "streams__taxels__rate_source": SOURCE}
    (made,) = run(**stated).recordings
    assert any(one.check == "rate" and one.message.endswith(says) for one in made.findings)


def test_the_shipped_mapping_of_slip_directions_reads_a_misspelt_object(run, put):
    said = yaml.safe_load((ROOT / "examples/mappings/biotacsp-slip-direction.yaml").read_text())
    header = ",".join(f"ff_e{number}" for number in range(1, 25))
    put("csvs/n/strippes305.csv", f"{header}\n" + "".join(f"{','.join([str(row)] * 24)}\n" for row in range(9)))
    (made,) = run(said).recordings
    with open_recording(made.path) as recording:
        assert recording.meta.name == "n-strippes-305"
        assert recording.meta.labels == {
            "direction": "north",
            "slip": "slipped",
            "object": "striped",
            "set": "textures",
        }
