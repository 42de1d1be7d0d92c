"""JUnit as programs of CI read it: by Jenkins's rules, in one suite or one per service."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import typer.main
import xmlschema
from junitparser import Failure, JUnitXml
from ruamel.yaml import YAML

from conformance.cli import app
from conformance.report.junit import to_junit
from conformance.report.results import Item, Results
from conformance.resources import data

SCHEMA = xmlschema.XMLSchema(Path(__file__).with_name("junit.xsd"))
ITEM = Item(
    id="d/HB-01/1017h",
    requirement="HB-01",
    sentence="A rule.",
    level="shall",
    source="a manual, 1.2",
    service="heartbeat",
    object="1017h",
    verdict="fail",
    quantity="period",
    expected="100 ms",
    actual="110 ms",
    deviations=({"quantity": "period", "expected": "100 ms", "actual": "110 ms"},),
    duration_s=0.000005,
)


def _properties(suite: Any) -> dict[str, str]:
    return {it.name: it.value for it in suite.properties()}


def test_each_service_has_a_suite_of_its_own_where_asked_for(judge: Callable[..., Any]) -> None:
    selected = ("--select", "HB-01 or BOOT-01", "--fault", "heartbeat-slow-10-percent")
    finished = judge("--junit-suites", "service", "--serial", "4711", *selected)

    path = finished.folder / "junit.xml"
    SCHEMA.validate(path)
    suites = list(JUnitXml.fromfile(str(path)))
    assert [it.name for it in suites] == ["siko_ims360 4711 boot_up", "siko_ims360 4711 heartbeat"]
    assert [it.failures for it in suites] == [0, 2]
    record = finished.record
    for suite in suites:
        properties = _properties(suite)
        assert properties["serial"] == "4711"
        assert properties["spec_sha256"] == record["run"]["spec_sha256"]
        assert properties["firmware_version"] == record["device"]["identity"]["100Ah"]


def test_a_failure_tells_what_an_engineer_needs(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "HB-01", "--fault", "heartbeat-slow-10-percent")

    path = finished.folder / "junit.xml"
    SCHEMA.validate(path)
    (suite,) = JUnitXml.fromfile(str(path))
    failure = next(it.result[0] for it in suite if it.result)
    assert isinstance(failure, Failure)
    for words in ("expected", "actual", "IMS360 CANopen user manual", "again", "frames"):
        assert words in failure.text
    assert "came 732h 7F" in failure.text


def test_a_run_of_which_nothing_came_is_a_report_as_well() -> None:
    empty = Results({"suite": "1"}, {"spec": "d"}, aborted="no bus")

    SCHEMA.validate(to_junit(empty))
    SCHEMA.validate(to_junit(empty, suites="service"))


@pytest.mark.parametrize("text", ["\x00\x1b", "<![CDATA[ ]]> & \"'", "\ud800", "x" * 10_000])
def test_what_a_device_says_keeps_a_report_legal(text: str) -> None:
    results = Results({"note": text}, {"spec": "d", "identity": {"100Ah": text}})
    results.items = [
        replace(ITEM, actual=text, deviations=({**ITEM.deviations[0], "actual": text},))
    ]

    made = to_junit(results)

    SCHEMA.validate(made)
    assert 'time="0.000005"' in made
    (suite,) = JUnitXml.fromstring(made)
    assert suite.failures == 1


@pytest.mark.parametrize(
    ("name", "schema"), [("github", "vendor.github-workflows"), ("gitlab", "vendor.gitlab-ci")]
)
def test_an_example_for_ci_is_one(name: str, schema: str) -> None:
    path = data("fixtures/ci") / f"{name}.yml"

    checked = subprocess.run(
        [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, str(path)],
        capture_output=True,
        text=True,
        check=False,
    )

    assert checked.returncode == 0, checked.stdout


@pytest.mark.parametrize("name", ["github", "gitlab"])
def test_an_example_for_ci_names_commands_and_options_that_exist(name: str) -> None:
    group = typer.main.get_command(app)
    named = list(_commands(YAML(typ="safe").load(data("fixtures/ci") / f"{name}.yml")))
    assert named
    for _, command, *arguments in named:
        known = {option for it in group.commands[command].params for option in it.opts}  # type: ignore[attr-defined]  # typer's group has them
        assert {it for it in arguments if it.startswith("--")} <= known


def _commands(content: Any) -> Any:
    if isinstance(content, dict | list):
        for part in content.values() if isinstance(content, dict) else content:
            yield from _commands(part)
    elif isinstance(content, str) and content.startswith("canopen-conformance "):
        yield shlex.split(content)
