"""Foreign tables of every shape become recordings; every misfit is refused with its place, and nothing is left."""

import unicodedata

import numpy as np
import openpyxl
import pytest
import scipy.io

from tactbench.core.errors import ConfigError, MappingError
from tactbench.core.recording.health import marking
from tactbench.core.recording.reader import open_recording
from tactbench.core.samples import Quality

from .made import read, rows


@pytest.mark.parametrize(("name", "cells", "lines"), [("csv", ",", "\r\n"), ("text", " ", "\n")])
def test_a_table_with_a_clock_a_unit_and_a_sentinel(tables, name, cells, lines):
    text = rows(force=lambda row: -1 if row % 2 else row)
    tables.put("press.csv", text.replace("\n", lines).replace(",", cells))
    report = tables.run(tables__table__read__format=name)
    meta, streams = read(report)
    taxels, force = streams["taxels"], streams["force"]
    assert np.array_equal(taxels.data[:, 1], np.arange(40) * 2)
    assert np.array_equal(taxels.t_ns, np.arange(40) * 10_000_000)
    # -1 is no force: half of the rows have none, and the others are newtons (standard gravity, CGPM 1901).
    assert np.isnan(force.data[1::2]).all()
    assert (force.quality[1::2] == Quality.MISSING).all()
    np.testing.assert_allclose(force.data[::2, 0], np.arange(0, 40, 2) * 9.80665e-3, rtol=1e-15)  # one multiplication
    assert sorted(meta.counts.values()) == [20, 40, 40]
    assert (meta.simulated, meta.clock, meta.origin, meta.remarks) == (False, "host", "press.csv", ())


def test_times_since_1970_keep_every_digit(tables):
    """A float64 of seconds since 1970 is good to 0.2 µs only; the text is exact."""
    tables.put("press.csv", "1743486221.590758001,1,2,3,4\n1743486221.590758002,1,2,3,5\n")
    _, streams = read(tables.run(tables__table__time__epoch="unix"))
    assert streams["taxels"].t_ns.tolist() == [1743486221590758001, 1743486221590758002]


@pytest.mark.parametrize(("stamp", "year"), [("31535999.9", "1970"), ("7258118400.1", "2200")])
def test_times_since_1970_are_of_1971_to_2199(tables, stamp, year):
    """Other times are in another unit, or of a clock that begins at 0."""
    since_1970 = {"tables__table__time__epoch": "unix"}
    tables.put("press.csv", f"31536000,1,2,3,4\n{stamp},1,2,3,5\n")
    tables.refused("press.csv:2", year, **since_1970)
    tables.put("press.csv", "31536000,1,2,3,4\n7258118400,1,2,3,5\n")
    assert tables.run(**since_1970).rows == 2


def test_columns_by_name_ranges_and_combinations(tables):
    header = "object,slipped," + ",".join(f"{finger}_{n}" for finger in ("ff", "th") for n in (1, 2))
    tables.put("a.csv", f"{header}\npen,0,1,2,3,4\ncup,1,5,6,7,8\n")
    report = tables.run("""
        clock: none
        tables: {table: {files: "*.csv", read: {format: csv, header: true}}}
        streams:
          taxels:
            table: table
            dtype: uint16
            channels:
            - {columns: [ff_1..2, th_1..2], name: "{finger}.{n}", over: {finger: [ff, th], n: 1..2},
               kind: taxel, unit: count}
            annotations:
              object: {column: object}
              slipped: {column: slipped, values: {0: stable, 1: slipped}}
    """)
    meta, streams = read(report)
    taxels = streams["taxels"]
    assert (len(meta.remarks), meta.remarks[0][:8]) == (1, "No clock")
    assert [channel.name for channel in taxels.spec.channels] == ["ff.1", "ff.2", "th.1", "th.2"]
    assert {(one.sign, one.lower, one.upper, one.rest) for one in taxels.spec.channels} == {(0, None, None, None)}
    assert taxels.data.tolist() == [[1, 2, 3, 4], [5, 6, 7, 8]]
    assert taxels.annotations["slipped"].tolist() == ["stable", "slipped"]
    assert taxels.t_ns is None


