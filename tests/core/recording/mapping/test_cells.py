"""How numbers and times are written: what a mapping can say of it, and the error that says which key to write."""

from datetime import datetime, timedelta

import numpy as np
import openpyxl
import pytest

from .made import read, rows

HEADER = {
    "tables__table__time__column": "t", "streams__force__channels__0__columns": "f",
    "streams__taxels__channels__0__columns": ["a", "b", "c"],
}  # fmt: skip


def taxels(report):
    return read(report)[1]["taxels"]


@pytest.mark.parametrize(
    ("cells", "how"),
    [
        (("0,25", "1.234,5", "-1.002.003,75", "7"), {"delimiter": ";", "decimal": ",", "thousands": "."}),
        (("0.25", '"1,234.5"', '"-1,002,003.75"', "7"), {"thousands": ","}),
        (("0,25", "1 234,5", "-1 002 003,75", "7"), {"delimiter": ";", "decimal": ",", "thousands": " "}),
        (('"0,25"', '"1234,5"', '"-1002003,75"', "7"), {"decimal": ","}),
    ],
)
def test_decimals_and_thousands(tables, cells, how):
    delimiter = how.get("delimiter", ",")
    line = delimiter.join((*cells, "1"))
    tables.put("press.csv", f"{line}\n{line}\n")
    plain = {"format": "csv", "header": False, "delimiter": delimiter}
    tables.refused("press.csv:1: column ", "decimal: ", "thousands: ", tables__table__read=plain)
    made = taxels(tables.run(tables__table__read=plain | how))
    assert (made.data[0].tolist(), made.t_ns[0]) == ([1234.5, -1002003.75, 7.0], 250_000_000)


@pytest.mark.parametrize(
    ("cell", "how"),
    [
        ("1.500", {"decimal": ","}),
        ("1.234,5", {"decimal": ","}),
        ("0,5", {"thousands": ","}),
        ("1,23,456", {"thousands": ","}),
    ],
)
def test_a_number_written_otherwise_than_the_mapping_says_is_refused(tables, cell, how):
    """Dropping every comma would make 5 of 0,5."""
    tables.put("press.csv", f"0;1;2;3;4\n1;{cell};2;3;5\n")
    tables.refused(
        f"press.csv:2: column 1: '{cell}'",
        tables__table__read={"format": "csv", "header": False, "delimiter": ";", **how},
    )


def test_a_time_with_a_point_beside_decimal_commas(tables):
    tables.put("press.csv", "1700000000.25;1,5;2;3;4\n1700000000.5;1,25;2;3;5\n")
    made = taxels(tables.run(tables__table__read={"format": "csv", "header": False, "delimiter": ";", "decimal": ","}))
    assert (made.data[:, 0].tolist(), made.t_ns[0]) == ([1.5, 1.25], 1_700_000_000_250_000_000)


def test_a_row_of_units_and_comments_are_left_out(tables):
    tables.put("press.csv", "# logger 1.2\nt,a,b,c,f\ns,uT,uT,uT,N\n" + rows(3) + "# paused\n0.03,1,2,3,4 # again\n")
    how = {"format": "csv", "header": True}
    tables.refused("press.csv", "comment: '#'", tables__table__read=how, **HEADER)
    tables.refused("press.csv:3", "skiprows: [2]", tables__table__read=how | {"comment": "#"}, **HEADER)
    tables.refused("press.csv:7", "comment: '#'", tables__table__read=how | {"skiprows": [0, 2]}, **HEADER)
    made = taxels(tables.run(tables__table__read=how | {"comment": "#", "skiprows": [2]}, **HEADER))
    assert (len(made.data), made.t_ns.tolist()[-1]) == (4, 30_000_000)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t,a,b,c,f\n0,1,2,3,4\nt,a,b,c,f\n1,1,2,3,5\n", ("press.csv:3", "header is repeated here")),
        ("sep=;\nt;a;b;c;f\n0;1;2;3;4\n", ("'sep=;'", "skiprows: 1", "delimiter: ';'")),
        ("t,a,b,c,f\n0,1,OL,3,4\n1,1,5,-1.#IND,5\n2,1,5,6,5\n", ("press.csv:2: column 'b': 'OL'", '["OL", "-1.#IND"]')),
    ],
)
def test_the_cause_is_named(tables, text, says):
    tables.put("press.csv", text)
    tables.refused(*says, tables__table__read={"format": "csv", "header": True}, **HEADER)


