"""Text of a record as paper can show it: every character visible, none too long, lines that break."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

MOST: Final = 120
"""Characters of a text that are shown; the record has it whole."""

ZERO_WIDTH_SPACE: Final = "\u200b"

_SHOWN: Final = (
    range(0x20, 0x500),  # Latin, Greek, Cyrillic
    range(0x2010, 0x2041),  # punctuation
    range(0x20AC, 0x20AD),  # the euro sign
    range(0x2190, 0x2300),  # arrows, mathematical signs
)
_LONG_WORD: Final = re.compile(r"\S{21,}")
_PART: Final = re.compile(r"\S{16}(?=\S)")


def printable(text: str, most: int = MOST) -> str:
    """Return a text without characters that have no glyph of their own, cut if it is long.

    Args:
        text: From a device, a person or a file.
        most: Characters that are shown of it.
    """
    composed = unicodedata.normalize("NFC", text[:most])
    shown = "".join(c if _is_shown(c) else _escape(ord(c)) for c in composed)
    if len(text) <= most and len(shown) <= most:
        return shown
    return f"{shown[:most]}… ({len(text):,} characters)"


def breakable(text: str) -> str:
    """Return a text in which a line can end within a long word."""
    return _LONG_WORD.sub(lambda word: _PART.sub(rf"\g<0>{ZERO_WIDTH_SPACE}", word[0]), text)


def _is_shown(character: str) -> bool:
    if character == " ":
        return True
    code = ord(character)
    return unicodedata.category(character)[0] in "LNPS" and any(code in it for it in _SHOWN)


def _escape(code: int) -> str:
    return f"\\x{code:02x}" if code <= 0xFF else f"\\u{code:04x}"
