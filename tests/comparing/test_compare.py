"""Two runs side by side: what deviates anew, what is known, what changed beyond noise."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from conformance.comparing.baseline import Baseline, KnownDeviation, load_baseline, write_baseline
from conformance.comparing.comparison import Comparison, compare
from conformance.comparing.measured import shifts
from conformance.comparing.page import to_json, to_markdown
from conformance.errors import SpecError
from conformance.report.record import Record, read_record

TODAY = date(2026, 6, 1)
KNOWN = KnownDeviation(item="x/A-01", owner="me", reason="later", expires="2026-06-01")


@pytest.fixture
def made(tmp_path: Path) -> Callable[..., Record]:
    """Write a record and read it back: item to verdict, the rest as given."""

    def write(
        verdicts: Mapping[str, str], *, run: Mapping[str, Any] | None = None, **more: Any
    ) -> Record:
        item = {"sentence": "", "level": "manual", "source": "", "service": "s", "object": ""}
        measured = more.pop("measured", {})
        content = {
            "run": run or {},
            "device": {"spec": more.pop("spec", "x"), "variant": "v", "node_id": 1},
            "items": [
                item
                | {"id": f"x/{name}", "requirement": name, "verdict": verdict, "actual": "7"}
                | {"measurements": measured.get(name, [])}
                for name, verdict in verdicts.items()
            ],
            "summary": {"verdict": "conforms"} | more,
        }
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.json"
        path.write_text(json.dumps(content), encoding="utf-8")
        return read_record(path)

    return write


def _ids(comparison: Comparison, name: str) -> list[str]:
    return [it.id for it in getattr(comparison, name)]


@pytest.mark.parametrize(
    ("before", "after", "where", "code"),
    [
        ("pass", "fail", "new", 1),
        ("skipped", "fail", "new", 1),
        ("inconclusive", "fail", "new", 1),
        (None, "fail", "new", 1),
        ("fail", "fail", "unchanged", 0),
        ("fail", "pass", "fixed", 0),
        ("fail", "inconclusive", "gone", 0),
        ("fail", "skipped", "gone", 0),
        ("fail", None, "gone", 0),
        ("pass", "inconclusive", "open", 2),
        (None, "inconclusive", "open", 2),
    ],
)
def test_each_item_has_its_place(
    made: Callable[..., Record], before: str | None, after: str | None, where: str, code: int
) -> None:
    old = {"A-02": "pass"} | ({"A-01": before} if before else {})
    new = {"A-02": "pass"} | ({"A-01": after} if after else {})

    comparison = compare(made(old), made(new))

    places = ("new", "known", "unchanged", "fixed", "gone", "open")
    assert [it for it in places if _ids(comparison, it)] == [where]
    assert _ids(comparison, where) == ["x/A-01"]
    assert comparison.exit_code == code


def test_a_remark_is_no_new_deviation(made: Callable[..., Record]) -> None:
    before, after = made({"A-01": "pass"}), made({"A-01": "fail"})
    text = after.path.read_text("utf-8").replace('"manual"', '"should"')
    after.path.write_text(text, encoding="utf-8")

    assert compare(before, read_record(after.path)).exit_code == 0
    after.path.write_text(text.replace('"run": {}', '"run": {"strict": true}'), encoding="utf-8")
    assert compare(before, read_record(after.path)).exit_code == 1


def test_what_an_early_end_leaves_open_cannot_be_told(made: Callable[..., Record]) -> None:
    whole, part = {"A-01": "pass", "A-02": "fail"}, {"A-01": "pass"}

    assert compare(made(part, complete=False), made(whole)).exit_code == 2
    assert compare(made(whole), made(part, complete=False)).exit_code == 2
    assert compare(made(whole), made(part, aborted="cable off")).exit_code == 2
    assert compare(made(whole, complete=False), made(part)).exit_code == 0
    assert compare(made(whole), made(whole, illegal="it sent 3 of them")).exit_code == 2
    assert compare(made(whole), made({"A-01": "skipped"})).exit_code == 2
    new = {"A-01": "fail", "A-02": "fail"}
    assert compare(made(whole), made(new, complete=False)).exit_code == 1


def test_other_conditions_are_told(made: Callable[..., Record]) -> None:
    before = made({"A-01": "pass"}, run={"suite": "0.1.0", "spec_sha256": "a"})
    after = made({"A-01": "pass"}, run={"suite": "0.2.0", "spec_sha256": "b"})

    settings = compare(before, after).settings

    assert settings == (("suite", "0.1.0", "0.2.0"), ("hash of the spec", "a", "b"))


def test_runs_of_two_devices_are_not_compared(made: Callable[..., Record]) -> None:
    with pytest.raises(SpecError, match="a run of x, got one of y"):
        compare(made({"A-01": "pass"}), made({"A-01": "pass"}, spec="y"))


def test_what_is_known_is_not_new_until_it_expires(made: Callable[..., Record]) -> None:
    passing, failing = made({"A-01": "pass"}), made({"A-01": "fail"})
    baseline = Baseline({KNOWN.item: KNOWN}, TODAY)
    later = Baseline({KNOWN.item: KNOWN}, date(2026, 6, 2))

    known = compare(passing, failing, baseline)
    assert (_ids(known, "new"), _ids(known, "known"), known.exit_code) == ([], ["x/A-01"], 0)
    for before in (passing, failing):
        expired = compare(before, failing, later)
        assert (_ids(expired, "new"), expired.expired, expired.exit_code) == (
            ["x/A-01"],
            (KNOWN,),
            1,
        )
        assert not expired.unchanged
    assert compare(failing, passing, baseline).no_longer == (KNOWN,)


@pytest.mark.parametrize(
    ("before", "after", "late_ms", "seen"),
    [
        ([100.0, 101.0], [104.0, 105.0], 0.0, True),
        ([100.0, 101.0], [101.5, 102.5], 0.0, False),
        ([100.0, 101.0], [100.5, 105.0], 0.0, False),
        ([100.0], [101.0], 0.0, True),
        ([100.0], [101.0], 0.5, False),
        ([100.0], [101.1], 0.5, True),
        ([100.0], [100.00001], 0.0, False),
    ],
)
def test_a_figure_changed_where_a_gap_is_wider_than_noise(
    made: Callable[..., Record], before: list[float], after: list[float], late_ms: float, seen: bool
) -> None:
    old, new = (
        made(
            {"A-01": "pass"},
            run={"timestamps": {"late_ms": late_ms}},
            measured={"A-01": [{"quantity": "period", "unit": "ms", "values": values}]},
        )
        for values in (before, after)
    )

    assert bool(list(shifts(old, new))) is seen


def test_slower_answers_are_seen(made: Callable[..., Record]) -> None:
    runs = [
        made({}, run={"sdo_response_times": {"median_ms": median, "p99_ms": 5.0}})
        for median in (2.0, 2.4, 3.0)
    ]

    assert not list(shifts(runs[0], runs[1]))
    (found,) = shifts(runs[0], runs[2])
    assert found.quantity == "SDO response time, median"


def test_markdown_and_json_hold_what_was_found(made: Callable[..., Record]) -> None:
    comparison = compare(made({"A-01": "pass"}), made({"A-01": "fail"}))
    object.__setattr__(comparison.new[0], "actual", "a|b\n<script> @all")

    page = to_markdown(comparison)
    assert page.startswith("## 1 new deviations")
    assert "a\\|b\\\\x0a\\<script\\> \\@all" in page
    content = json.loads(to_json(comparison))
    assert content["exit_code"] == 1
    assert content["new"][0]["id"] == "x/A-01"


GOOD = """format: 1
deviations:
  - item: x/A-01
    owner: me
    reason: later
    expires: 2026-06-01
