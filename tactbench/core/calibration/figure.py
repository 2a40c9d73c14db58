"""Two figures: which nuisance decides which number, and the draws behind that."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactbench.core.calibration.acceptance import by_fitted
from tactbench.core.calibration.draw import Draw, output_values, parameter_values
from tactbench.core.calibration.sensitivity import Sensitivity
from tactbench.core.spec.calibration import CalibrationSpec, Fixed, LogUniform, Nuisance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe and Ito's colours, told apart by people with any colour vision; shapes say the same again.
_PRIOR, _ACCEPTED, _PUBLISHED = "#999999", "#0072B2", "#D55E00"


def sensitivity_figure(spec: CalibrationSpec, found: Sequence[Sensitivity]) -> Figure:
    """Return a panel for each published number: partial rank correlation with every nuisance, and its interval."""
    from matplotlib.figure import Figure

    shown = [one.output for one in spec.published if any(line.output == one.output for line in found)]
    figure = Figure(figsize=(2.6 * max(len(shown), 1) + 1.6, 4.4), layout="constrained")
    if not shown:
        figure.text(0.5, 0.5, "no correlations:\ntoo few draws, or nothing varies", ha="center", va="center")
        return figure
    panels = figure.subplots(1, len(shown), squeeze=False, sharey=True)[0]
    for axis, name in zip(panels, shown, strict=True):
        own = [line for line in found if line.output == name]
        for place, line in enumerate(own):
            apart = line.low > 0 or line.high < 0
            axis.plot([line.low, line.high], [place, place], color=_ACCEPTED if apart else _PRIOR, lw=2.5)
            axis.plot(line.correlation, place, "o" if apart else "s", color=_ACCEPTED if apart else _PRIOR, ms=6,
                      mfc=_ACCEPTED if apart else "white")  # fmt: skip
        axis.axvline(0, color="black", lw=0.8)
        axis.set_xlim(-1.05, 1.05)
        axis.set_xticks([-1, -0.5, 0, 0.5, 1], ["−1", "−½", "0", "½", "1"])
        axis.set_title(_wrapped(spec.output(name).title), fontsize=9)
        axis.set_yticks(range(len(own)), [line.parameter.replace("_", " ") for line in own])
        axis.grid(True, axis="x", alpha=0.3)
    panels[0].invert_yaxis()
    figure.supxlabel("partial rank correlation [1]; bars: 95 %; filled circles: interval without 0", fontsize=9)
    return figure


def draws_figure(spec: CalibrationSpec, draws: Sequence[Draw]) -> Figure:
    """Return every published number against every nuisance: all draws, the accepted ones, the published value."""
    from matplotlib.figure import Figure

    kept = by_fitted(spec, draws).draws
    across = [one for one in spec.nuisances if not isinstance(one.prior, Fixed)]
    down = spec.published
    size = (1.9 * max(len(across), 1) + 1.2, 1.9 * len(down) + 1.0)
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(len(down), max(len(across), 1), squeeze=False, sharex="col", sharey="row")
    for row, published in zip(panels, down, strict=True):
        for axis, nuisance in zip(row, across, strict=False):
            _panel(axis, draws, kept, published.output, nuisance)
            axis.axhline(published.value, color=_PUBLISHED, lw=1.2, ls="--", label="published")
        unit = spec.output(published.output).unit
        row[0].set_ylabel(f"{_wrapped(spec.output(published.output).title)}\n[{unit}], {published.use}", fontsize=8)
    for axis, nuisance in zip(panels[-1], across, strict=False):
        axis.set_xlabel(f"{nuisance.name.replace('_', ' ')} [{nuisance.unit}]", fontsize=8)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return figure


def _panel(axis: Any, draws: Sequence[Draw], kept: Sequence[Draw], output: str, nuisance: Nuisance) -> None:
    for some, colour, mark, size, label in (
        (draws, _PRIOR, "o", 9, f"{len(draws)} draws from the prior"),
        (kept, _ACCEPTED, "^", 26, f"{len(kept)} accepted"),
    ):
        axis.scatter(
            parameter_values(some, nuisance.name), output_values(some, output), s=size, c=colour, marker=mark, lw=0,
            alpha=0.9 if some is kept else 0.6, label=label,
        )  # fmt: skip
    if isinstance(nuisance.prior, LogUniform):
        axis.set_xscale("log")
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter("")
    if not isinstance(nuisance.prior, Fixed):
        axis.set_xlim(nuisance.prior.low, nuisance.prior.high)
    axis.tick_params(labelsize=7)
    axis.grid(True, alpha=0.25)


def _wrapped(title: str) -> str:
    return title.replace(", ", "\n", 1)


def save(figure: Figure, paths: Sequence[Path]) -> None:
    """Write `figure` under every one of `paths` (.png, .pdf), the same bytes every time; raises OSError."""
    for path in paths:
        dates = {"CreationDate": None} if path.suffix == ".pdf" else {}
        figure.savefig(path, dpi=150, metadata=dates)
