"""Diagnoses: why a recorded scan and its simulation differ."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Union

import numpy as np

from . import _native, html, picture
from .record import Record, as_records
from .uncertain import number

if TYPE_CHECKING:
    from numpy.typing import NDArray


#: Most candidates in a notebook; `candidates` has all.
_MOST_CANDIDATES = 6


@dataclass(frozen=True)
class Parameter:
    """A fitted parameter of an effect.

    Attributes
    ----------
    value : float, complex, list of int, or ndarray of shape (elements,)
        The value, in the unit that its name ends with; a list of int names elements from 0.
    standard_error : float, complex, None, or ndarray of shape (elements,)
        Its standard error, of a complex value that of each part; NaN where the data do not tell it, None for a list of elements.
    """

    value: Any
    standard_error: Any


@dataclass(frozen=True)
class Candidate:
    """A set of effects that was fitted to the readings.

    Attributes
    ----------
    effects : list of str
        The ids of the effects; empty for no effect.
    probability : float
        Probability among all sets that were tried, 0 to 1.
    log_evidence : float
        Natural logarithm of the evidence, relative to the best.
    parameters : dict of Parameter
        Fitted parameters by ``effect.parameter``.
    meaning : list of str
        What the parameters mean, one sentence an effect.
    gap_after, gap_after_held_out : float
        Gap with the effects added, relative to the scan's root mean square; the latter over readings kept out of the fit.
    """

    effects: List[str]
    probability: float
    log_evidence: float
    parameters: Dict[str, Parameter]
    meaning: List[str]
    gap_after: float
    gap_after_held_out: float


@dataclass(frozen=True)
class Remainder:
    """What the best candidate leaves that is not noise.

    Attributes
    ----------
    share : float
        Share of the squared gap beyond noise.
    gap : float
        Its root mean square relative to the scan's.
    looks_like : list of str
        The tests that find structure in it, the clearest first.
    left_to : list of list of str
        Where only a part of many effects is beyond doubt: sets of others, each of which explains the rest.
    """

    share: float
    gap: float
    looks_like: List[str]
    left_to: List[List[str]]


@dataclass(frozen=True)
class Departure:
    """How far the set-up departs from what is stated, within its stated uncertainty.

    Attributes
    ----------
    what : str
        Id of the effect that acts so; ``origin`` for the scan's coordinates.
    meaning : str
        Its size in words.
    in_uncertainties : float
        Root mean square of its numbers, each over its standard uncertainty.
    """

    what: str
    meaning: str
    in_uncertainties: float


@dataclass(frozen=True)
class DiagnosedMap:
    """Scan and simulations of one drive at one height. NaN where nothing was measured.

    Attributes
    ----------
    scan, drive : int
        Number of the scan and of the drive.
    height : float
        Height, m.
    x, y : ndarray
        Columns and rows, ascending, m.
    measured, before, after : ndarray, shape (rows, columns)
        Readings, the simulation as believed and that with the best candidate added, in the readings' unit.
    residual_before, residual_after : ndarray, shape (rows, columns)
        What either leaves, in standard deviations of the noise.
    """

    scan: int
    drive: int
    height: float
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    measured: NDArray[np.float64]
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    residual_before: NDArray[np.float64]
    residual_after: NDArray[np.float64]


class Diagnosis:
    """Why a recorded scan and its simulation differ; `fieldgap.diagnose` makes one."""

    def __init__(self, native: _native.Diagnosis) -> None:
        self._native = native

    @cached_property
    def _json(self) -> Any:
        return json.loads(self._native.to_json())

    def to_dict(self) -> Dict[str, Any]:
        """Everything, as ``fieldgap diagnose --json`` prints it."""
        everything: Dict[str, Any] = json.loads(self._native.to_json())
        return everything

    @property
    def verdict(self) -> str:
        """``explained``, ``mostly-explained``, ``ambiguous``, ``unexplained`` or ``none`` (no gap beyond noise)."""
        return self._json["verdict"]

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return self._json["sentence"]

    @property
    def scans(self) -> List[str]:
        """Names of the scans that were taken together."""
        return self._json["scans"]

    @property
    def simulator(self) -> str:
        """The simulator whose gap this is."""
        return self._json["simulator"]

    @property
    def effects(self) -> List[str]:
        """The named cause, one effect or several; empty unless the verdict is explained or mostly-explained."""
        return self._json["effects"]

    @property
    def alternatives(self) -> List[List[str]]:
        """The rival sets of effects, best first, where the verdict is ambiguous."""
        return self._json["alternatives"]

    @cached_property
    def candidates(self) -> List[Candidate]:
        """Every set of effects worth a mention, the most probable first."""
        return [_candidate(candidate) for candidate in self._json["ranked"]]

    @property
    def probability(self) -> float:
        """Probability of the best candidate, 0 to 1."""
        return self.candidates[0].probability if self.candidates else float("nan")

    @property
    def parameters(self) -> Dict[str, Parameter]:
        """Fitted parameters of the best candidate, by ``effect.parameter``."""
        return self.candidates[0].parameters if self.candidates else {}

    @property
    def remainder(self) -> Optional[Remainder]:
        """What the best candidate leaves that is not noise; None where it leaves noise alone."""
        remainder = self._json["remainder"]
        if remainder is None:
            return None
        return Remainder(
            number(remainder["share"]), number(remainder["gap"]), remainder["looks_like"], remainder.get("left_to", [])
        )

    @property
    def departures(self) -> List[Departure]:
        """Departures of the set-up beside the best candidate; empty where the record states no uncertainty."""
        stated = self._json.get("uncertainty") or {"departures": []}
        return [
            Departure(one["what"], one["sentence"], number(one["in_uncertainties"])) for one in stated["departures"]
        ]

    @property
    def gap_before(self) -> float:
        """Gap of the simulation as believed, relative to the scan's root mean square."""
        return number(self._json["gap_before"])

    @property
    def gap_after(self) -> float:
        """Gap with the best candidate added."""
        return self.candidates[0].gap_after if self.candidates else self.gap_before

    @property
    def noise_floor(self) -> float:
        """What noise alone leaves, relative to the scan's root mean square."""
        return number(self._json["noise_floor"])

    @property
    def slow_noise(self) -> Optional[float]:
        """Standard deviation of the slow noise of the level, relative to it, up to 0.015; None where none is seen."""
        share = self._json.get("slow_noise")
        return None if share is None else number(share)

    @property
    def explained_fraction(self) -> float:
        """Share of the squared gap beyond noise that the best candidate explains, on readings kept out of the fit, 0 to 1."""
        return number(self._json["explained_fraction"])

    @property
    def next_measurement(self) -> Optional[Dict[str, Any]]:
        """The scan that would tell the rivals apart, as the JSON has it."""
        return self._json["next_measurement"]

    @property
    def undetermined(self) -> List[str]:
        """What these data cannot tell, in sentences."""
        return self._json["undetermined"]

    @cached_property
    def maps(self) -> List[DiagnosedMap]:
        """The maps, by scan, drive and height; planes whose points lie on no grid are left out."""
        planes = zip(self._json["planes"], self._native.maps())
        return [
            DiagnosedMap(plane["scan"], plane["focus"], 1e-3 * plane["z_mm"], arrays[0], arrays[1], *arrays[2])
            for plane, arrays in planes
            if arrays is not None
        ]

    def to_pandas(self) -> Any:
        """The real parameters of all candidates as a `pandas.DataFrame`: candidate, effects, probability, parameter, value, error."""
        import pandas

        rows = [
            {
                "candidate": rank,
                "effects": " + ".join(candidate.effects),
                "probability": candidate.probability,
                "parameter": name,
                "value": parameter.value,
                "standard_error": parameter.standard_error,
            }
            for rank, candidate in enumerate(self.candidates)
            for name, parameter in candidate.parameters.items()
            if isinstance(parameter.value, float)
        ]
        columns = ["candidate", "effects", "probability", "parameter", "value", "standard_error"]
        return pandas.DataFrame(rows, columns=columns)

    def plot(self) -> Any:
        """Scan and residuals before and after at each height, as a matplotlib figure (needs matplotlib)."""
        return picture.of_diagnosis(self, interactive=True)

    def __str__(self) -> str:
        return self._native.to_text()

    def __repr__(self) -> str:
        named = " + ".join(self.effects) or "no effect named"
        return f"<Diagnosis of {', '.join(self.scans)!r}: {self.verdict}, {named}>"

    def _repr_html_(self) -> str:
        rows = [
            [
                " + ".join(candidate.effects) or "no effect",
                f"{candidate.probability:.3f}",
                f"{candidate.gap_after:.1%}",
                "; ".join(candidate.meaning),
            ]
            for candidate in self.candidates[:_MOST_CANDIDATES]
        ]
        gaps = f"Gap {self.gap_before:.1%} as believed, {self.gap_after:.1%} with the best candidate; noise alone leaves {self.noise_floor:.1%}."
        remainder = self.remainder
        if remainder is not None:
            gaps += f" Of the squared gap, {remainder.share:.1%} remain."
            if remainder.looks_like:
                gaps += f" It has structure: {'; '.join(remainder.looks_like)}."
        return (
            f"<b>{escape(', '.join(self.scans))}: {escape(self.verdict)}</b><p>{escape(self.sentence)}</p>"
            + html.table(["candidate", "probability", "gap after", "meaning"], rows)
            + f"<p>{escape(gaps)}</p>"
            + "".join(f"<p>{escape(sentence)}</p>" for sentence in self.undetermined)
            + html.image(picture.png(self), "scan and residuals before and after at each height")
        )


