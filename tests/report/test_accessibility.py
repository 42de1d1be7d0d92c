"""Every page is usable with a screen reader and poor eyes, as far as axe-core can tell, in light and dark."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import pytest
from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]  # no annotations
from playwright.sync_api import Browser, ViewportSize, sync_playwright

WIDTHS_PX = (1280, 390)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FOURTH = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"
LOT = """format: 1
part: Inclinometer
order: order 17
device: siko_ims360
level: all
size: 3
select: OD-09
simulation: {faults: {2: [wrong-identity]}}
"""

Command = Callable[..., Any]

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium, without a window."""
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


def violations(browser: Browser, page: Path) -> list[tuple[str, str, str]]:
    """Return the rules that a page breaks, all of it unfolded, each with the colour scheme and the first element.

    It is looked at light on a wide screen, and dark on one as narrow as a telephone's.
    """
    found: list[tuple[str, str, str]] = []
    schemes: tuple[Literal["light", "dark"], ...] = ("light", "dark")
    for scheme, width in zip(schemes, WIDTHS_PX, strict=True):
        shown = browser.new_page(
            color_scheme=scheme, viewport=ViewportSize(width=width, height=800)
        )
        shown.goto(page.as_uri())
        shown.eval_on_selector_all("details", "all => all.forEach(it => it.open = true)")
        broken = Axe().run(shown).response["violations"]
        found += [(scheme, it["id"], it["nodes"][0]["html"]) for it in broken]
        shown.close()
    return found


@pytest.mark.parametrize(
    ("exit_code", "arguments"),
    [
        pytest.param(0, ["--select", "HB or OD-09"], id="conforming"),
        pytest.param(
            1,
            ["--select", "HB or OD-09 or DEV-38", "--fault", "heartbeat-slow-10-percent"],
            id="deviating",
        ),
    ],
)
def test_the_report_of_a_run(
    judge: Command, browser: Browser, exit_code: int, arguments: list[str]
) -> None:
    done = judge(*arguments)
    assert done.code == exit_code, done.out
    assert violations(browser, done.folder / "report.html") == []


def test_the_report_of_a_recording(
    judge: Command, command: Command, browser: Browser, tmp_path: Path
) -> None:
    trace = judge("--select", "OD-09").folder / "trace.log"
    command("judge", trace, "--device", "siko_ims360", "--report-dir", tmp_path / "judged")
    assert violations(browser, tmp_path / "judged" / "report.html") == []


def test_the_page_of_a_lot(command: Command, browser: Browser, tmp_path: Path) -> None:
    lot = tmp_path / "lot.yaml"
    lot.write_text(LOT, encoding="utf-8")
    command("inspect", lot, "--report-dir", tmp_path / "inspected")
    assert violations(browser, tmp_path / "inspected" / "lot.html") == []


def test_the_page_of_defects(command: Command, browser: Browser, tmp_path: Path) -> None:
    spec = Path(shutil.copy(FOURTH, tmp_path / "fourth.yaml"))
    command(
        *("mutants", spec, "--only", "1018h", "--processes", "1"),
        *("--report-dir", tmp_path / "tried"),
    )
    assert violations(browser, tmp_path / "tried" / "mutants.html") == []


@pytest.mark.parametrize(
    ("html", "rule"),
    [
        ("<p style='color: #999; background: #fff'>grey", "color-contrast"),
        (
            "<details><summary>more</summary><p style='color: #999; background: #fff'>grey",
            "color-contrast",
        ),
        (
            f"<div style='overflow-x: auto; white-space: nowrap'>{'wide ' * 30}</div>",
            "scrollable-region-focusable",
        ),
    ],
)
def test_a_page_that_is_not_usable_is_seen(
    browser: Browser, tmp_path: Path, html: str, rule: str
) -> None:
    page = tmp_path / "page.html"
    page.write_text(html, encoding="utf-8")
    assert rule in {it[1] for it in violations(browser, page)}
