"""No check depends on another: in random order, on new devices and split they come to the same verdicts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

CHECKS = Path(__file__).parents[2] / "conformance" / "checks"
DEVICE = "danfoss_dst_x730"

ANEW = '''
"""Opens the bench anew before each item: a device as it left the factory, nothing observed yet."""
import pytest
from conformance.bench.session import Bench
from conformance.checks import BENCH
from conformance.session import RUN


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    config = item.config
    session = config.pluginmanager.get_plugin("conformance-session")
    old = config.stash[BENCH]
    old.close()
    run = session._run
    new = Bench.open(run.definition, run.spec, run.simulation, None)
    new.find_node()
    config.stash[BENCH] = run._bench = new
    run._leaves = None
'''

SHARES = 3
SHARE = """
def pytest_collection_modifyitems(items):
    items[:] = items[{share}::{shares}]
"""


def run_checks(folder: Path, *arguments: str) -> dict[str, str]:
    """Run the checks by pytest with further arguments and return the verdicts, in their order."""
    environment = {
        **os.environ,
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "PYTHONPATH": os.pathsep.join((str(folder), os.environ.get("PYTHONPATH", ""))),
    }
    done = subprocess.run(
        [
            *(sys.executable, "-m", "pytest", "-q", "-c", str(CHECKS / "pytest.ini")),
            *("-p", "conformance.plugin", "--device", DEVICE),
            *("-o", f"cache_dir={folder}", "--report-dir", str(folder), *arguments, str(CHECKS)),
        ],
        capture_output=True,
        encoding="utf-8",
        env=environment,
        timeout=280,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    record = json.loads((folder / "results.json").read_text("utf-8"))
    return {item["id"]: item["verdict"] for item in record["items"]}


@pytest.fixture(scope="module")
def in_order(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The verdicts in the order of the modules."""
    return run_checks(tmp_path_factory.mktemp("in_order"))


def test_the_order_changes_no_verdict(in_order: dict[str, str], tmp_path: Path) -> None:
    shuffled = run_checks(tmp_path, "-p", "pytest_randomly", "--randomly-seed=1")

    assert list(shuffled) != list(in_order)
    assert shuffled == in_order


def test_each_item_on_its_own_comes_to_its_verdict(
    in_order: dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / "anew.py").write_text(ANEW, encoding="utf-8")

    assert run_checks(tmp_path, "-p", "anew") == in_order


def test_items_split_over_processes_come_to_their_verdicts(
    in_order: dict[str, str], tmp_path: Path
) -> None:
    def run_share(share: int) -> dict[str, str]:
        folder = tmp_path / str(share)
        folder.mkdir()
        plugin = SHARE.format(share=share, shares=SHARES)
        (folder / "share_of_items.py").write_text(plugin, encoding="utf-8")
        return run_checks(folder, "-p", "share_of_items")

    with ThreadPoolExecutor() as pool:
        shares = list(pool.map(run_share, range(SHARES)))

    assert sum(map(len, shares)) == len(in_order)
    assert {item: word for share in shares for item, word in share.items()} == in_order


def test_an_installed_pytest_randomly_does_not_disturb_a_run(judge: Callable[..., Any]) -> None:
    assert find_spec("pytest_randomly") is not None

    ids = [
        [item["id"] for item in judge("--select", "NMT-01 or HB").record["items"]] for _ in range(2)
    ]

    assert ids[0] == ids[1]
    assert ids[0] == sorted(ids[0], key=lambda item: "/NMT-" in item)
