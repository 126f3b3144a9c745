"""The native half of fieldgap."""

import os
from typing import List, Optional, Sequence, Tuple, Union, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Path = Union[str, os.PathLike[str]]
_Numbers = NDArray[np.float64]

@final
class Medium:
    """The medium that the sound travels through.

    Give either the state of the air or the speed of sound. The speed of sound in air follows Cramer (J. Acoust. Soc. Am. 93, 2510, 1993).

    Parameters
    ----------
    temperature_c : float
        Temperature, degrees Celsius, -20 to 50.
    humidity : float
        Relative humidity as a fraction, 0 to 1; without it 0.5.
    pressure : float
        Static pressure, Pa, 60e3 to 110e3; without it 101325.
    speed_of_sound : float
        Speed of sound, m/s, 100 to 2000.
    """

    def __new__(
        cls,
        *,
        temperature_c: Optional[float] = None,
        humidity: Optional[float] = None,
        pressure: Optional[float] = None,
        speed_of_sound: Optional[float] = None,
    ) -> Medium: ...
    @property
    def speed_of_sound(self) -> float:
        """Speed of sound, m/s."""
    @property
    def temperature_c(self) -> Optional[float]:
        """Temperature, degrees Celsius; None for a medium given by its speed of sound."""
    @property
    def humidity(self) -> Optional[float]:
        """Relative humidity as a fraction, 0 to 1; None for a medium given by its speed of sound."""
    @property
    def pressure(self) -> Optional[float]:
        """Static pressure, Pa; None for a medium given by its speed of sound."""
    def wavelength(self, frequency: float = 40e3) -> float:
        """Wavelength at a frequency in Hz, m."""
    def attenuation(self, frequency: float = 40e3) -> float:
        """Attenuation of the amplitude in the air at a frequency in Hz, Np/m, by ISO 9613-1; for `attenuation` of `simulate`."""

@final
class Transducer:
    """A model of one transducer: its decay on the axis times its directivity.

    Make one by the constructors below. On the axis the amplitude falls as distance**-exponent, 1 being spherical. An amplitude of 1 is then
    1 Pa at 1 m on the axis, if the drive is in pascals at 1 m.
    """

    @staticmethod
    def monopole(*, exponent: float = 1.0) -> Transducer:
        """A point source: the same amplitude in all directions of the half-space in front."""
    @staticmethod
    def piston(*, exponent: float = 1.0) -> Transducer:
        """The far field of a vibrating disc, 2 J1(ka sin t)/(ka sin t), with the face radius of each element."""
    @staticmethod
    def multi_gaussian(*, exponent: float = 1.0) -> Transducer:
        """The same as a sum of ten Gaussians."""
    @staticmethod
    def rayleigh() -> Transducer:
        """The integral over a vibrating disc, to 1e-4 from two face radii on; about fifty times slower than the others."""
    @staticmethod
    def gaussian(width: float, *, centre: float = 0.0, exponent: float = 1.0) -> Transducer:
        """A Gaussian lobe exp(-((t - centre)/width)**2) in the angle t from the axis; `width` and `centre` in radians."""
    @staticmethod
    def table(angles: ArrayLike, pressures: ArrayLike, *, exponent: float = 1.0) -> Transducer:
        """A measured directivity: angles from the axis, radians, ascending from 0 to pi/2, shape (N,), and the relative pressures, shape (N,)."""
    @staticmethod
    def open(path: _Path) -> Transducer:
        """The transducer that a file describes, such as those in rigs/transducers."""

