"""Recorded scans."""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native, html
from .errors import FieldgapError
from .plane_map import Map

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._native import Array, Medium


#: Most drives in a notebook; `setup.foci` has all.
_MOST_DRIVES = 8


@dataclass(frozen=True)
class Phase:
    """What the phases of readings mean.

    Attributes
    ----------
    reference : str
        ``"drive-sync"``: one unknown constant for the scan; ``"each-drive"``: one for each drive.
    convention : str
        ``"exp(-iwt)"`` or ``"exp(+iwt)"``, as the record's files state them. Arrays are in exp(-iωt) always.
    drift : float
        Standard uncertainty of the reference's drift over the scan, rad.
    """

    reference: str
    convention: str
    drift: float


@dataclass(frozen=True)
class Setup:
    """The set-up of a recorded scan.

    Attributes
    ----------
    name : str
        Name of the scan.
    recorded : datetime
        When it was started.
    unit : str
        Unit of the readings, such as V; the gain from pressure to reading is unknown.
    array : Array
        The array as believed, with frequency and medium.
    layout : str
        Its arrangement in words.
    medium : Medium
        The medium as believed.
    frequency : float
        Drive frequency, Hz.
    simulator : str
        The simulator that the scan is compared with.
    foci : list of (float, float, float) or None
        Focus of each drive, m; None where a drive has none.
    phases : ndarray, shape (drives, elements)
        Phase of each element for each drive, rad.
    phase : Phase or None
        What the phases of the readings mean; None where they have none.
    """

    name: str
    recorded: datetime
    unit: str
    array: Array
    layout: str
    medium: Medium
    frequency: float
    simulator: str
    foci: List[Optional[Tuple[float, float, float]]]
    phases: NDArray[np.float64]
    phase: Optional[Phase] = None


