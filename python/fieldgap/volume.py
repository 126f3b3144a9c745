"""Fields over a volume: a grid of x, y and z."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, Optional, Sequence, Tuple, Union

import numpy as np

from .errors import ArgumentError
from .field import simulate

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._native import Array, Medium, Transducer

#: Most points of a volume: its field takes 1.6 GB.
_MOST_POINTS = 100_000_000


@dataclass(frozen=True)
class Volume:
    """The complex field of an array on a regular grid of x, y and z.

    Attributes
    ----------
    x : ndarray, shape (columns,)
        Columns, ascending, m.
    y : ndarray, shape (rows,)
        Rows, ascending, m.
    z : ndarray, shape (planes,)
        Heights, ascending, m.
    field : ndarray of complex128, shape (planes, rows, columns)
        The field as a peak amplitude, as `simulate` gives it.
    unit : str
        Unit of the field: Pa where the drive was given, in pascals at 1 m; else empty, as the amplitudes of the elements have none.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    field: NDArray[np.complex128]
    unit: str = ""

    @property
    def magnitude(self) -> NDArray[np.float64]:
        """The root mean square of the field, shape (planes, rows, columns)."""
        return np.asarray(np.abs(self.field) / np.sqrt(2.0))

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` with the dimensions z, y and x, m, and the variables field and magnitude (needs xarray)."""
        import xarray

        unit = {"units": self.unit} if self.unit else {}
        of_field = {"long_name": "complex peak amplitude, exp(-i w t)", **unit}
        of_magnitude = {"long_name": "root mean square", **unit}
        dimensions = ("z", "y", "x")
        return xarray.Dataset(
            {"field": (dimensions, self.field, of_field), "magnitude": (dimensions, self.magnitude, of_magnitude)},
            {
                "z": ("z", self.z, {"units": "m", "long_name": "height above the array"}),
                "y": ("y", self.y, {"units": "m"}),
                "x": ("x", self.x, {"units": "m"}),
            },
        )


def simulate_volume(
    array: Array,
    *,
    z: Tuple[float, float],
    size: Union[float, Tuple[float, float]] = 0.1,
    step: float = 1e-3,
    centre: Tuple[float, float] = (0.0, 0.0),
    focus: Optional[Sequence[float]] = None,
    drive: Optional[ArrayLike] = None,
    medium: Optional[Medium] = None,
    frequency: Optional[float] = None,
    transducer: Union[str, Transducer] = "piston",
    attenuation: float = 0.0,
    method: str = "auto",
    threads: Optional[int] = None,
) -> Volume:
    """The complex field of an array on a grid of x, y and z, plane by plane.

    Parameters
    ----------
    array : Array
        The array.
    z : (float, float)
        Heights of the lowest and the highest plane, m; the distance is rounded down to whole steps.
    size : float or (float, float)
        Side of the planes, or their sides along x and y, m; rounded to whole steps.
    step : float
        Distance of neighbouring points along each axis, m.
    centre : (float, float)
        Centre of the planes (x, y), m.
    focus, drive, medium, frequency, transducer, attenuation, method, threads
        As for `simulate`.

    Returns
    -------
    Volume
        The field with its coordinates; `Volume.to_xarray` names them.

    Raises
    ------
    ArgumentError
        Where a number is out of range, or the volume has more than 1e8 points.
    """
    along_x, along_y = np.broadcast_to(np.asarray(size, dtype=float), (2,))
    low, high = (float(height) for height in z)
    if not (step > 0.0 and np.isfinite([low, high, step, along_x, along_y, *centre]).all()):
        raise ArgumentError("z, size, step and centre must be finite, and step above zero, in metres")
    if low > high or min(along_x, along_y) < 0.0:
        raise ArgumentError("z is (lowest, highest), and size is not negative, in metres")
    planes = int(np.floor((high - low) / step + 1e-9)) + 1
    columns, rows = (int(round(side / step)) + 1 for side in (along_x, along_y))
    if planes * rows * columns > _MOST_POINTS:
        raise ArgumentError(f"the volume would have {planes} x {rows} x {columns} points; at most 1e8 are possible")
    x, y = (
        np.asarray(middle + step * (np.arange(count) - 0.5 * (count - 1)), dtype=np.float64)
        for middle, count in zip(centre, (columns, rows))
    )
    heights = np.asarray(low + step * np.arange(planes), dtype=np.float64)
    points = np.empty((rows, columns, 3))
    points[..., 0], points[..., 1] = x, y[:, np.newaxis]
    field = np.empty((planes, rows, columns), dtype=np.complex128)
    common: Dict[str, Any] = {
        "focus": focus,
        "drive": drive,
        "medium": medium,
        "frequency": frequency,
        "transducer": transducer,
        "attenuation": attenuation,
        "method": method,
        "threads": threads,
    }
    for plane, height in enumerate(heights):
        points[..., 2] = height
        field[plane] = simulate(array, points, **common)
    return Volume(x, y, heights, field, "" if drive is None else "Pa")
