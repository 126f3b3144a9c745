"""Fields at points: grids of points, and the field of an array there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native
from .errors import ArgumentError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._native import Array, Medium, Transducer

#: Most points of a plane: their coordinates take 2.4 GB.
_MOST_POINTS = 100_000_000


def plane(
    z: float,
    *,
    size: Union[float, Tuple[float, float]] = 0.1,
    step: float = 0.5e-3,
    centre: Tuple[float, float] = (0.0, 0.0),
) -> NDArray[np.float64]:
    """The points of a square or rectangular grid parallel to the array.

    Parameters
    ----------
    z : float
        Height above the array, m.
    size : float or (float, float)
        Side of the square, or the sides along x and y, m. Rounded to whole steps.
    step : float
        Distance of neighbouring points, m.
    centre : (float, float)
        Centre of the grid (x, y), m.

    Returns
    -------
    ndarray, shape (rows, columns, 3)
        x, y and z of each point, m; rows run along y, columns along x.
    """
    along_x, along_y = np.broadcast_to(np.asarray(size, dtype=float), (2,))
    if not (step > 0.0 and np.isfinite([z, step, along_x, along_y, *centre]).all()):
        raise ArgumentError("z, size, step and centre must be finite, and step above zero, in metres")
    counts = [int(round(side / step)) + 1 for side in (along_x, along_y)]
    if min(counts) < 1 or counts[0] * counts[1] > _MOST_POINTS:
        raise ArgumentError(f"the plane would have {counts[0]} x {counts[1]} points; at least one and at most 1e8 are possible")
    x, y = (
        middle + step * (np.arange(count) - 0.5 * (count - 1)) for middle, count in zip(centre, counts)
    )
    points = np.empty((y.size, x.size, 3))
    points[..., 0], points[..., 1], points[..., 2] = x, y[:, np.newaxis], z
    return points


def simulate(
    array: Array,
    points: ArrayLike,
    *,
    focus: Optional[Sequence[float]] = None,
    drive: Optional[ArrayLike] = None,
    medium: Optional[Medium] = None,
    frequency: Optional[float] = None,
    transducer: Union[str, Transducer] = "piston",
    attenuation: float = 0.0,
    method: str = "auto",
    threads: Optional[int] = None,
) -> NDArray[np.complex128]:
    """The complex field of an array.

    The field of an element with amplitude w and phase p, at the distance d and the angle t from its axis, is
    ``w * D(t) / d * exp(1j * (k * d + p))`` with the directivity D; elements add up. With amplitudes in pascals at 1 m (``drive``)
    the field is in pascals. Behind its face an element radiates nothing.

    Parameters
    ----------
    array : Array
        The array.
    points : array_like, shape (..., 3)
        Where to compute the field: x, y and z, m. Arrays of float64 in C order are read in place; others are converted once.
    focus : (float, float, float), optional
        Focus, m: every element is delayed so that all waves arrive there together.
    drive : array_like of complex, shape (N,), optional
        Amplitude and phase of each element, instead of a focus. Without both, all elements are driven alike.
    medium : Medium, optional
        Without it that of the array's file, else air of 20 degrees Celsius, 50 % humidity and 101325 Pa.
    frequency : float, optional
        Drive frequency, Hz, 1e3 to 1e7. Without it that of the array's file, else 40e3.
    transducer : str or Transducer
        ``"monopole"``, ``"piston"``, ``"multi-gaussian"``, ``"rayleigh"``, ``"gaussian"``; the thesis's simulators ``"as-written"`` and
        ``"corrected"``; ``"transducer"``, the transducer of the array's file; or a `Transducer`.
    attenuation : float
        Attenuation of the amplitude in air, Np/m; see `Medium.attenuation`.
    method : str
        ``"auto"`` computes a regular grid of a plane (such as `plane` gives) by its structure, with an error of at most 1e-9 of the sum of the
        elements' magnitudes; ``"direct"`` sums every point.
    threads : int, optional
        Number of threads; without it all cores, or as the environment variable ``RAYON_NUM_THREADS`` says.

    Returns
    -------
    ndarray of complex128, shape points.shape[:-1]
        The field as a peak amplitude: the root mean square is ``abs(field) / sqrt(2)``. The time convention is exp(-i w t).

    Notes
    -----
    The interpreter's lock is released. Ctrl-C ends the call within about 0.1 s.
    """
    return _native.simulate(
        array,
        points,
        focus=None if focus is None else _triple("focus", focus),
        drive=None if drive is None else _weights(drive),
        medium=medium,
        frequency=frequency,
        transducer=transducer,
        attenuation=attenuation,
        method=method,
        threads=threads,
    )


def _triple(name: str, numbers: Sequence[float]) -> Tuple[float, float, float]:
    values = tuple(float(number) for number in numbers)
    if len(values) != 3:
        raise ArgumentError(f"{name} has {len(values)} numbers; x, y and z are needed, in metres")
    return values


def _weights(drive: ArrayLike) -> NDArray[np.complex128]:
    weights = np.asarray(drive, dtype=np.complex128)
    if weights.ndim != 1:
        raise ArgumentError(f"drive has the shape {weights.shape}; one complex number for each element is needed")
    return weights