@pytest.mark.parametrize("end", ["", ","])
def test_a_delimiter_that_ends_every_line_but_the_header_makes_no_column(tables, end):
    tables.put("press.csv", "t,a,b,c,f\n" + rows().replace("\n", f"{end}\n"))
    report = tables.run(tables__table__read__header=True)
    assert np.array_equal(read(report)[1]["taxels"].data[:, 1], np.arange(40) * 2)


def test_records_of_several_lines_below_a_line_that_is_left_out(tables):
    read_as = {"format": "records", "skiprows": 1, "numbers_per_line": [2, 3]}
    text = "".join(f"{row} {row * 2}\n{row * 3} {row % 5} {row}\n" for row in range(20))
    for wrong, place in ((text, "press.csv:2"), (f"-1\n{text}7 7\n", "2 lines"), (f"-1\n{text}7\n", "press.csv:42")):
        tables.put("press.csv", wrong)
        tables.refused("press.csv", place, tables__table__read=read_as)
    tables.put("press.csv", f"-1\n{text}")
    taxels = read(tables.run(tables__table__read=read_as))[1]["taxels"]
    assert np.array_equal(taxels.data, np.arange(20)[:, None] * [2, 3, 1] % [99, 99, 5])


@pytest.mark.parametrize(("name", "count", "first"), [("npz", 10, "r0"), ("mat", 11, "r00")])
def test_an_archive_of_arrays(tables, name, count, first):
    X = np.random.default_rng(0).normal(size=(count, 5, 3)).astype(np.float32)
    arrays = {"X": X, "y": np.arange(count) % 2}
    np.savez_compressed(tables.data / "x.npz", **arrays)
    scipy.io.savemat(tables.data / "x.mat", arrays, do_compression=True)
    report = tables.run(f"""
        clock: none
        tables:
          table:
            files: x.{name}
            read: {{format: {name}, array: X, axes: [recording, row, channel], per_recording: {{y: y}}}}
        words: {{slip: {{of: y, values: {{0: "no", 1: "yes"}}}}, block: {{of: index, divided_by: 4}}}}
        recording: {{name: "r{{index}}", session: s, labels: {{slip: "{{slip}}", block: "{{block}}"}}}}
        streams:
          taxels:
            table: table
            dtype: float32
            channels: [{{columns: 0..2, name: "t{{column}}", kind: taxel, unit: count}}]
    """)
    assert (len(report.recordings), report.recordings[0].meta.name) == (count, first)
    meta, streams = read(report, 7)
    assert np.array_equal(streams["taxels"].data, X[7])
    assert meta.labels == {"slip": "yes", "block": "1"}


NPY = """
clock: none
tables:
  table:
    files: "x_*.npy"
    path: "x_(?P<fold>[a-z]+)"
    read: {format: npy, axes: [recording, channel, channel, row], per_recording: {y: "labels_{fold}.npy"}}
recording: {name: "{fold}-{index}", session: s, labels: {material: "{y}"}}
streams:
  taxels: {table: table, dtype: float32, channels: [{columns: 0..5, name: "t{column}", kind: taxel, unit: count}]}
"""


def test_arrays_in_files_of_their_own_with_channels_on_a_grid(tables):
    X = np.random.default_rng(0).normal(size=(4, 2, 3, 5)).astype(np.float32)
    for fold, labels in (("a", [3, 1, 2, 0]), ("b", [0, 0, 7, 0])):
        np.save(tables.data / f"x_{fold}.npy", X if fold == "a" else -X)
        np.save(tables.data / f"labels_{fold}.npy", labels)
    report = tables.run(NPY)
    meta, streams = read(report, 6)
    assert (meta.name, meta.labels) == ("b-2", {"material": "7"})
    assert np.array_equal(streams["taxels"].data, -X[2].reshape(6, 5).T)