class Record:
    """A recorded scan: its set-up and its readings. `fieldgap.open` reads one, `Record.from_arrays` makes one."""

    def __init__(self, native: _native.Record) -> None:
        self._native = native

    @classmethod
    def open(cls, folder: Union[str, os.PathLike[str]]) -> Record:
        """Reads the scan in a folder: scan.toml and samples.csv.

        Raises
        ------
        FileError
            At the first key, value or row that is wrong.
        """
        return cls(_native.Record.open(os.fspath(folder)))

    @classmethod
    def from_arrays(
        cls,
        array: Array,
        positions: ArrayLike,
        readings: ArrayLike,
        *,
        focus: Optional[ArrayLike] = None,
        phases: Optional[ArrayLike] = None,
        drives: Optional[ArrayLike] = None,
        times: Optional[ArrayLike] = None,
        medium: Optional[Medium] = None,
        frequency: Optional[float] = None,
        simulator: str = "piston",
        unit: str = "V",
        name: str = "from arrays",
        reference: str = "drive-sync",
        convention: str = "exp(-iwt)",
        drift: Optional[float] = None,
    ) -> Record:
        """Makes a record of readings that were taken elsewhere.

        Parameters
        ----------
        array : Array
            The array as believed.
        positions : array_like, shape (N, 3)
            Place of each reading in the array's coordinates, m.
        readings : array_like, shape (N,)
            Magnitudes, zero or above, in any unit in proportion to pressure; or complex amplitudes, whose phases are kept.
        focus : array_like, shape (3,) or (drives, 3), optional
            Focus of each drive, m.
        phases : array_like, shape (N_elements,) or (drives, N_elements), optional
            Phases of each drive instead, rad. Without both, all elements are in phase.
        drives : array_like of int, shape (N,), optional
            Number of each reading's drive from 0; -1 with the array silent. Without it all are 0.
        times : array_like, shape (N,), optional
            Time of each reading, s. Without it one second apart, in the given order; a diagnosis looks for drift in them.
        medium, frequency
            As for `fieldgap.simulate`.
        simulator : str
            The simulator that the readings are compared with.
        unit, name : str
            Unit of the readings and name of the record.
        reference, convention, drift
            What the phases of complex readings mean, as in `Phase`. Without `drift` it is 0.1 rad.
        """
        readings = np.asarray(readings)
        phases_of_readings = None
        if np.iscomplexobj(readings):
            phases_of_readings = np.angle(readings), reference, convention, drift
            readings = np.abs(readings)
        return cls(
            _native.Record.from_arrays(
                array, positions, readings, phases_of_readings, _of_drives(focus), _of_drives(phases), drives, times, medium, frequency, simulator, unit, name
            )
        )

    def write(self, folder: Union[str, os.PathLike[str]]) -> None:
        """Writes the record into a folder, for the commands of fieldgap. A folder that has a scan is an error."""
        self._native.write(os.fspath(folder))

    @property
    def folder(self) -> Optional[Path]:
        """The folder that it was read from."""
        folder = self._native.folder
        return None if folder is None else Path(folder)

    @property
    def setup(self) -> Setup:
        """The set-up."""
        native = self._native
        return Setup(
            name=native.name,
            recorded=_datetime(native.recorded),
            unit=native.unit,
            array=native.array,
            layout=native.layout,
            medium=native.medium,
            frequency=native.frequency,
            simulator=native.simulator,
            foci=native.foci,
            phases=native.phases,
            phase=None if native.phase is None else Phase(*native.phase),
        )

    @property
    def positions(self) -> NDArray[np.float64]:
        """Place of each reading as the robot reported it, m, shape (N, 3)."""
        return self._native.positions

    @property
    def readings(self) -> NDArray[np.float64]:
        """Amplitude of each reading, in the unit `setup.unit`, shape (N,)."""
        return self._native.readings

    @property
    def reading_phases(self) -> NDArray[np.float64]:
        """Phase of each reading, rad, in the convention exp(-iωt); NaN where there is none, shape (N,). `setup.phase` says against what."""
        return self._native.reading_phases

    @property
    def phasors(self) -> NDArray[np.complex128]:
        """Complex amplitude of each reading, in the unit `setup.unit` and the convention exp(-iωt); NaN where a phase was lost, shape (N,).

        A field of `fieldgap.simulate` at the same places is in proportion to it, up to the constant of the reference.

        Raises
        ------
        FieldgapError
            If the record has no phases.
        """
        if self._native.phase is None:
            raise FieldgapError(f"the record {self._native.name!r} has amplitudes and no phases")
        return self.readings * np.exp(1j * self.reading_phases)

    def phasor_maps(self) -> List[Map]:
        """The maps as complex amplitudes, as `maps` and `phasors`: repeats averaged, NaN where no phase is known."""
        phasors = self.phasors
        x, y, z = self.positions.T
        maps = []
        for one in self.maps():
            here = (self.drives == one.drive) & (np.abs(z - one.height) < 1e-4) & ~np.isnan(phasors)
            row, column = (np.abs(line[:, None] - at[here]).argmin(axis=0) for line, at in ((one.y, y), (one.x, x)))
            sums, counts = np.zeros(one.values.shape, dtype=complex), np.zeros(one.values.shape)
            np.add.at(sums, (row, column), phasors[here])
            np.add.at(counts, (row, column), 1)
            values = np.divide(sums, counts, out=np.full(sums.shape, complex(np.nan, np.nan)), where=counts > 0)
            maps.append(Map(one.drive, one.height, one.x, one.y, values))
        return maps

    @property
    def times(self) -> NDArray[np.float64]:
        """Time of each reading on the recorder's clock, s, shape (N,)."""
        return self._native.times

    @property
    def drives(self) -> NDArray[np.int64]:
        """Number of each reading's drive; -1 with the array silent, shape (N,)."""
        return self._native.drives

    @property
    def spreads(self) -> NDArray[np.float64]:
        """Standard deviation of the single readings behind each; NaN where unknown, shape (N,)."""
        return self._native.spreads

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of single readings behind each; 0 where unknown, shape (N,)."""
        return self._native.counts

    @property
    def heights(self) -> NDArray[np.float64]:
        """Heights at which there are driven readings, ascending, m. Heights less than 0.1 mm apart are one."""
        heights = np.sort(np.array([plane[1] for plane in self._native.planes()]))
        return heights[np.concatenate([[True], np.diff(heights) > 1e-4])] if heights.size else heights

    def maps(self) -> List[Map]:
        """The maps, by drive, then height. Planes whose points lie on no grid are left out."""
        return [Map(drive, height, *arrays) for drive, height, arrays, _ in self._native.planes() if arrays is not None]

    def __len__(self) -> int:
        return len(self._native)

    def to_xarray(self, grid: bool = False) -> Any:
        """The readings as an `xarray.Dataset` (needs xarray).

        Parameters
        ----------
        grid : bool
            False: one dimension, ``sample``, with the variables reading, spread, count and, if there are phases, phase, and the coordinates x, y, z, time and drive.
            True: the variable reading on the dimensions ``drive``, ``z``, ``y`` and ``x``, of the planes that have a map; NaN where nothing was
            measured. The planes must have one grid in common.
        """
        import xarray

        setup = self.setup
        attributes = {"name": setup.name, "recorded": setup.recorded.isoformat(), "simulator": setup.simulator}
        of_reading = {"units": setup.unit, "long_name": "magnitude"}
        if grid:
            return self._gridded(of_reading, attributes)
        x, y, z = self.positions.T
        metres = {"units": "m"}
        phases = {}
        if setup.phase is not None:
            meaning = {"units": "rad", "reference": setup.phase.reference, "convention": "exp(-iwt)"}
            phases = {"phase": ("sample", self.reading_phases, meaning)}
        return xarray.Dataset(
            {
                "reading": ("sample", self.readings, of_reading),
                **phases,
                "spread": ("sample", self.spreads, {"units": setup.unit}),
                "count": ("sample", self.counts),
            },
            {
                "x": ("sample", x, metres),
                "y": ("sample", y, metres),
                "z": ("sample", z, metres),
                "time": ("sample", self.times, {"units": "s"}),
                "drive": ("sample", self.drives),
            },
            attributes,
        )

    def _gridded(self, of_reading: dict[str, str], attributes: dict[str, str]) -> Any:
        import xarray

        maps = self.maps()
        if not maps:
            raise FieldgapError("no plane of the record lies on a regular grid")
        x, y = maps[0].x, maps[0].y
        for other in maps[1:]:
            # A robot's error: lines less than 0.1 mm apart are one.
            alike = [a.shape == b.shape and np.abs(a - b).max() < 1e-4 for a, b in ((x, other.x), (y, other.y))]
            if not all(alike):
                raise FieldgapError("the planes of the record have different grids; use maps(), one by one")
        heights, drives = self.heights, sorted({one.drive for one in maps})
        values = np.full((len(drives), len(heights), len(y), len(x)), np.nan)
        for one in maps:
            values[drives.index(one.drive), np.abs(heights - one.height).argmin()] = one.values
        metres = {"units": "m"}
        return xarray.Dataset(
            {"reading": (("drive", "z", "y", "x"), values, of_reading)},
            {"drive": drives, "z": ("z", heights, metres), "y": ("y", y, metres), "x": ("x", x, metres)},
            attributes,
        )

    def __repr__(self) -> str:
        return f"<Record {self._native.name!r}: {len(self)} readings>"

    def _repr_html_(self) -> str:
        setup = self.setup
        foci = [
            "no focus" if focus is None else "({:.1f}, {:.1f}, {:.1f}) mm".format(*(1e3 * along for along in focus))
            for focus in setup.foci
        ]
        shown = foci[:_MOST_DRIVES] + [f"and {len(foci) - _MOST_DRIVES} more"] * (len(foci) > _MOST_DRIVES)
        rows = [
            ("recorded", setup.recorded.isoformat()),
            ("array", f"{setup.layout}, {len(setup.array)} elements"),
            ("frequency", f"{setup.frequency / 1e3:g} kHz"),
            ("speed of sound", f"{setup.medium.speed_of_sound:.1f} m/s"),
            ("simulator", setup.simulator),
            ("drives", "; ".join(shown)),
            ("heights", ", ".join(f"{1e3 * height:.1f}" for height in self.heights) + " mm"),
            ("readings", f"{len(self)} in {setup.unit}, of these {int((self.drives < 0).sum())} with the array silent"),
        ]
        return f"<b>{escape(setup.name)}</b>" + html.table([], rows)


def open(folder: Union[str, os.PathLike[str]]) -> Record:
    """Reads a recorded scan: a folder with scan.toml and samples.csv, such as ``out/thesis-focus``.

    Raises
    ------
    FileError
        At the first key, value or row that is wrong.
    """
    return Record.open(folder)


def as_record(record: Union[Record, str, os.PathLike[str]]) -> Record:
    """A record, or the record in a folder."""
    return record if isinstance(record, Record) else Record.open(record)


def as_records(
    records: Union[Record, str, os.PathLike[str], Sequence[Union[Record, str, os.PathLike[str]]]],
) -> List[Record]:
    """One record or several."""
    if isinstance(records, (Record, str, os.PathLike)):
        return [as_record(records)]
    return [as_record(record) for record in records]


def _of_drives(numbers: Optional[ArrayLike]) -> Optional[NDArray[np.float64]]:
    """Numbers of one drive, or of several, as one row each."""
    return None if numbers is None else np.atleast_2d(np.asarray(numbers, dtype=float))


def _datetime(text: str) -> datetime:
    # Python 3.9 reads neither the zone Z nor nine decimals of a second.
    seconds, _, decimals = text.rstrip("Z").partition(".")
    return datetime.fromisoformat(f"{seconds}.{(decimals + '000000')[:6]}+00:00")
