"""What a report says of the manual: statements shown, readings followed, figures plotted."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from conformance.report.plots import plots
from conformance.report.readings_words import followed
from conformance.report.record import Record, ResponseTimes, read_record
from conformance.report.results import Item
from conformance.report.shown_statements import coverage

NONE = ResponseTimes()


def item(requirement: str, place: str, verdict: Any, **more: Any) -> dict[str, Any]:
    return {
        "id": f"thing/{requirement}/{place}",
        "requirement": requirement,
        "sentence": "",
        "level": "manual",
        "source": "",
        "service": more.pop("service", "sdo"),
        "object": place,
        "verdict": verdict,
        "reason": "no supply" if verdict in ("skipped", "inconclusive") else "",
        **more,
    }


def record(
    folder: Path, items: list[dict[str, Any]], select: str = "", recording: str = "", **manual: Any
) -> Record:
    content = {
        "run": {"select": select, "recording": recording},
        "device": {"spec": "thing", "node_id": 5},
        "items": items,
        "summary": {"verdict": "conforms"},
        "manual": {"statements_missing": "", **manual},
    }
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")
    return read_record(folder)


def statement(**more: Any) -> dict[str, Any]:
    return {"id": "S-001", "source": "7.2", "says": "It reads.", **more}


@pytest.mark.parametrize(
    ("verdicts", "fate"),
    [
        (["pass", "pass"], "shown"),
        (["pass", "fail"], "deviates"),
        (["pass", "inconclusive"], "open"),
        (["pass", "skipped"], "open"),
        (["pass", "not_applicable"], "shown"),
        (["not_applicable"], "not_asked"),
        ([], "not_asked"),
    ],
)
def test_a_statement_is_shown_when_all_that_verifies_it_passed(
    verdicts: list[str], fate: str, tmp_path: Path
) -> None:
    items = [item("OD-01", f"case {n}", verdict) for n, verdict in enumerate(verdicts)]

    made = coverage(record(tmp_path, items, statements=[statement(verified_by=["OD-01"])]))

    assert [it.fate for it in made.told] == [fate]
    assert sum(made.counts.values()) == 1


@pytest.mark.parametrize(
    ("more", "fate", "why"),
    [
        ({"because": "an advertisement"}, "invisible", "an advertisement"),
        ({"needs": "stimulus"}, "needs", "needs stimulus"),
        ({"open": "nobody asks"}, "no_check", "nobody asks"),
    ],
)
def test_of_what_nothing_verifies_the_reason_is_told(
    more: dict[str, str], fate: str, why: str, tmp_path: Path
) -> None:
    (told,) = coverage(record(tmp_path, [], statements=[statement(**more)])).told

    assert (told.fate, told.why) == (fate, why)


def test_a_deviation_at_another_object_says_nothing_of_a_statement(tmp_path: Path) -> None:
    items = [item("OD-01", "1017h", "fail"), item("OD-01", "1018h:01", "pass")]
    said = [statement(verified_by=["OD-01"], objects=["1018h"])]

    assert coverage(record(tmp_path, items, statements=said)).told[0].fate == "shown"


@pytest.mark.parametrize(
    ("verdicts", "fate"),
    [
        (["pass", "pass"], "shown"),
        (["pass", "not_applicable"], "open"),
        (["not_applicable"], "not_asked"),
    ],
)
def test_a_recording_of_some_cases_shows_a_statement_in_part(
    verdicts: list[str], fate: str, tmp_path: Path
) -> None:
    items = [item("OD-01", f"case {n}", verdict) for n, verdict in enumerate(verdicts)]
    said = [statement(verified_by=["OD-01"])]

    (told,) = coverage(record(tmp_path, items, recording="a.log", statements=said)).told

    assert told.fate == fate


@pytest.mark.parametrize(("select", "fate"), [("", "shown"), ("1017h", "not_asked")])
def test_a_part_of_a_run_shows_nothing_of_objects_that_are_not_in_it(
    select: str, fate: str, tmp_path: Path
) -> None:
    items = [item("OD-01", "1017h", "pass")]
    said = [statement(verified_by=["OD-01"], objects=["1018h"])]

    assert coverage(record(tmp_path, items, select, statements=said)).told[0].fate == fate


def test_the_reading_that_a_device_follows_comes_with_the_items_that_show_it(
    tmp_path: Path,
) -> None:
    items = [
        item("OD-01", "1", "pass", readings={"X-02": 2, "X-09": 1}),
        item("OD-01", "2", "pass", readings={"X-02": 1}),
    ]
    places = [
        {"id": name, "source": ["7"], "what": "?", "readings": ["a", "b"]}
        for name in ("X-01", "X-02")
    ]

    found = followed(record(tmp_path, items, ambiguities=places))

    assert [it.place.id for it in found] == ["X-02", "X-09", "X-01"]
    assert found[0].shown_by == {1: ["thing/OD-01/2"], 2: ["thing/OD-01/1"]}
    assert found[1].place.readings == ["reading 1"]
    assert found[2].shown_by == {}


def measured(service: str, unit: str, values: list[float], **limits: float | None) -> Item:
    figures = {"least": 90.0, "nominal": 100.0, "most": 110.0} | limits
    told = {"quantity": "x", "unit": unit, "values": values, **figures}
    return Item(**item("HB-01", "1017h", "fail", service=service, measurements=(told,)))


def test_a_plot_has_its_figures_as_words_and_no_colour_of_its_own() -> None:
    (plot,) = plots([measured("heartbeat", "ms", [99.0, 100.0, 250.0])], NONE)

    assert plot.id == "heartbeats"
    assert plot.rows == [("HB-01/1017h", "3", "90 ms", "110 ms", "99 ms", "149.667 ms", "250 ms")]
    assert "HB-01/1017h: 100 ms ± 10 ms" in plot.svg
    assert "var(--bad)" in plot.svg
    assert "#010101" not in plot.svg
    HTMLParser().feed(plot.svg)
    assert plots([measured("heartbeat", "ms", [99.0, 100.0, 250.0])], NONE) == [plot]


@pytest.mark.parametrize(
    "made",
    [
        measured("heartbeat", "ms", [100.0]),
        measured("heartbeat", "ms", [100.0] * 5, least=None),
        measured("heartbeat", "ms", []),
        measured("heartbeat", "ms", [100.0, 100.0, float("nan")]),
        measured("heartbeat", "ms", [100.0] * 5, most=float("inf")),
        measured("filters", "s", [1.0]),
        measured("heartbeat", "ms", [100.0] * 5, least=100.0, most=100.0),
    ],
)
def test_what_has_no_limits_or_too_few_figures_is_not_plotted(made: Item) -> None:
    assert plots([made], NONE) == []


def test_values_and_response_times_have_plots_of_their_own() -> None:
    times = ResponseTimes(
        transfers=120,
        median_ms=2.0,
        p99_ms=3.0,
        max_ms=3.0,
        max_object="1008h:00",
        histogram=[(2.239, 119), (2.512, 0), (2.818, 0), (3.162, 1)],
    )

    made = plots([measured("slope", "deg", [101.0])], times)

    assert [it.id for it in made] == ["values-deg", "sdo-response-times"]
    assert made[1].rows == [("1.996 to 2.239 ms", "119"), ("2.818 to 3.162 ms", "1")]
    assert "median 2.0 ms" in made[1].words
