"""The report of a run: one page with all that the record says, whatever a device has sent."""

from __future__ import annotations

import copy
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from conformance.errors import SpecError
from conformance.report import plots
from conformance.report.pages import MOST_SHOWN
from conformance.report.provenance_words import milliseconds
from conformance.report.record import read_record
from conformance.report.report_page import to_html
from conformance.resources import data

FAULT = ("--fault", "heartbeat-slow-10-percent", "--select", "HB or OD-09 or DEV-38")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
VOID = {"meta", "input", "br", "link", "img", "path", "use", "rect"}
NASTY = (
    "<script>alert(1)</script>",
    "\"><img src=x onerror='alert(1)'>",
    "a\x00b\x1b[31mc\x7f",
    "\u202edesrever",
    "\ud800 alone",
    "{{ 7 * 7 }}{% raise %}",
    "x" * 10_000,
    "</style></title></table>",
)


class Page(HTMLParser):
    """The elements of a page, and what they say."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))

    def handle_data(self, data: str) -> None:
        self.text += data

    def all(self, *tags: str) -> list[dict[str, str]]:
        return [attributes for tag, attributes in self.elements if tag in tags]


def record(folder: Path, **changes: Any) -> Path:
    """Write a small record with some changes of its only item, and return its folder."""
    item = {
        "id": "thing/HB-01/1017h",
        "requirement": "HB-01",
        "sentence": "It beats.",
        "level": "shall",
        "source": "Thing manual, 7.2; CiA 301",
        "service": "heartbeat",
        "object": "1017h",
        "verdict": "fail",
        "expected": "100 ms",
        "actual": "110 ms",
        "unit": "ms",
        "quantity": "period",
        "deviations": [{"quantity": "period", "expected": "100 ms", "actual": "110 ms"}],
    }
    content = {
        "run": {"arguments": ["thing"], "interface": "pcan"},
        "device": {"spec": "thing", "node_id": 5, "manual": "Thing manual"},
        "items": [item | changes],
        "summary": {"verdict": "deviates"},
    }
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


@pytest.fixture
def finished(judge: Callable[..., Any]) -> Any:
    made = judge(*FAULT)
    assert made.code == 1
    return made


def test_a_run_writes_a_page_that_stands_alone(finished: Any) -> None:
    page = Page((finished.folder / "report.html").read_text("utf-8"))

    assert "report.html" in finished.out
    assert len(page.all("h1")) == len(page.all("main")) == len(page.all("header")) == 1
    assert [it["lang"] for it in page.all("html")] == ["en"]
    assert all(it["scope"] in ("col", "row", "rowgroup") for it in page.all("th"))
    links = [it.get("href") or it.get("xlink:href") or "" for it in page.all("a", "use")]
    assert links
    assert all(it.startswith("#") for it in links)
    assert not page.all("link", "img", "iframe", "object")
    assert all("src" not in it for it in page.all("script"))
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    named = [it["aria-labelledby"] for _, it in page.elements if "aria-labelledby" in it]
    wanted = {name.lstrip("#") for name in (*links, *" ".join(named).split())}
    assert wanted <= set(ids)
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch(r"h\d", tag)]
    assert all(b - a <= 1 for a, b in pairwise(levels))


def test_the_verdict_stands_at_the_top_and_deviations_come_first(finished: Any) -> None:
    text = Page((finished.folder / "report.html").read_text("utf-8")).text

    places = [
        text.index(words)
        for words in (
            "Deviates: the device does not do what its manual says",
            "A simulated device was judged, no real one.",
            "given defects on purpose: heartbeat-slow-10-percent",
            "Only a part of the items was judged",
            "HB-01 1017h/10ms",
            "write 1017h:00: 0A 00 (10)",
            "node 50: heartbeat, Pre-operational",
            "Identity, read from the node",
            "Items by service and requirement",
        )
    ]
    assert places == sorted(places)


def test_every_item_and_every_deviation_is_in_it(finished: Any) -> None:
    page = Page((finished.folder / "report.html").read_text("utf-8"))

    items = finished.record["items"]
    rows = [it for it in page.all("tr") if "data-v" in it]
    assert [it["data-v"] for it in rows].count("pass") == finished.record["summary"]["pass"]
    assert len(rows) == len(items)
    failed = [it for it in items if it["verdict"] == "fail"]
    assert [it["id"] for it in page.all("article")] == [f"deviation-{it['id']}" for it in failed]
    for item in failed:
        assert item["repro"] in page.text
        assert item["trace"] in page.text
        for deviation in item["deviations"]:
            assert deviation["actual"] in page.text
    drawn = page.all("svg")
    assert len(drawn) == len(page.all("figure")) >= 2
    assert all(it["role"] == "img" for it in drawn)


def test_the_record_alone_makes_the_same_page(
    finished: Any, command: Callable[..., Any], tmp_path: Path
) -> None:
    first = (finished.folder / "report.html").read_bytes()
    (finished.folder / "report.html").unlink()

    again = command("report", finished.folder, finished.folder / "results.json")

    assert again.code == 0
    assert (finished.folder / "report.html").read_bytes() == first
    (finished.folder / "trace.log").unlink()
    assert command("report", finished.folder).code == 0
    page = (finished.folder / "report.html").read_text("utf-8")
    assert "trace.log cannot be read" in page
    assert len(list(tmp_path.glob("record/report.html"))) == 1


@pytest.mark.parametrize("text", NASTY, ids=range(len(NASTY)))
@pytest.mark.parametrize("place", ["actual", "id", "reason", "service", "object"])
def test_what_a_device_says_is_shown_and_never_obeyed(
    text: str, place: str, tmp_path: Path
) -> None:
    deviations = [{"quantity": "x", "expected": "y", "actual": text}]
    folder = record(tmp_path, **{place: text}, deviations=deviations)
    content = json.loads((folder / "results.json").read_text("utf-8"))
    content["device"]["identity"] = {"1008h": text}
    content["device"]["serial"] = text
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")

    made = to_html(read_record(folder))

    made.encode("utf-8")
    page = Page(made)
    assert len(page.all("script")) == 1
    assert not page.all("img")
    assert len(page.all("h1")) == 1
    assert all(it.isprintable() or it == "\n" for it in made)
    assert "x" * (MOST_SHOWN + 1) not in made
    if len(text) > MOST_SHOWN:
        assert f"({len(text):,} characters)" in page.text


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ("conforms", "Conforms: the device does what its manual says"),
        ("inconclusive", "Not decided: the run does not tell"),
        ("deviates", "Deviates: the device does not do"),
    ],
)
def test_the_verdict_is_that_of_the_record(verdict: str, words: str, tmp_path: Path) -> None:
    folder = record(tmp_path, verdict="pass")
    content = json.loads((folder / "results.json").read_text("utf-8"))
    content["summary"] = {"verdict": verdict, "aborted": "the plug was pulled"}
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")

    page = Page(to_html(read_record(folder)))

    assert words in page.text
    assert "The run ended early: the plug was pulled" in page.text


@pytest.mark.parametrize(("select", "skips"), [("HB", False), ("", True)])
def test_a_part_of_the_items_conforms_as_far_as_they_go(
    select: str, skips: bool, tmp_path: Path
) -> None:
    folder = record(tmp_path, verdict="skipped" if skips else "pass", reason="no supply")
    content = json.loads((folder / "results.json").read_text("utf-8"))
    content["summary"] = {"verdict": "conforms"}
    content["run"]["select"] = select
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")

    text = Page(to_html(read_record(folder))).text

    assert "Conforms as far as it was asked" in text
    assert "the device does what its manual says" not in text


def test_what_could_not_be_decided_is_told_once_for_each_reason(tmp_path: Path) -> None:
    folder = record(tmp_path, verdict="inconclusive", reason="the node was silent")
    content = json.loads((folder / "results.json").read_text("utf-8"))
    content["items"] = [
        content["items"][0] | {"object": name, "id": f"thing/HB-01/{name}", "reason": f"{name} hid"}
        for name in (f"20{n:02X}h" for n in range(8))
    ]
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")

    text = Page(to_html(read_record(folder))).text

    assert "Not decided (8)" in text
    assert "2000h, 2001h, 2002h, 2003h, 2004h, 2005h and 2 moreit hid" in text


def test_a_page_that_cannot_be_written_gets_a_sentence(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    (record(tmp_path) / "report.html").mkdir()

    finished = command("report", tmp_path)

    assert finished.code == 2
    assert f"cannot write {tmp_path / 'report.html'}" in finished.err


def test_a_record_of_few_words_makes_a_page_too(tmp_path: Path) -> None:
    page = Page(to_html(read_record(record(tmp_path))))

    assert "the record does not hold what the manual says" in page.text
    assert "nothing was read" in page.text
    assert not page.all("figure")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "No such file or directory"),
        ("{", "expected JSON"),
        ("[]", "expected a record of a run"),
        ('{"run": {}, "device": {"spec": "x"}, "items": [], "summary": {}}', "device.node_id"),
        ('{"run": {}, "items": [{"id": 5}]}', "device: expected"),
    ],
)
def test_what_is_no_record_gets_a_sentence(
    text: str | None, words: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    if text is not None:
        (tmp_path / "results.json").write_text(text, encoding="utf-8")

    finished = command("report", tmp_path / "results.json")

    assert finished.code == 3
    assert words in finished.err
    assert finished.err.count("error:") == 1


def _places(content: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Return where in a record anything stands, of lists the first alone."""
    if place:
        yield place
    keys: Iterable[Any] = ()
    if isinstance(content, dict):
        keys = content
    elif isinstance(content, list):
        keys = range(len(content[:1]))
    for key in keys:
        yield from _places(content[key], (*place, key))


