"""Figures that are drawn and not rendered, for tests that look at which there are and not at their bytes."""

from base64 import b64decode
from contextlib import contextmanager

import pytest

PIXEL = b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK+kcQAAAABJRU5ErkJggg==")


def _save(figure, to, **options):
    """Lay the figure out and draw it on nothing, and save a picture of one pixel."""
    if options["format"] == "png":
        figure.draw_without_rendering()  # once: the same figure is saved as PDF too
    to.write(PIXEL)


@contextmanager
def unrendered():
    """Leave out rendering and encoding, and most steps of an embedding: they take most of the time of figures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tactbench.core.report.figures.answers.ITERATIONS", 250)
        patch.setattr("matplotlib.figure.Figure.savefig", _save)
        yield
