"""What a page's script does with its data, in Python, for tests."""

import base64
import json
import re
import zlib


def values(column):
    """Return a column's values, one a row."""
    if "values" in column:
        return column["values"]
    return [column["dictionary"][place] for place in column["index"]]


def opened(blob):
    """Return the JSON document that a text of the data holds."""
    return json.loads(zlib.decompress(base64.b64decode(blob)))


def read_page(html):
    """Return the head of a page, the columns of its table by name, and what it knows of its cells by key."""
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.S)[1])
    head, *columns = map(opened, data)
    names = [one["name"] for one in head["columns"]]
    table = dict(zip(names, columns, strict=False))
    return head, table, dict(zip(head["fields"], map(values, columns[len(names) :]), strict=True))