@pytest.mark.parametrize("other", [None, "x", float("nan")], ids=str)
def test_a_record_is_refused_or_makes_a_page_whatever_stands_in_it(
    other: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plots, "_svg", lambda *_: "")
    content = json.loads(
        (data("reports") / "samples/heartbeat-slow/results.json").read_text("utf-8")
    )
    content["items"] = [it for it in content["items"] if it["verdict"] == "fail"][:1]
    refused = 0
    for *above, last in list(_places(content)):
        changed = copy.deepcopy(content)
        within = changed
        for key in above:
            within = within[key]
        within[last] = other
        (tmp_path / "results.json").write_text(json.dumps(changed), encoding="utf-8")
        try:
            made = read_record(tmp_path)
        except SpecError:
            refused += 1
        else:
            assert "</html>" in to_html(made)
    assert refused


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_the_list_can_be_filtered_in_a_browser(finished: Any, tmp_path: Path) -> None:
    asked = """<script>
    const before = form.count.value;
    form.verdict.value = "fail"; form.text.value = "hb-01"; form.dispatchEvent(new Event("input"));
    document.title = `${before}, then ${form.count.value}`;
    </script></body>"""
    page = (finished.folder / "report.html").read_text("utf-8").replace("</body>", asked)
    (tmp_path / "asked.html").write_text(page, encoding="utf-8")
    arguments = ["--headless", "--no-sandbox", f"--user-data-dir={tmp_path / 'profile'}"]

    shown = subprocess.run(
        [str(CHROMIUM), *arguments, "--dump-dom", str(tmp_path / "asked.html")],
        capture_output=True,
        encoding="utf-8",
        check=True,
        timeout=120,
    ).stdout

    count = len(finished.record["items"])
    assert f"<title>{count} of {count} items, then 2 of {count} items</title>" in shown


