"""Writes the confirmed deviations of devices that nobody here wrote to `reports/samples`.

By hand: `make samples`. A requirement that fails and is not in `confirmed.yaml` ends it: read the
frames and the standard first, then enter what they say, or mend the check.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Any

from conformance.resources import data
from conformance.spec.yaml_reader import read_yaml

FOLDER = Path(__file__).parent
CONFIRMED = FOLDER / "confirmed.yaml"
LIBRARIES = {"durand_node": "durand", "local_node": "canopen"}
"""What each device is made with, by its distribution."""
TITLES = {
    "durand_node": "a node made with durand",
    "local_node": "a node made with python-canopen's LocalNode",
}
SECTION = re.compile(r"^## (\S+) .*?^Items \(\d+\): (.*?)$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Judged:
    """A run of the suite against a device.

    Args:
        code: Its exit code.
        printed: What a user saw of it.
        folder: Its record.
    """

    code: int
    printed: str
    folder: Path

    @property
    def record(self) -> dict[str, Any]:
        made: dict[str, Any] = json.loads((self.folder / "results.json").read_text("utf-8"))
        return made

    def items(self, verdict: str) -> list[dict[str, Any]]:
        return [item for item in self.record["items"] if item["verdict"] == verdict]


def judge(device: str, folder: Path, *arguments: str) -> Judged:
    """Run the suite against a device, in a process of its own."""
    command = [sys.executable, str(FOLDER / "judge_device.py"), device, *arguments]
    ended = subprocess.run(
        [*command, "--report-dir", str(folder)],
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
    )
    return Judged(ended.returncode, ended.stdout + ended.stderr, folder)


def document_of(device: str) -> Path:
    """Return the file that lists a device's deviations."""
    return data("reports") / "samples" / f"independent-{device.replace('_', '-')}.md"


def listed(device: str) -> dict[str, set[str]]:
    """Return the items that a device's document lists, by their requirement."""
    text = document_of(device).read_text("utf-8")
    return {requirement: set(line.split(", ")) for requirement, line in SECTION.findall(text)}


def write(device: str, judged: Judged) -> str:
    """Return the document of a device."""
    return "\n".join(_lines(device, judged)) + "\n"


def _lines(device: str, judged: Judged) -> Iterator[str]:
    confirmed = read_yaml(CONFIRMED).data
    failed: dict[str, list[dict[str, Any]]] = {}
    for item in judged.items("fail"):
        failed.setdefault(item["requirement"], []).append(item)
    unread = sorted(failed.keys() - confirmed[device].keys())
    if unread:
        raise SystemExit(f"{device}: nobody has read the frames of {', '.join(unread)}")
    trace = (judged.folder / "trace.log").read_text("ascii").splitlines()
    used = [LIBRARIES[device], "python-can"]
    versions = ", ".join(f"{name} {version(name)}" for name in used)
    yield f"# Deviations of {TITLES[device]}"
    yield ""
    yield f"{versions}. Held against the EDS that the library makes of the node."
    yield f"{len(judged.items('fail'))} of {len(judged.record['items'])} items fail; each has been confirmed by reading the frames and the standard."
    yield "What the library leaves to its user is the node's all the same. Written by `make samples`."
    for requirement, items in failed.items():
        first = items[0]
        yield ""
        yield f"## {requirement} ({first['level']})"
        yield ""
        yield f"{first['sentence']} {first['source']}."
        yield ""
        yield f"Demanded: {confirmed['demands'][requirement]}"
        yield ""
        yield f"Seen: {confirmed[device][requirement]['seen']}"
        yield ""
        yield f"Items ({len(items)}): {', '.join(item['object'] for item in items)}"
        yield ""
        yield "```"
        yield from _frames(first, trace, *confirmed[device][requirement]["frames"])
        yield "```"


def _frames(item: dict[str, Any], trace: list[str], *wanted: str | int) -> Iterator[str]:
    first, last = map(int, item["trace"].removeprefix("trace.log:").split("-"))
    lines = iter(trace[first - 1 : last])
    for begin, count in zip(wanted[::2], wanted[1::2], strict=True):
        found = (line for line in lines if line.split()[2].startswith(str(begin)))
        yield next(found)
        yield from islice(lines, int(count) - 1)


def main() -> None:
    """Write the documents of all devices."""
    for device in LIBRARIES:
        with tempfile.TemporaryDirectory() as folder:
            judged = judge(device, Path(folder))
            if judged.code != 1:
                raise SystemExit(judged.printed)
            document_of(device).write_text(write(device, judged), encoding="utf-8")


if __name__ == "__main__":
    main()