def diagnose(
    records: Union[Record, str, os.PathLike[str], Sequence[Union[Record, str, os.PathLike[str]]]],
    *,
    simulator: Optional[str] = None,
    amplitude_only: bool = False,
    threads: Optional[int] = None,
) -> Diagnosis:
    """Finds out why a recorded scan and its simulation differ.

    Parameters
    ----------
    records : Record, path, or a sequence of them
        One scan, or several of one rig, which are then diagnosed together.
    simulator : str, optional
        The simulator whose gap is in question; without it that of the first scan.
    amplitude_only : bool
        Leaves out the phases of readings that have one.
    threads : int, optional
        Number of threads; without it all cores.

    Raises
    ------
    IncomparableError
        If there is nothing to diagnose, or the scans are not of one rig.

    Notes
    -----
    A diagnosis takes seconds to minutes. The interpreter's lock is released. Ctrl-C ends the call at once; the work that was begun ends in the
    background.
    """
    native = [record._native for record in as_records(records)]
    return Diagnosis(_native.diagnose(native, simulator, threads, amplitude_only))


def _candidate(of_json: Dict[str, Any]) -> Candidate:
    return Candidate(
        of_json["effects"],
        number(of_json["probability"]),
        number(of_json["log_evidence"]),
        {name: _parameter(name, parameter) for name, parameter in of_json["parameters"].items()},
        of_json["readings"],
        number(of_json["gap_after"]),
        number(of_json["gap_after_held_out"]),
    )


def _parameter(name: str, of_json: Dict[str, Any]) -> Parameter:
    value: Any = of_json["value"]
    error: Any = of_json.get("standard_error")
    if not isinstance(value, list):
        return Parameter(number(value), number(error))
    if "standard_error" not in of_json:
        return Parameter(value, None)
    values, errors = (np.array([number(part) for part in parts]) for parts in (value, error))
    # The JSON has real and imaginary part of a coefficient where it has one number for each element of other parameters.
    if name.endswith(".coefficient"):
        return Parameter(complex(*values), complex(*errors))
    return Parameter(values, errors)
