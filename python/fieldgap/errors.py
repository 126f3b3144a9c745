"""Exceptions of fieldgap. Their messages are those of the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Optional


class FieldgapError(Exception):
    """Any error of fieldgap."""


class ArgumentError(FieldgapError, ValueError):
    """An argument that a function does not take: out of range, of another shape, not finite."""


class IncomparableError(FieldgapError):
    """Scans that cannot be compared with a simulation, or diagnosed."""


class FileError(FieldgapError):
    """A file with a fault.

    Attributes
    ----------
    path : pathlib.Path or None
        The file.
    line, column : int or None
        Where in the file, both from 1.
    problem : str
        What is wrong.
    remedy : str or None
        What to do.
    """

    def __init__(
        self,
        message: str,
        path: Optional[Path] = None,
        line: Optional[int] = None,
        column: Optional[int] = None,
        problem: Optional[str] = None,
        remedy: Optional[str] = None,
    ) -> None:
        super().__init__(message, path, line, column, problem, remedy)
        self.path = None if path is None else Path(path)
        self.line = line
        self.column = column
        self.problem = message if problem is None else problem
        self.remedy = remedy

    def __str__(self) -> str:
        message: str = self.args[0]
        return message if self.remedy is None else f"{message}\n  help: {self.remedy}"
