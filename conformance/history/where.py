"""Where the history is, as users say it."""

from __future__ import annotations

from typing import Final

VARIABLE: Final = "CANOPEN_CONFORMANCE_DATABASE"
EXPECTED: Final = "sqlite:///FILE or postgresql://USER@HOST/NAME"