def test_a_pickled_array_and_one_without_its_labels_are_refused(tables):
    np.save(tables.data / "x_a.npy", np.zeros((4, 2, 3, 5)))
    tables.refused("labels_a.npy", text=NPY)
    np.save(tables.data / "labels_a.npy", np.zeros(3))
    tables.refused("labels_{fold}.npy", "(3,)", text=NPY)
    np.save(tables.data / "labels_a.npy", np.array([0, 1, 2, "a"], dtype=object))
    tables.refused("x_a.npy", "allow_pickle", text=NPY)
    np.savez(tables.data / "x.npz", X=np.array([0, "a"], dtype=object))
    read_as = {"format": "npz", "array": "X", "axes": ["row"]}
    tables.refused("x.npz", "allow_pickle", tables__table__files="x.npz", tables__table__read=read_as)


def test_a_sheet_of_an_excel_workbook_and_words_for_no_sample(tables):
    book = openpyxl.Workbook()
    lines = [[row * 0.01, row, row / 3, {3: None, 4: "NA", 5: "nan"}.get(row, 1), row * 1.5] for row in range(20)]
    for line in (["measured on a Monday"], [], ["t", "a", "b", "c", "f"], *lines):
        book.active.append(line)
    book.create_sheet("notes")
    book.save(tables.data / "press.xlsx")
    several = {"format": "xlsx", "header": True}
    tables.refused("Sheet, notes", tables__table__files="*.xlsx", tables__table__read=several)
    report = tables.run(
        tables__table__files="*.xlsx", streams__taxels__channels__0__columns=["a", "b", "c"],
        tables__table__read={**several, "sheet": "Sheet", "skiprows": 2, "no_sample": ["", "NA"]},
    )  # fmt: skip
    taxels = read(report)[1]["taxels"].data
    assert np.array_equal(taxels[:, 0], np.arange(20))
    np.testing.assert_allclose(taxels[:, 1], np.arange(20) / 3, rtol=1e-14)  # openpyxl writes 15 digits
    assert report.missing == {"tc": 3}


JOINED = """
tables:
  sensor:
    files: "*/sensor.csv"
    path: "(?P<start>[0-9]+)_probe"
    read: {format: csv, header: false}
    time: {column: 0, unit: s, epoch: unknown}
  states:
    files: "*/states.csv"
    path: "(?P<start>[0-9]+)_probe"
    read: {format: csv, header: false}
    time: {column: 0, unit: ms, epoch: unknown}
join: {by: rows, times_within_ms: 5}
recording: {name: "{start}", session: "{start}"}
streams:
  taxels:
    table: sensor
    channels: [{columns: 1..3, name: "t{column}", kind: taxel, unit: count}]
    annotations: {press: {rows_per: 20}}
  force: {table: states, of: reference, channels: [{columns: 1, name: fz, kind: force, unit: N, sentinels: [-1]}]}
"""


def states(n=40, late_ms=4.0):
    return "".join(f"{row * 10 + late_ms},{row * 2}\n" for row in range(n))


def test_two_tables_row_by_row_each_with_its_clock(tables):
    tables.put("1_probe/sensor.csv", rows())
    tables.put("1_probe/states.csv", states())
    _, streams = read(tables.run(JOINED))
    taxels, force = streams["taxels"], streams["force"]
    assert np.array_equal(force.t_ns - taxels.t_ns, np.full(40, 4_000_000))
    assert np.array_equal(taxels.annotations["press"], np.arange(40) // 20)


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({"1_probe/states.csv": states(39)}, "39 rows"),
        ({"1_probe/states.csv": states(late_ms=5.5)}, "5.5 ms"),
        ({"2_probe/states.csv": states()}, "{'start': '1'}"),
    ],
)
def test_tables_that_do_not_belong_together(tables, files, says):
    tables.put("1_probe/sensor.csv", rows())
    for name, text in files.items():
        tables.put(name, text)
    tables.refused(says, text=JOINED)


BY_CLOCK = """
tables:
  taxels: {files: pad.csv, read: {format: csv, header: false}, time: {column: 0, unit: s, epoch: unix}}
  scale: {files: scale.csv, read: {format: csv, header: false}, time: {column: 0, unit: s, epoch: unix}}
join: {by: clock}
recording: {name: press, session: "1"}
streams:
  taxels: {table: taxels, channels: [{columns: 1, name: t, kind: taxel, unit: count}]}
  force: {table: scale, of: reference, channels: [{columns: 1, name: fz, kind: force, unit: N, sentinels: []}]}
"""