@pytest.mark.parametrize(("acceptance", "said"), [(True, False), (False, True), (None, True)])
def test_all_but_an_acceptance_says_that_it_is_partial(
    acceptance: bool | None, said: bool, tmp_path: Path
) -> None:
    folder = record(tmp_path)
    path = folder / "results.json"
    content = json.loads(path.read_text("utf-8"))
    content["run"].pop("acceptance", None)
    if acceptance is not None:
        content["run"]["acceptance"] = acceptance
    path.write_text(json.dumps(content), encoding="utf-8")

    page = to_html(read_record(folder))

    assert ("this is no acceptance" in page) == said
    assert ('content: "partial"' in page) == said


def test_a_known_deviation_says_who_knows_it(tmp_path: Path) -> None:
    owner = "firmware: follows the <oscillator> (until 2027-03-31)"

    page = Page(to_html(read_record(record(tmp_path, verdict="fail", known=owner))))

    assert owner in page.text


SUMMED = {"pass": "conforms", "fail": "deviates", "inconclusive": "inconclusive"}


@pytest.mark.parametrize("word", SUMMED)
def test_the_page_of_a_recording_says_so_and_speaks_of_no_bench(tmp_path: Path, word: str) -> None:
    folder = record(tmp_path, verdict=word)
    path = folder / "results.json"
    content = json.loads(path.read_text("utf-8"))
    content["run"] |= {
        "bench": "recording",
        "recording": "field.asc",
        "recording_format": "Vector ASC",
        "recording_sha256": "7" * 64,
        "timestamps": {"by": "recording, origin unknown", "late_ms": 123.4},
    }
    content["summary"] = {"verdict": SUMMED[word], "complete": True}
    path.write_text(json.dumps(content), encoding="utf-8")

    text = Page(to_html(read_record(folder))).text

    assert "bench" not in text.lower()
    for told in ("field.asc", "Vector ASC", "7" * 64, "123 ms", "Device, recording and record"):
        assert told in text
    assert "Conforms: the device does what its manual says" not in text


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "0 ms"),
        (0.25, "0.25 ms"),
        (3.61, "3.6 ms"),
        (9.96, "10 ms"),
        (123.4, "123 ms"),
        (2e-5, "0.00002 ms"),
    ],
)
def test_milliseconds_have_no_exponent(value: float, words: str) -> None:
    assert milliseconds(value) == words
