"""Comparisons of a recorded scan with its simulation."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple, Union

import numpy as np

from . import _native, html, picture
from .record import Record, as_record
from .uncertain import Uncertain, if_known, number, uncertain

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Figures:
    """Figures of the field at one height.

    Attributes
    ----------
    peak : Uncertain
        The largest value, refined below the step, in the record's unit.
    peak_position : (Uncertain, Uncertain)
        Its place (x, y), m.
    peak_at_edge : bool
        Whether it lies on the map's edge, so that the true peak may be outside.
    focal_radius : Uncertain or None
        Mean half-width at half the peak, m; None without a map, or where the map's edge cuts it off.
    sub_peaks : int or None
        Local maxima above half the peak besides the peak; None without a map.
    """

    peak: Uncertain
    peak_position: Tuple[Uncertain, Uncertain]
    peak_at_edge: bool
    focal_radius: Optional[Uncertain]
    sub_peaks: Optional[int]


@dataclass(frozen=True)
class Discrepancy:
    """Scan against simulation at one height.

    Attributes
    ----------
    peak_ratio : Uncertain
        Peak of the scan over peak of the simulation.
    peak_shift : (Uncertain, Uncertain)
        From the simulated peak to the scanned one (x, y), m.
    peak_distance : Uncertain
        Length of that shift, m.
    focal_radius : Uncertain or None
        Focal radius of the scan less that of the simulation, m.
    sub_peaks : int or None
        Number of sub-peaks of the scan less that of the simulation.
    """

    peak_ratio: Uncertain
    peak_shift: Tuple[Uncertain, Uncertain]
    peak_distance: Uncertain
    focal_radius: Optional[Uncertain]
    sub_peaks: Optional[int]


@dataclass(frozen=True)
class Agreement:
    """How well simulation and scan agree.

    Attributes
    ----------
    correlation : float
        Pearson's correlation, -1 to 1.
    residual_rms_ratio : float
        Root mean square of the residual over that of the scan, at the gain of the registration.
    residual_rms_ratio_own_gain : float
        The same at the best gain for these points.
    gain_ratio : float
        This gain over that of the registration.
    points : int
        Number of readings.
    """

    correlation: float
    residual_rms_ratio: float
    residual_rms_ratio_own_gain: float
    gain_ratio: float
    points: int


@dataclass(frozen=True)
class ComparedMap:
    """Scan and simulation on one grid, in the scan's coordinates and unit.

    Attributes
    ----------
    x : ndarray, shape (columns,)
        Columns, ascending, m.
    y : ndarray, shape (rows,)
        Rows, ascending, m.
    scan : ndarray, shape (rows, columns)
        Readings; NaN where nothing was measured.
    simulation : ndarray, shape (rows, columns)
        The simulation at the same points, times the gain.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    scan: NDArray[np.float64]
    simulation: NDArray[np.float64]

    @property
    def difference(self) -> NDArray[np.float64]:
        """Scan less simulation, shape (rows, columns)."""
        return self.scan - self.simulation


@dataclass(frozen=True)
class Levels:
    """Absolute levels at one height, where the sensitivity of the receiver is known; dB re 20 µPa rms.

    Attributes
    ----------
    pa_per_reading : float
        Pascals rms per unit of a reading at this height: times a map of scan or simulation it is the sound pressure.
    scan_pa, simulation_pa : float
        The peaks, Pa rms.
    scan_db, simulation_db : float
        Their levels, dB.
    expanded_db : float
        Expanded uncertainty (k = 2) of the level of the scan's peak, dB.
    gap_db : Uncertain
        Level of the scan's peak over that of the simulation, dB; it does not depend on the sensitivity.
    budget : dict
        The uncertainty budget, as the JSON has it.
    """

    pa_per_reading: float
    scan_pa: float
    scan_db: float
    simulation_pa: float
    simulation_db: float
    expanded_db: float
    gap_db: Uncertain
    budget: Dict[str, Any]


@dataclass(frozen=True)
class PlaneComparison:
    """Scan and simulation at one height, for one drive.

    Attributes
    ----------
    drive : int
        Number of the drive.
    height : float
        Height in the scan's coordinates, m.
    scan, simulation : Figures
        Figures of the two fields, by the same rules from the same points.
    discrepancy : Discrepancy
        How they differ.
    agreement : Agreement
        Agreement over this plane's readings.
    map : ComparedMap or None
        The two maps, where the points lie on a grid.
    why_no_map : str or None
        Why there is none.
    levels : Levels or None
        Absolute levels, where the sensitivity of the receiver is known.
    """

    drive: int
    height: float
    scan: Figures
    simulation: Figures
    discrepancy: Discrepancy
    agreement: Agreement
    map: Optional[ComparedMap]
    why_no_map: Optional[str]
    levels: Optional[Levels] = None


