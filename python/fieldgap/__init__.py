"""Ultrasonic fields of phased arrays: simulate, compare with a recorded scan, and find out why the two differ.

>>> import fieldgap as fg
>>> array = fg.Array.square(6, 6, pitch=10.5e-3)
>>> points = fg.plane(z=0.15, size=0.08, step=0.5e-3)
>>> field = fg.simulate(array, points, focus=(0, 0, 0.15))
>>> field.shape
(161, 161)

Lengths are in metres, pressures in pascals, angles in radians and frequencies in hertz. The origin is the centre of the array on the plane of the
faces; z points into the field.

>>> record = fg.open("out/thesis-focus")  # doctest: +SKIP
>>> comparison = fg.compare(record)  # doctest: +SKIP
>>> diagnosis = fg.diagnose(record)  # doctest: +SKIP
"""

from importlib.metadata import version as _version

from ._native import Array, Medium, Transducer
from .comparison import Agreement, ComparedMap, Comparison, Discrepancy, Figures, Levels, PlaneComparison, compare
from .diagnosis import Candidate, Departure, DiagnosedMap, Diagnosis, Parameter, Remainder, diagnose
from .errors import ArgumentError, FieldgapError, FileError, IncomparableError
from .field import plane, simulate
from .plane_map import Map
from .record import Phase, Record, Setup, open
from .uncertain import Uncertain
from .volume import Volume, simulate_volume

__version__ = _version("fieldgap")

# `open` is left out: `from fieldgap import *` keeps Python's own.
__all__ = [
    "Agreement",
    "ArgumentError",
    "Array",
    "Candidate",
    "ComparedMap",
    "Comparison",
    "Departure",
    "DiagnosedMap",
    "Diagnosis",
    "Discrepancy",
    "FieldgapError",
    "Figures",
    "FileError",
    "IncomparableError",
    "Levels",
    "Map",
    "Medium",
    "Parameter",
    "Phase",
    "PlaneComparison",
    "Record",
    "Remainder",
    "Setup",
    "Transducer",
    "Uncertain",
    "Volume",
    "compare",
    "diagnose",
    "plane",
    "simulate",
    "simulate_volume",
]