def test_clocks_that_meet_in_part_or_not_at_all(tables):
    def seconds(first, last):
        return "".join(f"{1_700_000_000 + second},{second}\n" for second in range(first, last))

    def found(**change):
        report = tables.run(BY_CLOCK, replace=True, **change)
        return [finding for finding in report.recordings[0].findings if finding.check in ("spans", "mixed-stamps")]

    tables.put("pad.csv", seconds(0, 60))
    tables.put("scale.csv", seconds(1, 61))
    assert not found()
    tables.put("scale.csv", seconds(50, 110))
    (part,) = found()
    assert (part.check, part.severity) == ("spans", "warning")
    assert not found(tables__scale__time__offset_s=-50)
    assert "epoch" in found(tables__scale__time__epoch="unknown")[0].message
    tables.put("scale.csv", seconds(3600, 3660))
    for path in tables.out.iterdir():
        path.unlink()
    spans = ["2023-11-14T22:13:20.0", "2023-11-14T22:14:19.0", "2023-11-14T23:13:20.0", "3541"]
    tables.refused("pad.csv", "scale.csv", *spans, text=BY_CLOCK)


def test_a_file_without_a_partner_costs_its_own_recording_and_is_named(tables):
    tables.put("1_probe/sensor.csv", rows())
    tables.put("1_probe/states.csv", states())
    tables.put("2_probe/sensor.csv", rows())
    tables.put("3_probe/states.csv", states())
    report = tables.run(JOINED)
    assert [made.meta.name for made in report.recordings] == ["1"]
    assert [text.split()[0] for text in report.left_out] == ["2_probe/sensor.csv", "3_probe/states.csv"]
    with open_recording(report.recordings[0].path) as recording:
        (mark,) = marking(recording)
    assert (mark.check, "2_probe/sensor.csv" in mark.message) == ("left-out", True)


def test_roles_labels_and_excluded_files(tables):
    for name in ("bad", "good"):
        tables.put(f"{name}.csv", rows())
    report = tables.run("""
        words: {role: {of: file, values: {bad: train, good: test}}}
        recording: {name: "{file}", session: "{file}", role: "{role}", labels: {weight_g: 5, object: "{file}"}}
        exclude: [{files: bad*, reason: unreliable}]
    """)
    bad, good = (read(report, number)[0] for number in (0, 1))
    assert (bad.role, bad.excluded, good.role, good.excluded) == ("train", "unreliable", "test", "")
    assert good.labels == {"weight_g": 5, "object": "good"}


def test_sentinels_must_be_stated(tables):
    tables.put("press.csv", rows())
    tables.refused("`sentinels: []`", streams__force__channels__0__sentinels=None)


