"""What a page's script does with its data, in Python: the other half of the codec, for tests."""

import base64
import json
import re
import struct
import zlib

from tactbench.core.leaderboard.board.digits import NO_VALUE


def planes(blobs, told):
    blob, width = told
    content = blobs[blob]
    count = len(content) // width
    return [sum(content[plane * count + row] << 8 * plane for plane in range(width)) for row in range(count)]


def texts(blobs, column):
    """Return what a column shows."""
    if column["kind"] == "words":
        words = json.loads(blobs[column["words"]])
        return [words[at] for at in planes(blobs, column["at"])]
    if column["kind"] == "joined":
        return [column["by"].join(parts) for parts in zip(*(texts(blobs, one) for one in column["parts"]), strict=True)]
    if column["kind"] == "hex":
        return [f"{one:0{column['digits']}x}" if one else "" for one in planes(blobs, column["at"])]
    if column["kind"] == "nothing":
        return None
    numbers = [planes(blobs, one) for one in column["numbers"]]
    shown = []
    for row, at in enumerate(planes(blobs, column["at"])):
        pattern, counts = column["patterns"][at][:2]
        digits = iter("".join(f"{numbers[place][row]:0{count}d}" for place, count in enumerate(counts)))
        shown.append(re.sub("#", lambda _, digits=digits: next(digits), pattern) if counts else pattern)
    return shown


def values(blobs, column):
    """Return what a column of numbers is sorted by, None where there is nothing."""
    if "values" in column:
        content = blobs[column["values"]]
        found = struct.unpack(f"<{len(content) // 4}f", content)
        return [None if one != one else one for one in found]
    numbers = [planes(blobs, one) for one in column["numbers"]]
    rest = blobs[column["rest"]] if "rest" in column else None
    told = []
    for row, at in enumerate(planes(blobs, column["at"])):
        _, _, scales, shares = column["patterns"][at]
        if not scales or (rest is not None and rest[row] == NO_VALUE):
            told.append(None)
            continue
        value = sum(numbers[place][row] * scale * shares[place] for place, scale in enumerate(scales))
        if rest is not None:
            value += (rest[row] - column["steps"] / 2) / column["steps"] * abs(scales[0])
        told.append(value)
    for row, value in column.get("odd", []):
        told[row] = value
    return told


def opened(blobs):
    """Return the content of a pack's blobs."""
    return [zlib.decompress(base64.b64decode(blob)) for blob in blobs]


def read_page(html):
    """Return head and blobs of a page."""
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.S)[1])
    blobs = opened(data["blobs"])
    return json.loads(blobs[data["head"]]), blobs
