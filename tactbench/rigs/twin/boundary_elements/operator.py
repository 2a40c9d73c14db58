"""The elastic surface on a window of the grid: displacement from pressure by one padded transform each way.

Pressure is zero outside the contact, so the solver works on the window that holds it. The convolution on a window is
linear, not circular (Liu, Wang & Liu 2000, Wear 243: padding to twice the size), unless the window is a whole period.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.rigs.twin.boundary_elements.kernels import Kernel, wave_numbers


@dataclass(frozen=True)
class Operator:
    """One kernel on one window."""

    window: tuple[int, int]
    """Cells."""
    padded: tuple[int, int]
    """Lengths of the transforms."""
    compliance: FloatArray
    """(padded[0], padded[1]//2+1) transform of the influence [mm/MPa]; real, because the influence is even."""
    stiffness: FloatArray
    """(window[0], window[1]//2+1) stiffness of the window's own waves [MPa/mm], for preconditioning."""

    def displacement(self, pressure: FloatArray) -> FloatArray:
        """Return the (nx, ns) displacement [mm] under a (nx, ns) pressure [MPa] on the window."""
        from scipy import fft

        spectrum = fft.rfft2(pressure, self.padded)
        spectrum *= self.compliance
        whole: FloatArray = fft.irfft2(spectrum, self.padded, overwrite_x=True)
        return whole[: self.window[0], : self.window[1]]

    def stiffen(self, displacement: FloatArray) -> FloatArray:
        """Return about the (..., nx, ns) pressure that causes a displacement: exact for waves, blind to edges."""
        from scipy import fft

        spectrum = fft.rfft2(displacement)
        spectrum *= self.stiffness
        pressure: FloatArray = fft.irfft2(spectrum, self.window, overwrite_x=True)
        return pressure


def window_cells(kernel: Kernel, cells: tuple[int, int], least: tuple[int, int]) -> tuple[int, int]:
    """Return the window to use for `least` cells: of a length that transforms quickly, within the domain."""
    from scipy import fft

    lengths = []
    for n, w in zip(cells, least, strict=True):
        quick = fft.next_fast_len(max(w, 4), real=True)
        # A window wider than half a period would see both ways around: the period itself is then shorter.
        limit = n // 2 if kernel.periodic else n
        lengths.append(quick if quick <= limit else n)
    return lengths[0], lengths[1]


@lru_cache(maxsize=32)
def operator(kernel: Kernel, cells: tuple[int, int], cell_mm: tuple[float, float], window: tuple[int, int]) -> Operator:
    """Return `kernel` on a window of a domain; the last ones are kept.

    Parameters
    ----------
    kernel
        The elastic surface.
    cells
        Of the domain.
    cell_mm
        Sides of a cell.
    window
        From `window_cells`.
    """
    from scipy import fft

    influence = _influence(kernel, cells, cell_mm)
    padded, places = [], []
    for n, w in zip(cells, window, strict=True):
        whole_period = kernel.periodic and w == n
        length = n if whole_period else fft.next_fast_len(2 * w, real=True)
        index = np.arange(length)
        # Circular offsets; those beyond the window only multiply padding.
        offset = np.minimum(index, length - index)
        places.append(offset if whole_period else np.minimum(offset, w - 1))
        padded.append(length)
    table = influence[np.ix_(*places)]
    k = wave_numbers(window, cell_mm)
    # The window's mean is not a wave: it is treated like one of twice the window's length.
    k[0, 0] = 0.5 * min(k[0, 1], k[1, 0])
    return Operator(
        window=window,
        padded=(padded[0], padded[1]),
        compliance=np.ascontiguousarray(fft.rfft2(table).real),
        stiffness=kernel.stiffness(k),
    )


@lru_cache(maxsize=16)
def _influence(kernel: Kernel, cells: tuple[int, int], cell_mm: tuple[float, float]) -> FloatArray:
    return kernel.influence(cells, cell_mm)
