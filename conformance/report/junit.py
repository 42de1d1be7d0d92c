"""`junit.xml` from a run's record: failure is a deviation, error is a rig that failed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, TypeAlias
from xml.etree import ElementTree as ET

from junit_xml import (  # type: ignore[import-untyped]  # it carries no types
    TestCase,
    TestSuite,
    to_xml_report_string,
)

from conformance.errors import BenchError
from conformance.report.frames import TraceFile
from conformance.report.results import Item, Results

Suites: TypeAlias = Literal["device", "service"]
"""What one suite holds: all items of the device, or those of one service."""

MOST_FRAMES = 20
"""Of one failure; the rest is in the report."""

FIRMWARE = "100Ah"
"""Manufacturer software version (CiA 301 v4.2.0, 7.5.2.10)."""


def to_junit(results: Results, trace: Path | None = None, suites: Suites = "device") -> str:
    """Return the record as JUnit XML; text that XML forbids is escaped.

    Args:
        results: The record.
        trace: Of the run; failures then tell their frames.
        suites: One for the device, or one per service.
    """
    device = results.device
    serial = device.get("serial")
    name = _legal(f"{device['spec']} {serial}" if serial else str(device["spec"]))
    remarks = {item.id for item in results.remarks()}
    file = TraceFile(trace) if trace is not None and results.deviations() else None
    by_suite: dict[str, list[TestCase]] = defaultdict(list)
    for item in results.items:
        suite = name if suites == "device" else f"{name} {item.service}"
        by_suite[suite].append(_case(item, file, remark=item.id in remarks))
    by_suite[name] += [*_scan_cases(results), *_bench_cases(results)]
    properties = _properties(results)
    timestamp = _legal(str(results.run.get("started", "")))
    made = [
        TestSuite(suite, cases, properties=properties, timestamp=timestamp)
        for suite, cases in by_suite.items()
        if cases or suites == "device"
    ]
    return _for_jenkins(str(to_xml_report_string(made)))


def _for_jenkins(text: str) -> str:
    """Return a report without an attribute that Jenkins has no place for, times as it reads them."""
    root = ET.fromstring(text)  # noqa: S314 - it was made here
    for element in root.iter():
        element.attrib.pop("disabled", None)
        if "time" in element.attrib:
            element.set("time", f"{float(element.attrib['time']):.6f}")
    return f'<?xml version="1.0" ?>\n{ET.tostring(root, encoding="unicode")}\n'


def _properties(results: Results) -> dict[str, str]:
    """Return what a reader wants to know of device and run."""
    identity = results.device.get("identity")
    firmware = identity.get(FIRMWARE, "") if isinstance(identity, Mapping) else ""
    told = {**results.device, "firmware_version": firmware, **results.run}
    return {
        key: _legal(str(value))
        for key, value in told.items()
        if isinstance(value, str | int | float) and value != ""
    }


def _bench_cases(results: Results) -> list[TestCase]:
    """Return an error for each thing that keeps the run as a whole from conforming."""
    device = results.device
    cases = []
    for name_, reason in (
        ("run", results.aborted),
        ("as found", results.left_changed),
        ("illegal frames", results.illegal),
    ):
        if reason:
            case = TestCase(name_, classname=f"{device['spec']}.bench")
            case.add_error_info(message=_legal(reason))
            cases.append(case)
    return cases


def write_junit(results: Results, path: Path, suites: Suites = "device") -> None:
    """Write the record as JUnit XML beside its trace.

    Raises:
        BenchError: The disk does not take it.
    """
    try:
        text = to_junit(results, path.with_name("trace.log"), suites)
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror or error}") from error


def _case(item: Item, trace: TraceFile | None, *, remark: bool) -> TestCase:
    device = item.id.partition("/")[0]
    case = TestCase(
        _legal(item.id), classname=f"{device}.{item.service}", elapsed_sec=item.duration_s
    )
    if item.verdict == "fail" and remark:
        case.add_skipped_info(
            message=_legal(f"remark: {headline(item)}"), output=_legal(explain(item))
        )
    elif item.verdict == "fail" and item.known:
        case.add_skipped_info(
            message=_legal(f"known deviation: {item.known}: {headline(item)}"),
            output=_legal(explain(item)),
        )
    elif item.verdict == "fail":
        shown = "\n".join([explain(item), *_frames(item, trace)])
        case.add_failure_info(message=_legal(headline(item)), output=_legal(shown))
    elif item.verdict == "inconclusive":
        case.add_error_info(message=_legal(f"inconclusive: {item.reason}"))
    elif item.verdict != "pass":
        word = item.verdict.replace("_", " ")
        case.add_skipped_info(message=_legal(f"{word}: {item.reason}"))
    case.stdout = _legal(item.tried)
    return case


def _frames(item: Item, trace: TraceFile | None) -> list[str]:
    """Return the frames of an item as lines, the last ones of many."""
    if trace is None:
        return []
    evidence = trace.evidence(item.trace, item.begins, item.object)
    shown = evidence.frames[-MOST_FRAMES:]
    left = len(evidence.frames) - len(shown)
    notes = [evidence.note, f"{left} frames before these are in trace.log" if left else ""]
    lines = [
        f"    {it.time_s:.6f} {'sent' if it.sent else 'came'} {it.can_id} {it.data}  {it.words}".rstrip()
        for it in shown
    ]
    return ["  frames", *(f"    {note}" for note in notes if note), *lines]


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
    if item.known:
        lines.append(f"  known     {item.known}")
    if item.tried:
        lines.append(f"  tried     {item.tried}")
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
