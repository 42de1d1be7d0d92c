"""`junit.xml` from a run's record: failure is a deviation, error is a rig that failed."""

from __future__ import annotations

from pathlib import Path

from junit_xml import (  # type: ignore[import-untyped]  # it carries no types
    TestCase,
    TestSuite,
    to_xml_report_string,
)

from conformance.errors import BenchError
from conformance.report.results import Item, Results


def to_junit(results: Results) -> str:
    """Return the record as JUnit XML; text that XML forbids is escaped."""
    device = results.device
    serial = device.get("serial")
    name = f"{device['spec']} {serial}" if serial else str(device["spec"])
    properties = {
        key: _legal(str(value))
        for key, value in {**device, **results.run}.items()
        if isinstance(value, str | int | float) and value != ""
    }
    remarks = {item.id for item in results.remarks()}
    cases = [_case(item, remark=item.id in remarks) for item in results.items]
    cases += _scan_cases(results)
    for name_, reason in (
        ("run", results.aborted),
        ("as found", results.left_changed),
        ("illegal frames", results.illegal),
    ):
        if reason:
            case = TestCase(name_, classname=f"{device['spec']}.bench")
            case.add_error_info(message=_legal(reason))
            cases.append(case)
    suite = TestSuite(
        _legal(name),
        cases,
        properties=properties,
        timestamp=_legal(str(results.run.get("started", ""))),
    )
    return str(to_xml_report_string([suite]))


def write_junit(results: Results, path: Path) -> None:
    """Write the record as JUnit XML.

    Raises:
        BenchError: The disk does not take it.
    """
    try:
        path.write_text(to_junit(results), encoding="utf-8", newline="\n")
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror or error}") from error


def _case(item: Item, *, remark: bool) -> TestCase:
    device = item.id.partition("/")[0]
    case = TestCase(
        _legal(item.id), classname=f"{device}.{item.service}", elapsed_sec=item.duration_s
    )
    if item.verdict == "fail" and remark:
        case.add_skipped_info(
            message=_legal(f"remark: {headline(item)}"), output=_legal(explain(item))
        )
    elif item.verdict == "fail":
        case.add_failure_info(message=_legal(headline(item)), output=_legal(explain(item)))
    elif item.verdict == "inconclusive":
        case.add_error_info(message=_legal(f"inconclusive: {item.reason}"))
    elif item.verdict != "pass":
        word = item.verdict.replace("_", " ")
        case.add_skipped_info(message=_legal(f"{word}: {item.reason}"))
    return case


def _scan_cases(results: Results) -> list[TestCase]:
    """Return a remark per entry that is not documented, and a pass where there is none."""
    if results.scanned is None:
        return []
    device = results.device["spec"]
    cases = []
    for found in results.scanned.undocumented:
        case = TestCase(f"{device}/scan/{found.object}", classname=f"{device}.scan")
        case.add_skipped_info(message=_legal(f"remark: not documented: {found}"))
        cases.append(case)
    took_s = results.scanned.duration_s
    return cases or [TestCase(f"{device}/scan", classname=f"{device}.scan", elapsed_sec=took_s)]


def headline(item: Item) -> str:
    """Return a deviation in one line."""
    return f"{item.quantity}: expected {item.expected}, got {item.actual}"


def explain(item: Item) -> str:
    """Return a deviation as an engineer reads it: expected, actual, source, wire."""
    lines = [f"{item.id}  {item.sentence}"]
    for deviation in item.deviations:
        lines += [
            f"  {deviation['quantity']}",
            f"    expected  {deviation['expected']}",
            f"    actual    {deviation['actual']}",
        ]
    lines.append(f"  source    {item.source} (level {item.level})")
    if item.eds:
        lines.append(f"  EDS       {item.eds['says']}")
    if item.eds.get("stands"):
        lines.append(f"            {item.eds['stands']}")
    lines.append(f"  wire      {item.trace}")
    if item.repro:
        lines.append(f"  again     {item.repro}")
    return "\n".join(lines)


def _legal(text: str) -> str:
    """Return text with the characters that XML 1.0 forbids written as escapes."""
    return "".join(c if _is_legal(ord(c)) else f"\\x{ord(c):02x}" for c in text)


def _is_legal(code: int) -> bool:
    return (
        code in (0x9, 0xA, 0xD)
        or 0x20 <= code <= 0xD7FF
        or 0xE000 <= code <= 0xFFFD
        or 0x10000 <= code <= 0x10FFFF
    )
