"""HTML pages from templates: everything escaped, text of a device made harmless and short."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from conformance.resources import data

if TYPE_CHECKING:
    from jinja2 import Environment

MOST_SHOWN: Final = 400
"""Characters of a text that a page shows; the record has it whole."""


def render(template: str, **context: object) -> str:
    """Return a page.

    Args:
        template: Its file's name in ``reports/templates``.
        context: What it shows.
    """
    return _environment().get_template(template).render(context)


def _environment() -> Environment:
    from jinja2 import (  # noqa: PLC0415 - it takes long to load, and not every command needs it
        Environment,
        FileSystemLoader,
        StrictUndefined,
    )

    return Environment(
        loader=FileSystemLoader(data("reports/templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_harmless,
    )


def _harmless(value: Any) -> Any:
    """Return a value as it is shown: no control characters, and no text without an end."""
    return shown(value) if type(value) is str else value


def shown(text: str) -> str:
    """Return a text without control characters, cut if it is long, with its length."""
    if len(text) > MOST_SHOWN:
        text = f"{text[:MOST_SHOWN]}… ({len(text):,} characters)"
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else _escape(c) for c in text)


def _escape(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code <= 0xFF else f"\\u{code:04x}"
