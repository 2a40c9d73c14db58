"""Output of tables as HTML, for notebooks."""

from __future__ import annotations

from collections.abc import Iterable

from tactbench.core.tables.text_table import TextTable

_TEMPLATE = """\
{% for table in tables %}
<p>{{ table.title }} {{ table.origin }}{% for text in table.summary %}<br>{{ text }}{% endfor %}</p>
<table>
<thead><tr>{% for name in table.headers %}<th>{{ name }}</th>{% endfor %}</tr></thead>
<tbody>
{% for line in table.lines %}
<tr>{% for text in line %}<td style="text-align: {{ "right" if table.right[loop.index0] else "left" }}">{{ text }}</td>\
{% endfor %}</tr>
{% endfor %}
</tbody>
</table>
<p>{% for note in table.notes %}{{ note }}<br>{% endfor %}</p>
{% endfor %}
"""


def html(tables: Iterable[TextTable]) -> str:
    """Return tables and their notes as HTML without scripts; all texts are escaped."""
    from jinja2 import Environment

    return Environment(autoescape=True, trim_blocks=True).from_string(_TEMPLATE).render(tables=list(tables))
