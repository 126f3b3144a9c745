"""Pictures of comparisons and diagnoses, by matplotlib where it is installed."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING, Any, List, Optional, Sequence, Tuple, Union

import numpy as np

if TYPE_CHECKING:
    from .comparison import Comparison
    from .diagnosis import Diagnosis

#: Most rows of a picture in a notebook; plot() shows all planes.
_MOST_ROWS = 8

#: One panel: its title, its values, and its unit where it has a scale of its own about zero.
_Panel = Tuple[str, Any, Optional[str]]

#: One row of panels: its name, columns and rows of its maps in metres, and the panels.
_Row = Tuple[str, Any, Any, Sequence[_Panel]]


def of_comparison(comparison: Comparison, interactive: bool) -> Any:
    """Scan, simulation and difference of each plane."""
    rows: List[_Row] = []
    for plane in comparison.planes:
        if plane.map is None:
            continue
        name = f"drive {plane.drive}, z = {1e3 * plane.height:.1f} mm"
        panels = [("scan", plane.map.scan, None), (comparison.simulator, plane.map.simulation, None)]
        rows.append((name, plane.map.x, plane.map.y, [*panels, ("scan - simulation", plane.map.difference, comparison.unit)]))
    return _figure(rows, comparison.unit, interactive)


def of_diagnosis(diagnosis: Diagnosis, interactive: bool) -> Any:
    """Scan and residuals before and after of each plane."""
    unit = diagnosis.to_dict()["reading_unit"]
    rows: List[_Row] = []
    for plane in diagnosis.maps:
        name = f"scan {plane.scan}, drive {plane.drive}, z = {1e3 * plane.height:.1f} mm"
        panels = [
            ("scan", plane.measured, None),
            ("residual as believed", plane.residual_before, "standard deviations"),
            ("residual with the best candidate", plane.residual_after, "standard deviations"),
        ]
        rows.append((name, plane.x, plane.y, panels))
    return _figure(rows, unit, interactive)


def png(result: Union[Comparison, Diagnosis]) -> Optional[str]:
    """The picture of a result as PNG in base 64; None without matplotlib or without maps."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        return None
    from .comparison import Comparison

    if isinstance(result, Comparison):
        figure = of_comparison(result, interactive=False)
    else:
        figure = of_diagnosis(result, interactive=False)
    if not figure.axes:
        return None
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=80)
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def _figure(rows: List[_Row], unit: str, interactive: bool) -> Any:
    if not interactive:
        rows = rows[:_MOST_ROWS]
    size = (10.5, 3.1 * max(1, len(rows)))
    if interactive:
        from matplotlib import pyplot

        figure = pyplot.figure(figsize=size, layout="constrained")
    else:
        from matplotlib.figure import Figure

        figure = Figure(figsize=size, layout="constrained")
    if not rows:
        return figure
    axes = figure.subplots(len(rows), 3, squeeze=False, sharex=False, sharey=False)
    for of_row, (name, x, y, panels) in zip(axes, rows):
        top = max(np.nanmax(values) for _, values, own in panels if own is None)
        for axis, (title, values, own) in zip(of_row, panels):
            if own is None:
                colours = {"cmap": "viridis", "vmin": 0.0, "vmax": top}
            else:
                largest = max(np.nanmax(np.abs(other)) for _, other, unit_of in panels if unit_of == own) or 1.0
                colours = {"cmap": "RdBu_r", "vmin": -largest, "vmax": largest}
            image = axis.imshow(values, origin="lower", extent=_extent(x, y), interpolation="nearest", **colours)
            axis.set_title(title if axis is not of_row[0] else f"{name}\n{title}", fontsize=9)
            axis.set_xlabel("x (mm)")
            axis.set_ylabel("y (mm)")
            figure.colorbar(image, ax=axis, label=_plain(own or unit))
    return figure


def _plain(text: str) -> str:
    """A text from a file, of which matplotlib reads nothing as a formula."""
    return text.replace("$", r"\$")


def _extent(x: Any, y: Any) -> Tuple[float, float, float, float]:
    """Edges of the picture in millimetres: half a step beyond the outer points."""
    half_x, half_y = 0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0])
    return tuple(1e3 * edge for edge in (x[0] - half_x, x[-1] + half_x, y[0] - half_y, y[-1] + half_y))