def test_a_word_for_no_sample_may_have_spaces_around_it(tables):
    tables.put("press.csv", "0,1, NA,3,4\n1,NA ,2,3,5\n2,1,2,3,6\n")
    assert tables.run(tables__table__read__no_sample=["NA"]).missing == {"t1": 1, "t2": 1}


BERLIN = {"tables__table__time": {"column": 0, "unit": "s", "epoch": "unix", "zone": "Europe/Berlin"}}
WITHOUT_ZONE = {"tables__table__time": {"column": 0, "unit": "s", "epoch": "unix"}}


def dated(*stamps):
    return "".join(f"{stamp},{row},2,3,{row}\n" for row, stamp in enumerate(stamps))


def test_dates_are_times(tables):
    """Local times by the zone that the mapping states, others by their own offset, both to the nanosecond."""
    tables.put("a.csv", dated("2024-07-01 12:00:00.123456789", "2024-07-01T10:00:01Z", "2024-07-01T12:00:02.5+02:00"))
    whole = 1719828000 * 10**9  # 2024-07-01T10:00:00Z: `date -u -d 2024-07-01T10:00:00Z +%s`
    assert taxels(tables.run(**BERLIN)).t_ns.tolist() == [whole + 123456789, whole + 10**9, whole + 2_500_000_000]


@pytest.mark.parametrize(
    ("stamp", "time", "says"),
    [
        ("2024-07-01 12:00:00", WITHOUT_ZONE, "zone: Europe/Berlin"),
        ("2023-10-29 02:30:00", BERLIN, "offset"),  # twice: clocks are set back at three
        ("2024-03-31 02:30:00", BERLIN, "offset"),  # never: clocks are set forward at two
        ("2024-13-01 02:30:00", BERLIN, "not a time"),
        ("01/07/2024 12:00", BERLIN, "not a time"),
        ("2024-07-01 12:00:00Z", {"tables__table__time__epoch": "start"}, "epoch: unix"),
        ("0", {"tables__table__time__zone": "Europe/Atlantis"}, "Europe/Atlantis"),
    ],
)
def test_a_date_that_is_not_one_moment_is_refused(tables, stamp, time, says):
    tables.put("press.csv", dated(stamp, stamp))
    tables.refused(says, **time)


def test_dates_of_a_sheet_are_times(tables):
    book = openpyxl.Workbook()
    for row in range(3):
        book.active.append([datetime(2024, 1, 1, 12) + timedelta(milliseconds=10 * row), row, 2, 3, row])
    book.save(tables.data / "press.xlsx")
    made = tables.run(tables__table__files="*.xlsx", tables__table__read__format="xlsx", **BERLIN)
    assert taxels(made).t_ns.tolist() == [1704106800 * 10**9 + row * 10**7 for row in range(3)]


@pytest.mark.parametrize(("bits", "unit", "step"), [(32, "us", 10_000), (32, "ms", 10), (16, "ms", 10)])
def test_a_counter_that_wraps(tables, bits, unit, step):
    counted = 2**bits - 10 * step - 1 + step * np.arange(20)
    tables.put("press.csv", "".join(f"{stamp % 2**bits},{row},2,3,{row}\n" for row, stamp in enumerate(counted)))
    time = {"column": 0, "unit": unit, "epoch": "start"}
    (made,) = tables.run(tables__table__time=time).recordings
    assert [("wraps_at" in one.message, one.severity) for one in made.findings if one.check == "backward"] == [
        (True, "error")
    ]
    made.path.unlink()
    tables.refused("press.csv:1:", tables__table__time=time | {"wraps_at": 2 ** (bits - 1)})
    made = taxels(tables.run(tables__table__time=time | {"wraps_at": 2**bits}))
    assert np.array_equal(made.t_ns, counted * {"us": 10**3, "ms": 10**6}[unit])
