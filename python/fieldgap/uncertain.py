"""Numbers with their standard errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, Optional


@dataclass(frozen=True)
class Uncertain:
    """A number and its standard error in the same unit; NaN where it is not determined."""

    value: float
    standard_error: float

    def __float__(self) -> float:
        return self.value

    def shown(self, scale: float = 1.0) -> str:
        """As text, times a scale; the last digits are those of the error."""
        value, error = scale * self.value, scale * self.standard_error
        if not math.isfinite(value):
            return "\N{EN DASH}"
        if not (math.isfinite(error) and error > 0.0):
            return f"{value:.4g}"
        decimals = max(0, 1 - math.floor(math.log10(error)))
        if decimals > 6:
            return f"{value:.3e} \N{PLUS-MINUS SIGN} {error:.1e}"
        return f"{value:.{decimals}f} \N{PLUS-MINUS SIGN} {error:.{decimals}f}"

    def __str__(self) -> str:
        return self.shown()


def number(value: Optional[float]) -> float:
    """A number of the JSON; NaN where there is none."""
    return math.nan if value is None else value


def uncertain(of_json: Dict[str, Any]) -> Uncertain:
    """A number with its error from the JSON."""
    return Uncertain(number(of_json["value"]), number(of_json["standard_error"]))


def if_known(of_json: Optional[Dict[str, Any]]) -> Optional[Uncertain]:
    """The same where the JSON has one."""
    return None if of_json is None else uncertain(of_json)
