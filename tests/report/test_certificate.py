"""The certificate that people sign: what it says, on how many pages, and of what it is not fooled."""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pypdf
import pytest

from conformance.errors import SpecError
from conformance.report.certificate import certify
from conformance.report.certificate_unit import MOST_DEVIATIONS
from conformance.report.printable import ZERO_WIDTH_SPACE, printable
from conformance.report.record import read_record
from conformance.report.typeset import to_pdf

Command = Callable[..., Any]
SHA256 = "0123456789abcdef" * 4
HOSTILE = (
    '#panic("x") *bold* $x$ @ref <label> // \\u{41} `raw` #import "@preview/a:1.0.0": *',
    "".join(map(chr, range(0xA0))) + "\u202egnp.\u0301\u2028\ud800\U0001f600\ufffe",
    "x" * 10_000,
    "\u0301" * 10_000,
    "\n" * 10_000,
    " " * 10_000,
)
RUN = {
    "suite": "0.1.0",
    "spec": "inclinometer",
    "spec_sha256": SHA256,
    "bench": "desk",
    "interface": "pcan",
    "bitrate": 125000,
    "seed": 7,
    "acceptance": True,
    "not_judged": [],
    "started": "2026-03-01T08:00:00+00:00",
    "finished": "2026-03-01T08:05:00+00:00",
    "timestamps": {"by": "adapter", "late_ms": 0.1},
    "as_found": {"objects": 12, "nmt_state": "Pre-operational (7Fh)", "differences": []},
    "non_volatile_writes": 3,
}
DEVICE = {
    "spec": "inclinometer",
    "vendor": "Vendor",
    "name": "Inclinometer",
    "variant": "one-axis",
    "node_id": 5,
    "serial": "S-4711",
    "manual": "Inclinometer manual 3",
    "identity": {"1008h": "INCL", "1018h:04": "2A 00 00 00"},
}


def item(number: int, verdict: str = "pass", **more: object) -> dict[str, object]:
    failed = {"quantity": "period", "expected": "100 ms", "actual": "110 ms"}
    return {
        "id": f"inclinometer/HB-01/1017h/{number}",
        "requirement": "HB-01",
        "sentence": "The heartbeat keeps its period.",
        "level": "shall",
        "source": "Inclinometer manual 3, 7.2.11; CiA 301 v4.2.0, 7.2.8",
        "service": "heartbeat",
        "object": f"1017h/{number}",
        "verdict": verdict,
        "trace": "trace.log:3-4",
        **(failed | {"deviations": [failed]} if verdict == "fail" else {}),
        **more,
    }


def record_of(*items: dict[str, object], verdict: str = "conforms", **summary: object) -> Any:
    said = {"source": "7.2.11", "says": "The heartbeat has a period."}
    shown = said | {"id": "A-1", "verified_by": ["HB-01"]}
    hidden = said | {"id": "A-2", "because": "nothing on a bus shows it"}
    return {
        "manual": {"statements": [shown, hidden]},
        "run": deepcopy(RUN),
        "device": deepcopy(DEVICE),
        "items": list(items),
        "summary": {"verdict": verdict, "complete": True, **summary},
    }


@pytest.fixture
def text_of(tmp_path: Path) -> Callable[..., list[str]]:
    """Return the text of a certificate's pages, lines joined."""

    def pages(*records: Any, lot: str = "") -> list[str]:
        read = []
        for number, record in enumerate(records):
            path = tmp_path / f"{number}.json"
            path.write_text(json.dumps(record), encoding="utf-8")
            read.append(read_record(path))
        path = tmp_path / "certificate.pdf"
        path.write_bytes(to_pdf(certify(read, lot)))
        texts = (page.extract_text() for page in pypdf.PdfReader(path).pages)
        return [" ".join(text.replace(ZERO_WIDTH_SPACE, "").split()) for text in texts]

    return pages


def test_it_says_what_was_judged_how_and_with_what_verdict(
    text_of: Callable[..., list[str]], tmp_path: Path
) -> None:
    (page,) = text_of(record_of(item(1), item(2)))

    assert "The device conforms to its manual 2 of 2 items were judged" in page
    assert "serial number on the label S-4711" in page
    assert "1018h:04 serial number 42 (0000002Ah)" in page
    assert "Inclinometer manual 3" in page
    assert "canopen-conformance 0.1.0" in page
    assert "desk (pcan)" in page
    assert "2026-03-01T08:00:00+00:00" in page
    assert SHA256 in page.replace(" ", "")
    assert read_record(tmp_path / "0.json").sha256 in page
    assert "Statements of the manual: 1 shown, 1 not visible on a bus." in page
    assert "page 1 of 1" in page
    assert all(word in page for word in ("Name", "Date", "Signature"))
    assert "PARTIAL" not in page


def test_a_deviation_has_its_section_what_was_expected_and_what_came(
    text_of: Callable[..., list[str]],
) -> None:
    (page,) = text_of(record_of(item(1), item(2, "fail"), verdict="deviates"))

    assert "The device deviates from its manual: 1 deviation" in page
    assert "HB-01 1017h/2" in page
    assert "manual, 7.2.11; CiA 301" in page
    assert "period: 100 ms" in page
    assert "110 ms" in page
    assert "trace.log:3-4" in page


