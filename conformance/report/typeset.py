"""A certificate as PDF/A-2a: words as data, so that nothing of them is markup; fonts of typst's own."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any, Final

from conformance.report.certificate import Certificate
from conformance.report.printable import breakable
from conformance.resources import data

TEMPLATE: Final = "certificate.typ"


def to_pdf(certificate: Certificate) -> bytes:
    """Return the certificate as PDF; the same certificate is always the same octets."""
    import typst  # noqa: PLC0415 - it takes long to load, and not every command needs it

    compiled = typst.Compiler(
        (data("reports/templates") / TEMPLATE).read_bytes(), ignore_system_fonts=True
    ).compile(
        format="pdf",
        sys_inputs={"certificate": json.dumps(_breakable(asdict(certificate)))},
        timestamp=certificate.made,
        pdf_standards=["a-2a"],
    )
    assert isinstance(compiled, bytes)  # one document was asked for
    return compiled


def _breakable(value: Any) -> Any:
    """Return data of which every text can be broken into lines, but for hashes to copy."""
    if isinstance(value, str):
        return breakable(value)
    if isinstance(value, dict):
        return {key: part if key == "sha256" else _breakable(part) for key, part in value.items()}
    return [_breakable(part) for part in value] if isinstance(value, list | tuple) else value