ROWS = np.arange(600)
PRESSES = np.maximum(np.round(10 * np.sin(ROWS / 30) + 3, 1), 0)
LEVELS = np.random.default_rng(4).uniform(2, 10, 21)[ROWS // 30]


def some(share, value, seed=3):
    return np.where(np.random.default_rng(seed).random(600) < share, value, PRESSES)


def unsigned(values):
    return np.mod(np.round(values), 2**16)


@pytest.mark.parametrize(
    ("column", "says"),
    [
        (some(0.08, 65535), "fz: 65535,"),
        (some(0.03, -999), "`sentinels: [-999]`"),
        (some(0.03, -1), "`sentinels: [-1]`"),
        (np.where(ROWS % 2, -1, PRESSES), "`sentinels: [-1]`"),
        (np.where(ROWS % 100 < 10, -1, PRESSES + 5), "`sentinels: [-1]`"),
        (np.where(ROWS % 500 == 250, -9999, PRESSES), "`sentinels: [-9999]`"),
        (unsigned(400 * PRESSES - 40 + ROWS % 90), "65536"),
        (unsigned(np.random.default_rng(2).normal(6, 4, 600)), "65536"),
        (PRESSES, ""),
        (np.minimum(PRESSES, 6), ""),
        (np.full(600, 7), ""),
        (np.where(ROWS % 30 < 20, np.round(LEVELS * np.sin(np.pi * (ROWS % 30) / 20), 2), 0), ""),
        (np.where(ROWS % 30 < 20, np.round(LEVELS, 2), 0), ""),
        (np.where(ROWS % 30 < 20, 5 + ROWS % 13 / 1000, 0), ""),
        (np.where(ROWS % 40 < 20, 65535, 0), ""),
        (np.random.default_rng(5).integers(0, 256, 600), ""),
        (np.where(ROWS < 60, ROWS % 2, ROWS // 30), ""),
    ],
)  # fmt: skip
def test_values_that_are_no_readings_are_reported_and_kept(tables, column, says):
    tables.put("press.csv", rows(600, lambda row: column[row]))
    report = tables.run(
        streams__force__channels__0={"columns": 4, "name": "fz", "kind": "force", "unit": "N", "sentinels": []}
    )
    found = [finding for finding in report.recordings[0].findings if finding.check == "no-reading"]
    assert [(one.channels, says in one.message) for one in found] == [(("fz",), True)] * bool(says)
    assert np.array_equal(read(report)[1]["force"].data[:, 0], column)


@pytest.mark.parametrize(
    ("text", "change", "says"),
    [
        ("0,1,2,3,4\n1,1,2,3\n", {}, "press.csv:2: 4"),
        ("0,1,2,3,4\nsoon,1,2,3,4\n", {}, "'soon'"),
        ("0,nan,2,3,4\n1,nan,2,3,5\n", {}, "(channel t1)"),
        ("0\t1\t2\t3\t4\n1\t1\t2\t3\t4\n", {}, '`delimiter: "\\t"`'),
        (rows(), {"tables__table__read__header": True}, "`skiprows: 1`"),
        (rows(), {"streams__force__channels__0__given_in": "mm"}, "'mm'"),
        (rows(), {"tables__table__files": "*.tsv"}, "'*.tsv'"),
        (rows(), {"tables__table__path": "(?P<start>[0-9]+)_"}, "other.csv"),
        (rows(), {"recording__name": "{start}"}, "'start'"),
        (rows(), {"recording__name": "same"}, "'same'"),
        (rows(), {"streams__taxels__dtype": "uint8", "streams__taxels__channels__0__columns": "0..2"},
         "0.01"),
        (rows(), {"tables__table__time__epoch": "unix"}, "1970"),
        (rows(39), {"streams__taxels__annotations": {"press": {"rows_per": 20}}}, "39"),
        (rows(), {"streams__taxels__annotations": {"press": {"column": 3, "values": {"0": "a"}}}}, "'3'"),
        (rows(), {"streams__taxels__channels__0__name": "t{n}", "streams__taxels__channels__0__over": {"n": "1..2"}},
         "taxels"),
        (rows(), {"streams__taxels__channels__0__columns": "3..1"}, "'3..1'"),
        (rows(), {"words": {"s": {"of": "file", "values": {"other": "A"}}}, "sensor__name": "pad-{s}"}, "'pad-A'"),
        (rows(), {"words": {"s": {"of": "file", "values": {"press": "a"}}}}, "'other'"),
        (rows(), {"words": {"s": {"of": "file", "divided_by": 2}}}, "'other'"),
        (rows(), {"words": {"s": {"of": "files", "divided_by": 2}}}, "'files'"),
        (rows(), {"recording__role": "{file}"}, "'other'"),
        (rows(), {"recording__name": "a/{file}"}, "'a/other'"),
        (rows(), {"streams__taxels__of": "reference"}, "streams"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_with_its_place(tables, text, change, says):
    tables.put("other.csv", rows())
    tables.put("press.csv", text)
    tables.refused(says, **change)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"clock": "none"}, "clock"),
        ({"tables__table__time": None}, "clock"),
        ({"streams__taxels__table": "tables"}, "'tables'"),
        ({"join": {"by": "clock"}, "split_by": {"a": 1}}, "split_by"),
        ({"words": {"s": {"of": "file"}}}, "divided_by"),
        ({"words": {"s": {"of": "file", "values": {"a": "b"}, "divided_by": 2}}}, "divided_by"),
        ({"streams__taxels__annotations": {"a": {}}}, "rows_per"),
        ({"streams__taxels__annotations": {"a": {"column": 1, "rows_per": 2}}}, "rows_per"),
        ({"streams__taxels__rate_hz": 100}, "rate_source"),
        ({"tables__table__read": {"format": "csv", "header": False, "decimal": ",", "thousands": ","}}, "thousands"),
        ({"tables__table__read": {"format": "npz", "axes": ["row"]}}, "array"),
        ({"tables__table__read": {"format": "npy", "axes": ["row"], "array": "x"}}, "array"),
        ({"tables__table__read": {"format": "npy", "axes": ["row", "row"]}}, "axes"),
        ({"tables__table__read": {"format": "npy", "axes": ["recording", "recording"]}}, "axes"),
        ({"tables__table__read": {"format": "npy", "axes": ["row"], "per_recording": {"y": "y"}}}, "per_recording"),
        ({"tables__table__time__unit": "mm"}, "unit"),
        ({"tables__table__path": "("}, "path"),
        ({"streams__force__channels__0__unit": "count"}, "unit"),
    ],
)
def test_a_mapping_that_contradicts_itself_is_refused_with_its_line(tables, change, key):
    tables.put("press.csv", rows())
    with pytest.raises(ConfigError, match=r"mapping\.yaml:\d+") as caught:
        tables.run(**change)
    assert key in str(caught.value)


def test_the_same_import_changes_nothing_and_another_one_is_refused_or_replaces_if_asked_to(tables):
    tables.put("press.csv", rows())
    (first,) = tables.run().recordings
    before = first.path.stat().st_mtime_ns, first.path.read_bytes()
    tables.run()
    assert (first.path.stat().st_mtime_ns, first.path.read_bytes()) == before
    tables.put("press.csv", rows(41))
    with pytest.raises(MappingError, match="--replace"):
        tables.run()
    assert first.path.read_bytes() == before[1]
    assert tables.run(replace=True).rows == 41


@pytest.mark.parametrize("columns", ["1..3", "1..4"])
def test_a_force_among_the_sensors_columns_is_warned_of(tables, columns):
    tables.put("press.csv", rows(force=lambda row: (row - 15) ** 2))
    (made,) = tables.run(streams__taxels__channels__0__columns=columns).recordings
    warned = [(one.severity, one.channels) for one in made.findings if one.check == "target-among-features"]
    assert warned == ([] if columns == "1..3" else [("warning", ("t4",))])


def test_times_in_a_wrong_unit_are_warned_of_and_that_is_kept_with_the_recording(tables):
    tables.put("press.csv", "".join(f"{10 * row},{row},2,3,{row}\n" for row in range(40)))
    (made,) = tables.run().recordings
    assert any(one.check == "rate" and "ms" in one.message for one in made.findings)
    read(tables.run())  # its content is what was written
    with open_recording(made.path) as recording:
        kept = recording.meta.provenance["findings"]
        assert [one["check"] for one in kept] == [one.check for one in made.findings if one.severity != "info"]
        assert [one.check for one in marking(recording)] == ["rate"]


def test_a_word_in_two_forms_of_unicode_is_one(tables):
    composed = "caf\u00e9"
    for n, form in enumerate(("NFC", "NFD")):
        name = unicodedata.normalize(form, composed)
        tables.put(f"{n}-{name}.csv", "".join(f"{row},{row},2,3,{row},{name}\n" for row in range(9)))
    report = tables.run(
        """
        words: {short: {of: word, values: {café: c}}}
        recording: {name: "{n}-{short}", session: "{word}", labels: {object: "{word}"}}
        """,
        tables__table__path="(?P<n>.)-(?P<word>.*).csv",
        streams__taxels__annotations={"again": {"column": 5}},
    )
    for number in range(2):
        meta, streams = read(report, number)
        assert (meta.session, meta.labels["object"]) == (composed, composed)
        assert set(streams["taxels"].annotations["again"]) == {composed}