def test_a_known_deviation_says_who_knows_it_and_still_deviates(
    text_of: Callable[..., list[str]],
) -> None:
    owner = "firmware: follows the oscillator (until 2027-03-31)"
    text = " ".join(
        " ".join(text_of(record_of(item(1, "fail", known=owner), verdict="deviates"))).split()
    )
    assert f"Known to {owner}." in text
    assert "The device deviates from its manual" in text


def test_a_recording_is_called_one(text_of: Callable[..., list[str]]) -> None:
    kept = record_of(item(1))
    kept["run"] |= {"recording": "field.asc", "recording_sha256": "7" * 64}
    text = " ".join(text_of(kept))
    assert "field.asc" in text
    assert "bench" not in text


def test_a_remark_decides_nothing(text_of: Callable[..., list[str]]) -> None:
    (page,) = text_of(record_of(item(1), item(2, "fail", level="should")))

    assert "The device conforms to its manual" in page
    assert "1 remark" in page


@pytest.mark.parametrize(
    ("record", "says"),
    [
        (record_of(item(1), item(2, "inconclusive", reason="a relay stuck")), "a relay stuck"),
        (record_of(item(1), complete=False), "items are missing"),
        (record_of(item(1), aborted="no bus"), "ended early: no bus"),
        (record_of(item(1), left_changed="1017h is not as it was"), "1017h is not as it was"),
        (record_of(item(1), illegal="a response nobody asked for"), "nobody asked for"),
        (record_of(item(1, "skipped")), "0 of 1 item"),
    ],
)
def test_what_is_not_decided_does_not_conform_whatever_its_summary_says(
    text_of: Callable[..., list[str]], record: Any, says: str
) -> None:
    (page,) = text_of(record)

    assert "It is not decided whether the device conforms" in page
    assert says in page
    assert "summary says “conforms”" in page


def test_a_summary_does_not_hide_a_deviation(text_of: Callable[..., list[str]]) -> None:
    (page,) = text_of(record_of(item(1, "fail")))

    assert "The device deviates from its manual" in page
    assert "its items do not bear that out" in page


@pytest.mark.parametrize("acceptance", [False, None, "true", 1])
def test_it_is_partial_on_every_page_unless_the_run_was_an_acceptance(
    text_of: Callable[..., list[str]], acceptance: object
) -> None:
    many = [item(n, "fail", requirement=f"HB-{n}") for n in range(30)]
    record = record_of(*many, verdict="deviates")
    record["run"]["acceptance"] = acceptance

    pages = text_of(record)

    assert len(pages) == 2
    assert all("PARTIAL" in page for page in pages)
    assert all("Vendor Inclinometer, one-axis, serial S-4711 SHA-256" in page for page in pages)


def test_figures_that_are_none_end_nothing(text_of: Callable[..., list[str]]) -> None:
    record = record_of(item(1))
    record["run"] |= {"bitrate": 10**400, "timestamps": {"late_ms": 10**400}, "finished": 10**400}
    record["device"]["node_id"] = 10**400

    (page,) = text_of(record)

    assert "bit rate not in the record" in page


def test_what_was_skipped_and_why_is_told_and_the_verdict_is_about_the_rest(
    text_of: Callable[..., list[str]],
) -> None:
    left = [item(n, "skipped", service="power", reason="no switch") for n in range(3)]
    record = record_of(item(9), *left, item(8, "not_applicable", service="lights"))
    record["run"]["not_judged"] = ["time_stamp"]

    (page,) = text_of(record)

    assert "The device conforms to its manual in what was judged" in page
    assert "3 skipped: no switch (HB-01)" in page
    assert "Services of which nothing could be judged: power." in page
    assert "these checks do not judge: time stamp." in page


def test_a_simulated_device_is_called_one(text_of: Callable[..., list[str]]) -> None:
    record = record_of(item(1))
    record["run"] |= {"interface": "canopen_simulator", "faults": ["heartbeat-slow"]}

    (page,) = text_of(record)

    assert "A simulated device was judged, no real one." in page
    assert "defects on purpose: heartbeat-slow." in page


def test_a_long_table_is_cut_and_says_what_is_missing(text_of: Callable[..., list[str]]) -> None:
    failed = [item(n, "fail", requirement=f"HB-{n // 10:02}") for n in range(90)]

    pages = text_of(record_of(*failed, verdict="deviates"))

    whole = " ".join(pages)
    assert len(pages) <= 2
    assert "90 deviations" in whole
    assert whole.count("1017h/") == MOST_DEVIATIONS
    assert all(f"HB-{n:02} 1017h/{n * 10}" in whole for n in range(9))
    assert "80 more, by requirement: HB-00 8, HB-01 9" in whole
    assert "All of them are in 0.json." in whole


