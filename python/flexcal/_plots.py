"""Plots of parameters, for those who have matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

MAX_LABELLED = 60
"""Number of parameters up to which each one has its name at the axes of a plot."""


def correlation(table: pd.DataFrame, axes: Axes | None) -> Axes:
    """Correlations of the estimates as a map of colours, without parameters that have none."""
    known = table.notna().any().to_numpy()
    table = table.loc[known, known]
    size = min(12.0, 3.0 + 0.22 * len(table))
    axes = _axes(axes, (size, size))
    image = axes.imshow(table.to_numpy(), cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    if len(table) <= MAX_LABELLED:
        ticks = range(len(table))
        axes.set_xticks(ticks, [str(name) for name in table.columns], rotation=90, fontsize=7)
        axes.set_yticks(ticks, [str(name) for name in table.index], fontsize=7)
    axes.set_title("Correlation of the estimates")
    axes.figure.colorbar(image, ax=axes, shrink=0.8, label="correlation")
    return axes


def forest(parameters: pd.DataFrame, priors: list[tuple[str, float | None, bool]], axes: Axes | None) -> Axes:
    """Changes of the parameters in units of their prior σ, with their 95 % intervals; those that have a prior and a standard error.

    ``priors`` holds name, 1 σ, and whether it is that of ln(value / nominal).
    """
    rows = []
    for name, sigma, relative in priors:
        nominal, estimate, error = (float(parameters[column][name]) for column in ("nominal", "estimate", "std_error"))
        if sigma is None or not np.isfinite(error):
            continue
        change, error = (np.log(estimate / nominal), error / estimate) if relative else (estimate - nominal, error)
        rows.append((name, change / sigma, 1.96 * error / sigma))
    names, changes, bars = zip(*rows, strict=True) if rows else ((), (), ())
    places = np.arange(len(rows))[::-1]
    axes = _axes(axes, (7.0, 1.5 + 0.2 * len(rows)))
    axes.axvspan(-1.96, 1.96, color="0.92", zorder=0)
    axes.axvline(0.0, color="0.6", linewidth=0.8)
    axes.errorbar(changes, places, xerr=bars, fmt="o", markersize=3.5, linewidth=1.2, color="tab:blue")
    axes.set_yticks(places, names, fontsize=7)
    axes.set_xlabel("change / 1 σ of the prior, 95 % intervals (grey: 95 % of the prior)")
    axes.set_title("Estimates beside their priors")
    return axes


def _axes(axes: Axes | None, size: tuple[float, float]) -> Axes:
    if axes is not None:
        return axes
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("plots need matplotlib: pip install matplotlib, or flexcal[plots] with its dependency") from error
    return pyplot.subplots(figsize=size, layout="constrained")[1]
