"""Maps of readings on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Map:
    """The readings of one drive at one height, on a regular grid.

    Attributes
    ----------
    drive : int
        Number of the drive.
    height : float
        Height, m.
    x : ndarray, shape (columns,)
        Columns, ascending, m.
    y : ndarray, shape (rows,)
        Rows, ascending, m.
    values : ndarray, shape (rows, columns)
        Readings, in the record's unit; NaN where nothing was measured. Complex amplitudes in `Record.phasor_maps`.
    """

    drive: int
    height: float
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    values: NDArray[Any]

    def to_xarray(self) -> Any:
        """The same as an `xarray.DataArray` with the dimensions y and x, m (needs xarray)."""
        import xarray

        coordinates = {
            "x": ("x", self.x, {"units": "m"}),
            "y": ("y", self.y, {"units": "m"}),
            "z": ((), self.height, {"units": "m"}),
            "drive": ((), self.drive),
        }
        return xarray.DataArray(self.values, dims=("y", "x"), coords=coordinates, name="reading")