def test_several_begin_with_a_summary(text_of: Callable[..., list[str]]) -> None:
    records = [record_of(item(1)) for _ in range(8)]
    for number, record in enumerate(records):
        record["device"]["serial"] = f"S-{number}"
    records[3]["items"] = [item(1), item(2, "fail")]
    records[3]["summary"]["verdict"] = "deviates"
    records[5]["run"]["acceptance"] = False

    pages = text_of(*records, lot="Delivery 12")

    assert len(pages) == 9
    assert "8 units: 7 conform, 1 deviates, 0 are undecided." in pages[0]
    assert "PARTIAL. 1 of 8 records" in pages[0]
    assert "Delivery 12" in pages[0]
    assert "4 Vendor Inclinometer, one-axis S-3 deviates 1 " in pages[0]
    assert "S-5 conforms (partial)" in pages[0]
    assert all(f"serial S-{n}" in page for n, page in enumerate(pages[1:]))
    assert all(f"page {n} of 9" in page for n, page in enumerate(pages, 1))
    assert ["PARTIAL" in page for page in pages].count(True) == 2


def test_the_same_serial_twice_is_told_and_the_same_record_refused(
    text_of: Callable[..., list[str]],
) -> None:
    first, second = record_of(item(1)), record_of(item(2))

    assert "Serial S-4711 is there more than once: units 1, 2." in text_of(first, second)[0]
    with pytest.raises(SpecError, match="expected each record once"):
        text_of(first, first)


def test_an_old_record_says_what_it_does_not_know(text_of: Callable[..., list[str]]) -> None:
    record = {
        "run": {},
        "device": {"spec": "inclinometer", "node_id": 5},
        "items": [item(1)],
        "summary": {"verdict": "conforms"},
    }

    (page,) = text_of(record)

    assert "not in the record" in page
    assert "PARTIAL" in page


def test_a_verdict_that_nobody_knows_is_refused(text_of: Callable[..., list[str]]) -> None:
    with pytest.raises(SpecError, match=r"summary.verdict: expected one of conforms, .*, got 'ok'"):
        text_of(record_of(item(1), verdict="ok"))


@pytest.mark.parametrize(
    "text", HOSTILE, ids=["markup", "control", "long", "marks", "lines", "spaces"]
)
def test_no_text_of_a_record_is_markup_or_without_end(
    text_of: Callable[..., list[str]], text: str
) -> None:
    verdicts = [*["fail"] * 30, *["skipped"] * 30]
    record = _with_every_text(record_of(*map(item, range(60), verdicts)), text)
    record["summary"]["verdict"] = "deviates"
    record["run"]["acceptance"] = record["run"]["select"] = text
    record["run"]["faults"] = record["run"]["not_judged"] = [f"{n}{text}" for n in range(30)]
    record["device"]["identity"] = {f"{n}{text}": text for n in range(30)}
    for number, (made, verdict) in enumerate(zip(record["items"], verdicts, strict=True)):
        made["verdict"] = verdict
        made["level"] = "should" if number % 2 else "shall"
        made["requirement"] = made["service"] = made["reason"] = f"{number}{text}"

    pages = text_of(record, lot=text)

    assert len(pages) <= 5
    assert "The device deviates from its manual: 15 deviations" in pages[0]
    assert all("PARTIAL" in page for page in pages)
    if text == HOSTILE[0]:
        assert '#panic("x") *bold* $x$ @ref <label> // \\u{41}' in pages[0]


def _with_every_text(value: Any, text: str) -> Any:
    if isinstance(value, dict):
        return {key: _with_every_text(part, text) for key, part in value.items()}
    if isinstance(value, list):
        return [_with_every_text(part, text) for part in value]
    return text if isinstance(value, str) else value


def test_every_character_that_is_shown_has_a_glyph(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    path.write_text(json.dumps(record_of(item(1))), encoding="utf-8")
    certificate = certify([read_record(path)])
    left = [
        chr(c) for c in range(0x10000) if printable(chr(c)) == unicodedata.normalize("NFC", chr(c))
    ]

    to_pdf(replace(certificate, lot=" ".join(left), units=[*certificate.units] * 2))

    assert len(left) > 1000


def test_the_same_record_makes_the_same_octets(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    path.write_text(json.dumps(record_of(item(1), item(2, "fail"))), encoding="utf-8")

    first, second = (to_pdf(certify([read_record(path)])) for _ in range(2))

    assert first == second
    assert b"2026-03-01T08:05:00" in first


def test_the_command_makes_it_beside_the_record(command: Command, tmp_path: Path) -> None:
    (tmp_path / "results.json").write_text(json.dumps(record_of(item(1))), encoding="utf-8")

    finished = command("certificate", tmp_path)

    assert finished.code == 0
    assert "serial S-4711: The device conforms to its manual" in finished.out
    assert (tmp_path / "certificate.pdf").read_bytes().startswith(b"%PDF")


def test_the_command_names_a_record_that_is_none_and_a_place_it_cannot_write(
    command: Command, tmp_path: Path
) -> None:
    (tmp_path / "results.json").write_text(json.dumps(record_of(item(1))), encoding="utf-8")

    none = command("certificate", tmp_path / "nothing")
    full = command("certificate", tmp_path, "--output", tmp_path / "nothing" / "a.pdf")

    assert (none.code, full.code) == (3, 2)
    assert "expected the folder of a run" in none.err
    assert "cannot write" in full.err
