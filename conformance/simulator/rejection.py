"""What a node answers when it refuses an SDO access."""

from __future__ import annotations

from conformance.wire.abort import AbortCode


class SdoAbortError(Exception):
    """An access is refused with an abort code (CiA 301 v4.2.0, 7.2.4.3.17)."""

    def __init__(self, code: AbortCode) -> None:
        super().__init__(code.text)
        self.code = code