"""


def test_a_baseline_is_read(tmp_path: Path) -> None:
    path = tmp_path / "known.yaml"
    path.write_text(GOOD)

    baseline = load_baseline(path, TODAY)

    assert baseline.entries == {"x/A-01": KNOWN}
    assert baseline.known("x/A-01") == "me: later (until 2026-06-01)"
    assert baseline.known("x/A-02") == ""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("owner: me", 'owner: ""', ":4: deviations.0.owner: expected at least 1"),
        ("reason: later", 'reason: " "', ":5: deviations.0.reason: expected at least 1"),
        ("2026-06-01", "soon", ":6: deviations.0.expires: expected a date such as"),
        ("    owner: me\n", "", "deviations.0.owner: expected this key, got nothing"),
        ("owner: me", "ownr: me", "expected a known key, got 'ownr' (did you mean 'owner'?)"),
        ("format: 1", "format: 2", ":1: format: expected 1, got 2"),
        ("  - item", GOOD.partition(":\n")[2] + "  - item", "expected each item once"),
        (GOOD, "", "expected a baseline, got an empty file"),
    ],
)
def test_a_mistake_in_a_baseline_is_told_with_its_place(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "known.yaml"
    path.write_text(GOOD.replace(old, new, 1))

    with pytest.raises(SpecError, match=re.escape(message)):
        load_baseline(path, TODAY)


def test_a_written_baseline_waits_for_its_owner(tmp_path: Path) -> None:
    path = tmp_path / "known.yaml"
    write_baseline(path, ["x/A-01"], TODAY)

    with pytest.raises(SpecError, match="owner: expected at least 1"):
        load_baseline(path, TODAY)
    path.write_text(path.read_text("utf-8").replace('""', '"me"'))
    assert load_baseline(path, TODAY).entries["x/A-01"].expires == "2026-08-30"
    with pytest.raises(SpecError, match="expected a new file"):
        write_baseline(path, [], TODAY)


def test_an_empty_baseline_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "known.yaml"
    write_baseline(path, [], TODAY)

    assert load_baseline(path, TODAY).entries == {}


def test_the_command_compares_two_runs(command: Callable[..., Any], tmp_path: Path) -> None:
    for name, fault in (("a", ()), ("b", ("--fault", "heartbeat-slow-10-percent"))):
        folder = ("--report-dir", tmp_path / name)
        command("run", "siko_ims360", "--select", "HB-01", *folder, *fault)

    finished = command("compare", tmp_path / "a", tmp_path / "b", "--write-baseline", "known.yaml")

    assert finished.code == 1
    assert "New deviations: 2" in finished.out
    assert "2 new deviations" in finished.out
    path = tmp_path / "known.yaml"
    refused = command("compare", tmp_path / "a", tmp_path / "b", "--baseline", path)
    assert refused.code == 3
    text = path.read_text("utf-8").replace('""', '"us"')
    path.write_text(re.sub(r"\d{4}-\d\d-\d\d", "9999-12-31", text), encoding="utf-8")
    known = command("compare", tmp_path / "a", tmp_path / "b", "--baseline", path)
    assert known.code == 0
    assert "no new deviation, 2 in the baseline" in known.out