@final
class Array:
    """An array of ultrasonic elements.

    Make one by the constructors below. Coordinates are in metres: the origin is the centre of the array on the plane of the faces, z points
    into the field. Elements are numbered from 0.
    """

    @staticmethod
    def square(columns: int, rows: int, *, pitch: float, face_radius: float = 4.5e-3) -> Array:
        """A rectangular lattice, row by row from the corner with the largest y and the smallest x."""
    @staticmethod
    def linear(count: int, *, pitch: float, face_radius: float = 4.5e-3) -> Array:
        """One row along x, from the smallest x."""
    @staticmethod
    def hexagonal(rings: int, *, pitch: float, face_radius: float = 4.5e-3) -> Array:
        """A triangular lattice of rings about the centre; ring k has 6 k elements, clockwise from the corner at 90 degrees."""
    @staticmethod
    def random(count: int, *, pitch: float, seed: int = 0, face_radius: float = 4.5e-3) -> Array:
        """Elements at random positions without overlap, in a square of side count * pitch / 2. The same seed gives the same array."""
    @staticmethod
    def from_positions(
        positions: ArrayLike,
        normals: Optional[ArrayLike] = None,
        *,
        face_radius: float = 4.5e-3,
        amplitudes: Optional[ArrayLike] = None,
        phases: Optional[ArrayLike] = None,
    ) -> Array:
        """Elements at any positions.

        Parameters
        ----------
        positions : array_like, shape (N, 3)
            Centres of the faces, m.
        normals : array_like, shape (N, 3), optional
            Directions in which they radiate, of any length above zero; without them along z.
        face_radius : float
            Radius of the vibrating faces, m.
        amplitudes : array_like, shape (N,), optional
            Amplitudes relative to the nominal one, 0 or above; without them 1.
        phases : array_like, shape (N,), optional
            Phases in addition to those of the drive, rad; without them 0.
        """
    @staticmethod
    def open(path: _Path) -> Array:
        """The array of a rig file, a plan, or the scan.toml of a record, with its frequency and medium. A plan gives that of the rig file that it
        names.
        """
    @property
    def positions(self) -> _Numbers:
        """Centres of the faces, m, shape (N, 3)."""
    @property
    def normals(self) -> _Numbers:
        """Directions in which the elements radiate, unit vectors, shape (N, 3)."""
    @property
    def face_radii(self) -> _Numbers:
        """Radii of the vibrating faces, m, shape (N,)."""
    @property
    def amplitudes(self) -> _Numbers:
        """Amplitudes relative to the nominal one, shape (N,); 0 is a silent element."""
    @property
    def phases(self) -> _Numbers:
        """Phases of the elements in addition to those of the drive, rad, shape (N,)."""
    @property
    def frequency(self) -> Optional[float]:
        """Drive frequency of the array's file, Hz; None for an array that is not from a file."""
    @property
    def medium(self) -> Optional[Medium]:
        """Medium of the array's file; None for an array that is not from a file."""
    def __len__(self) -> int: ...

@final
class Record:
    @staticmethod
    def open(folder: str) -> Record: ...
    @staticmethod
    def from_arrays(
        array: Array,
        positions: ArrayLike,
        readings: ArrayLike,
        reading_phases: Optional[Tuple[ArrayLike, str, str, Optional[float]]],
        foci: Optional[ArrayLike],
        phases: Optional[ArrayLike],
        drives: Optional[ArrayLike],
        times: Optional[ArrayLike],
        medium: Optional[Medium],
        frequency: Optional[float],
        simulator_name: str,
        unit: str,
        name: str,
    ) -> Record: ...
    def write(self, folder: str) -> None: ...
    @property
    def folder(self) -> Optional[os.PathLike[str]]: ...
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def recorded(self) -> str: ...
    @property
    def simulator(self) -> str: ...
    @property
    def layout(self) -> str: ...
    @property
    def array(self) -> Array: ...
    @property
    def medium(self) -> Medium: ...
    @property
    def frequency(self) -> float: ...
    @property
    def foci(self) -> List[Optional[Tuple[float, float, float]]]: ...
    @property
    def phases(self) -> _Numbers: ...
    @property
    def positions(self) -> _Numbers: ...
    @property
    def readings(self) -> _Numbers: ...
    @property
    def phase(self) -> Optional[Tuple[str, str, float]]: ...
    @property
    def reading_phases(self) -> _Numbers: ...
    @property
    def times(self) -> _Numbers: ...
    @property
    def drives(self) -> NDArray[np.int64]: ...
    @property
    def spreads(self) -> _Numbers: ...
    @property
    def counts(self) -> NDArray[np.int64]: ...
    def planes(self) -> List[Tuple[int, float, Optional[Tuple[_Numbers, _Numbers, _Numbers]], Optional[str]]]: ...
    def __len__(self) -> int: ...

@final
class Comparison:
    def to_json(self) -> str: ...
    def to_text(self) -> str: ...
    def maps(self) -> List[Optional[Tuple[_Numbers, _Numbers, _Numbers, _Numbers]]]: ...

@final
class Diagnosis:
    def to_json(self) -> str: ...
    def to_text(self) -> str: ...
    def maps(self) -> List[Optional[Tuple[_Numbers, _Numbers, List[_Numbers]]]]: ...

def simulate(
    array: Array,
    points: ArrayLike,
    *,
    focus: Optional[Tuple[float, float, float]] = None,
    drive: Optional[NDArray[np.complex128]] = None,
    medium: Optional[Medium] = None,
    frequency: Optional[float] = None,
    transducer: Union[str, Transducer, None] = None,
    attenuation: float = 0.0,
    method: str = "auto",
    threads: Optional[int] = None,
) -> NDArray[np.complex128]: ...
def compare(
    record: Record,
    simulator_name: Optional[str] = None,
    register: str = "auto",
    threads: Optional[int] = None,
    amplitude_only: bool = False,
) -> Comparison: ...
def diagnose(
    records: Sequence[Record],
    simulator_name: Optional[str] = None,
    threads: Optional[int] = None,
    amplitude_only: bool = False,
) -> Diagnosis: ...