class Comparison:
    """A recorded scan compared with its simulation; `fieldgap.compare` makes one."""

    def __init__(self, native: _native.Comparison) -> None:
        self._native = native

    @cached_property
    def _json(self) -> Any:
        return json.loads(self._native.to_json())

    def to_dict(self) -> Dict[str, Any]:
        """Everything, as ``fieldgap compare --json`` prints it for this simulator; lengths in metres."""
        everything: Dict[str, Any] = json.loads(self._native.to_json())
        return everything

    @property
    def scan_name(self) -> str:
        """Name of the scan."""
        return self._json["scan_name"]

    @property
    def unit(self) -> str:
        """Unit of the readings."""
        return self._json["reading_unit"]

    @property
    def simulator(self) -> str:
        """The simulator."""
        return self._json["simulator"]

    @property
    def registration(self) -> Dict[str, Any]:
        """How the scan was brought to the simulation's coordinates and unit, as the JSON has it."""
        return self._json["registration"]

    @property
    def gain(self) -> Uncertain:
        """Reading per unit of the simulation."""
        return uncertain(self._json["registration"]["gain"])

    @property
    def agreement(self) -> Agreement:
        """Agreement over all readings."""
        return _agreement(self._json["overall"])

    @cached_property
    def planes(self) -> List[PlaneComparison]:
        """One entry for each drive and height, by drive, then height."""
        maps = self._native.maps()
        levels = self._json.get("levels")
        return [_plane(plane, arrays, _levels(levels, plane)) for plane, arrays in zip(self._json["planes"], maps)]

    def table(self) -> List[Dict[str, Any]]:
        """One row for each drive and height; lengths in metres, readings in the record's unit, ``_se`` standard errors, NaN where absent.

        Where levels are known, also the peaks in ``_pa`` (rms) and ``_db`` (re 20 µPa), with ``scan_peak_expanded_db`` (k = 2).
        """
        return [_row(plane) for plane in self.planes]

    def to_pandas(self) -> Any:
        """The table as a `pandas.DataFrame` (needs pandas)."""
        import pandas

        return pandas.DataFrame(self.table())

    def plot(self) -> Any:
        """Scan, simulation and difference at each height, as a matplotlib figure (needs matplotlib)."""
        return picture.of_comparison(self, interactive=True)

    def __str__(self) -> str:
        return self._native.to_text()

    def __repr__(self) -> str:
        ratio = self.agreement.residual_rms_ratio
        return f"<Comparison of {self.scan_name!r} with {self.simulator!r}: {len(self.planes)} planes, residual {ratio:.1%} of the scan>"

    def _repr_html_(self) -> str:
        headings = ["drive", "z (mm)", f"peak ({self.unit})", "simulated", "peak distance (mm)", "focal radius (mm)", "simulated (mm)"]
        headings += ["sub-peaks", "simulated", "correlation", "residual"]
        rows = [
            [
                plane.drive,
                f"{1e3 * plane.height:.1f}",
                plane.scan.peak,
                plane.simulation.peak,
                plane.discrepancy.peak_distance.shown(1e3),
                _shown(plane.scan.focal_radius),
                _shown(plane.simulation.focal_radius),
                _count(plane.scan.sub_peaks),
                _count(plane.simulation.sub_peaks),
                f"{plane.agreement.correlation:.3f}",
                f"{plane.agreement.residual_rms_ratio:.1%}",
            ]
            for plane in self.planes
        ]
        title = f"<b>{escape(self.scan_name)}</b> compared with <b>{escape(self.simulator)}</b>"
        why = f"<p>{escape(str(self.registration['why']))}</p>"
        return title + html.table(headings, rows) + why + html.image(picture.png(self), "scan, simulation and difference at each height")


def compare(
    record: Union[Record, str, os.PathLike[str]],
    *,
    simulator: Optional[str] = None,
    register: str = "auto",
    amplitude_only: bool = False,
    threads: Optional[int] = None,
) -> Comparison:
    """Registers a recorded scan to a simulation of its set-up and compares the two, height by height.

    Parameters
    ----------
    record : Record or path
        The scan.
    simulator : str, optional
        As-written, corrected, piston, gaussian, multi-gaussian, rayleigh or transducer; without it that of the scan.
    register : str
        How the scan is aligned: ``"auto"``, ``"pose"``, ``"shift"``, ``"gain-and-shift"``, ``"gain"`` or ``"none"``.
    amplitude_only : bool
        Aligns by the amplitudes alone, also where readings have a phase.
    threads : int, optional
        Number of threads; without it all cores.

    Raises
    ------
    IncomparableError
        If there is nothing to compare.

    Notes
    -----
    The interpreter's lock is released. Ctrl-C ends the call at once; the work that was begun ends in the background.
    """
    return Comparison(_native.compare(as_record(record)._native, simulator, register, threads, amplitude_only))


