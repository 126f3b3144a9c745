"""Tables for notebooks."""

from __future__ import annotations

from html import escape
from typing import Iterable, Optional, Sequence


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; every cell is text, never markup."""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{f'<thead><tr>{head}</tr></thead>' if head else ''}<tbody>{body}</tbody></table>"


def image(png: Optional[str], alt: str) -> str:
    """A picture from its PNG in base 64; nothing where there is none."""
    return "" if png is None else f'<img alt="{escape(alt)}" style="max-width:100%" src="data:image/png;base64,{png}">'
