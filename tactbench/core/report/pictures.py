"""The figures, with their captions."""

from __future__ import annotations

from tactbench.core.report.section import Picture, Section, Subject


def pictures_section(subject: Subject) -> Section:
    """Return the section of figures: those that were drawn for this page."""
    if not subject.drawn:
        none = "None was drawn from these results: `tactbench run` makes what the paper's figures show."
        return Section("figures", "Figures", missing=subject.undrawn or (none,))
    by_key = {row["key"]: row["cell"] for row in subject.rows if row["key"]}
    pictures = tuple(
        Picture(
            title=one.title,
            caption=one.caption,
            png=one.png.read_bytes(),
            cells=tuple((by_key[key], subject.anchors[by_key[key]]) for key in one.keys if key in by_key),
        )
        for one in subject.drawn
    )
    said = ("The same figures lie beside this page as `figures/*.pdf` and `figures/*.png`.",)
    return Section("figures", "Figures", said=said, pictures=pictures, missing=subject.undrawn)