def _agreement(of_json: Dict[str, Any]) -> Agreement:
    return Agreement(
        number(of_json["correlation"]),
        number(of_json["residual_rms_ratio"]),
        number(of_json["residual_rms_ratio_own_gain"]),
        number(of_json["gain_ratio"]),
        of_json["points"],
    )


def _figures(of_json: Dict[str, Any]) -> Figures:
    radius = of_json["focal_radius"]
    x, y = of_json["peak_position_m"]
    return Figures(
        uncertain(of_json["peak"]),
        (uncertain(x), uncertain(y)),
        of_json["peak_at_edge"],
        None if radius is None else if_known(radius["radius_m"]),
        of_json["sub_peaks"],
    )


def _levels(of_comparison: Optional[Dict[str, Any]], plane: Dict[str, Any]) -> Optional[Levels]:
    """The levels of a plane."""
    if of_comparison is None:
        return None
    here = [one for one in of_comparison["planes"] if (one["focus"], one["z_m"]) == (plane["focus"], plane["z_m"])]
    if not here:
        return None
    (found,) = here
    return Levels(
        of_comparison["rms_pa_per_reading"] * 10 ** (found["reception_db"] / 20),
        found["scan"]["rms_pa"],
        found["scan"]["level_db"],
        found["simulation"]["rms_pa"],
        found["simulation"]["level_db"],
        found["expanded_db"],
        uncertain(found["gap_db"]),
        found["budget"],
    )


def _plane(of_json: Dict[str, Any], arrays: Optional[Tuple[Any, ...]], levels: Optional[Levels]) -> PlaneComparison:
    discrepancy = of_json["discrepancy"]
    x, y = discrepancy["peak_shift_m"]
    return PlaneComparison(
        of_json["focus"],
        of_json["z_m"],
        _figures(of_json["scan"]),
        _figures(of_json["simulation"]),
        Discrepancy(
            uncertain(discrepancy["peak_ratio"]),
            (uncertain(x), uncertain(y)),
            uncertain(discrepancy["peak_distance_m"]),
            if_known(discrepancy["focal_radius_m"]),
            discrepancy["sub_peaks"],
        ),
        _agreement(of_json["agreement"]),
        None if arrays is None else ComparedMap(*arrays),
        of_json["why_no_map"],
        levels,
    )


def _row(plane: PlaneComparison) -> Dict[str, Any]:
    row: Dict[str, Any] = {"drive": plane.drive, "height": plane.height}

    def add(name: str, value: Optional[Uncertain]) -> None:
        row[name] = np.nan if value is None else value.value
        row[f"{name}_se"] = np.nan if value is None else value.standard_error

    for name, figures in (("scan", plane.scan), ("simulation", plane.simulation)):
        add(f"{name}_peak", figures.peak)
        add(f"{name}_peak_x", figures.peak_position[0])
        add(f"{name}_peak_y", figures.peak_position[1])
        add(f"{name}_focal_radius", figures.focal_radius)
        row[f"{name}_sub_peaks"] = np.nan if figures.sub_peaks is None else figures.sub_peaks
    add("peak_ratio", plane.discrepancy.peak_ratio)
    add("peak_distance", plane.discrepancy.peak_distance)
    add("focal_radius_difference", plane.discrepancy.focal_radius)
    row["correlation"] = plane.agreement.correlation
    row["residual_rms_ratio"] = plane.agreement.residual_rms_ratio
    row["gain_ratio"] = plane.agreement.gain_ratio
    row["points"] = plane.agreement.points
    if plane.levels is not None:
        row["scan_peak_pa"], row["scan_peak_db"] = plane.levels.scan_pa, plane.levels.scan_db
        row["scan_peak_expanded_db"] = plane.levels.expanded_db
        row["simulation_peak_pa"], row["simulation_peak_db"] = plane.levels.simulation_pa, plane.levels.simulation_db
    return row


def _shown(radius: Optional[Uncertain]) -> str:
    return "\N{EN DASH}" if radius is None else radius.shown(1e3)


def _count(count: Optional[int]) -> str:
    return "\N{EN DASH}" if count is None else str(count)
