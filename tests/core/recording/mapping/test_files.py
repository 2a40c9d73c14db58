"""What lies below the root against what the mapping means: nothing that matches a pattern vanishes unnamed."""

import pytest

from tactbench.core.errors import MappingError
from tactbench.core.recording.mapping.formats import require_format

from .made import rows


def test_links_to_files_that_are_not_here_are_refused(tables):
    tables.put("a.csv", rows())
    for name in ("b.csv", "c.csv"):
        (tables.data / name).symlink_to(f"../.git/annex/objects/XX/{name}")
    tables.refused("2 of 3", "b.csv", "c.csv", "datalad get")
    tables.refused("1 of 1", "b.csv", tables__table__files="b.csv")


def test_what_matches_and_is_no_table_is_named(tables, tmp_path):
    tables.put("s/a.csv", rows())
    tables.put("s/b.CSV", rows())
    tables.put("s/._a.csv", b"\x00\x05\x16\x07\x00\x02\x00\x00Mac OS X")
    (tables.data / "s" / "folder.csv").mkdir()
    (tmp_path / "elsewhere" / "deep").mkdir(parents=True)
    (tmp_path / "elsewhere" / "deep" / "d.csv").write_text(rows())
    (tables.data / "s" / "linked").symlink_to(tmp_path / "elsewhere")
    report = tables.run(tables__table__files="**/*.csv")
    assert [made.meta.origin for made in report.recordings] == ["s/a.csv"]
    assert [text.rpartition(" ")[2] for text in report.left_out] == ["s/b.CSV", "s/linked"]
    assert report.unused == ()
    linked = tables.run(tables__table__files="s/linked/*/*.csv")  # a link that is named in the pattern is followed
    assert ([made.meta.origin for made in linked.recordings], linked.left_out) == (["s/linked/deep/d.csv"], ())


@pytest.mark.parametrize("pattern", ["../other/*.csv", "s/../../*.csv", "/data/*.csv"])
def test_a_pattern_stays_below_its_root(tables, pattern):
    tables.put("press.csv", rows())
    tables.refused("below the root", tables__table__files=pattern)


def test_files_whose_columns_are_named_by_place_have_one_width(tables):
    for name in ("a.csv", "b.csv"):
        tables.put(name, rows())
    tables.put("c.csv", rows().replace("\n", ",7\n"))
    tables.refused("c.csv", "a.csv", "Column 5")


def test_a_place_is_the_same_column_in_all_files(tables):
    tables.put("a.csv", "t,x,y,z,f\n" + rows())
    tables.put("b.csv", "t,y,x,z,f,more\n" + rows().replace("\n", ",1\n"))
    tables.refused("b.csv", "Column 1", tables__table__read={"format": "csv", "header": True})
    tables.put("b.csv", "t,y,x,z,f\n" + rows())
    read = {"format": "csv", "header": True}
    tables.refused("Column 1", "'y'", "'x'", "a.csv", tables__table__read=read)
    named = {"tables__table__time__column": "t", "streams__force__channels__0__columns": "f",
             "streams__taxels__channels__0__columns": ["x", "y", "z"]}  # fmt: skip
    tables.put("c.csv", "more,t,x,y,z,f\n" + "1,".join(["", *rows().splitlines(keepends=True)]))
    report = tables.run(tables__table__read=read, **named)
    assert (len(report.recordings), report.unused[0].endswith(": more")) == (3, True)


def test_columns_that_are_not_used_are_named_once(tables):
    for name in ("a.csv", "b.csv"):
        tables.put(name, rows().replace("\n", ",7,8\n"))
    (unused,) = tables.run().unused
    assert unused.endswith("5 and 6")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\x1f\x8b\x08\x00", "gunzip press.csv"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ".xlsx or CSV"),
        ("t,a\n".encode("utf-16"), "iconv -f UTF-16"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "git lfs pull"),
        (b"/annex/objects/MD5E-s9--0.csv\n", "datalad get press.csv"),
        (b"\xef\xbb\xbf\n<!DOCTYPE HTML>\n<html>", "web page"),
        (b"#ROSBAG V2.0\n", "ROS 1"),
        (b"SQLite format 3\x00\x10", "mcap convert press.csv"),
        (b"\x89HDF\r\n\x1a\n\x00", "HDF5"),
        (b"PAR1\x15\x04", "`format: parquet`"),
        (b"\x93NUMPY\x01\x00", "`format: npy`"),
        (b"PK\x03\x04\x14\x00", "unzip press.csv"),
        (rows().replace("12", "12\0\0").encode(), "press.csv:7 "),
        ("t,µT\n0,1\n".encode("latin-1"), "0xb5, 'µ'"),
    ],
)
def test_a_file_is_named_by_its_first_bytes(tables, content, says):
    tables.put("press.csv", content)
    tables.refused("press.csv", says)


def test_a_file_that_cannot_be_read_is_named(tables):
    with pytest.raises(MappingError, match="press"):
        require_format(tables.data, "press", "csv")


def test_letters_alone_make_no_other_format(tables):
    """A table may begin with a name that is also the signature of a format."""
    tables.put("press.csv", "PAR1,par1,bzh,t,f\n" + rows())
    columns = {"streams__taxels__channels__0__columns": ["par1", "bzh", "t"], "tables__table__time__column": "PAR1",
               "streams__force__channels__0__columns": "f"}  # fmt: skip
    assert tables.run(tables__table__read={"format": "csv", "header": True}, **columns).rows == 40
