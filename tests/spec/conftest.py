"""A small complete spec without a mistake, and the means to change one thing in it.

A line that a test changes carries a mark, a comment ``#1``, ``#2``, …; an expected sentence names it as ``L1``.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import pytest

from conformance.spec.load import SpecFile, find_problems, load_spec

Edit: TypeAlias = tuple[str, str]
Edited: TypeAlias = Callable[..., str]
Problems: TypeAlias = Callable[[str], list[str]]
Loaded: TypeAlias = Callable[[str], SpecFile]
Complains: TypeAlias = Callable[..., None]

GOOD = """\
format: 1
device: {vendor: Nobody, name: Tilt, profile: 410}
manual: {title: Tilt manual, revision: "3", date: 2025-05-15}
factory: {node_id: 0x0A, bitrate: 125000, source: "1"}
variants:
  one: {title: One axis, source: "1"}
  two: {title: Two axes, source: "1"}
services:
  nmt: {source: "2"}
  heartbeat_producer:
    object: 0x1017
    min_ms: 10
    max_ms: 65535
    states: [pre-operational, operational, stopped]
    source: "2"
  emcy_producer:
    object: 0x1014
    error_register: 0x1001
    states: [operational]
    codes: {0x5010: Out of range}
    register_bits: {0: Any error}
    source: "2"
  tpdo:
    count: 1
    max_mapped: 3
    transmission_types: [[1, 240], [254, 255]]
    map_only_while: [disabled]
    source: "2"
  store:
    object: 0x1010
    signature: save
    groups: {1: [[0x1000, 0x9FFF]]}
    source: "2"
objects:
  0x1000:
    name: Device type
    type: UNSIGNED32
    access: ro
    kind: identity
    default: {one: 0x0003019A, two: 0x0004019A}
    source: "3"
  0x1001: {name: Error register, type: UNSIGNED8, access: ro, kind: live, default: 0, source: "3"}
  0x1008:
    name: Device name
    type: VISIBLE_STRING
    access: const
    kind: identity
    default: TILT
    octets: [4, 8]
    source: "3"
  0x1010:
    name: Store
    source: "3"
    subs:
      0: {name: Highest sub-index, type: UNSIGNED8, access: const, kind: constant, default: 1}
      1: {name: All, type: UNSIGNED32, access: rw, kind: command, default: 1}
  0x1014: {name: COB-ID EMCY, type: UNSIGNED32, access: rw, kind: config, default: "0x80 + NODEID", source: "3"}
  0x1017:
    name: Heartbeat time
    type: UNSIGNED16
    access: rw
    kind: config
    default: 0
    ranges: [[0, 0], [10, 65535]]
    source: "3"
  0x1800:
    name: TPDO1 communication
    source: "3"
    subs:
      0: {name: Highest sub-index, type: UNSIGNED8, access: const, kind: constant, default: 2}
      1: {name: COB-ID, type: UNSIGNED32, access: rw, kind: config, default: "0x180 + NODEID"}
      2: {name: Type, type: UNSIGNED8, access: rw, kind: config, default: 254}
  0x1A00:
    name: TPDO1 mapping
    source: "3"
    subs:
      0: {name: Count, type: UNSIGNED8, access: rw, kind: config, default: 3}
      1: {name: First, type: UNSIGNED32, access: rw, kind: config, default: 0x60100010}
      2: {name: Second, type: UNSIGNED32, access: rw, kind: config, default: 0x60110020}
      3: {name: Third, type: UNSIGNED32, access: rw, kind: config, default: 0}
  0x2000:
    name: Filter
    type: UNSIGNED8
    access: rw
    kind: config
    default: 1
    values: {0: "Off", 1: Slow, 2: Fast}
    source: "3"
  0x2001:
    name: Cut-off
    type: UNSIGNED16
    access: rw
    kind: config
    default: 50
    limits_by:
      object: "0x2000"
      ranges:
        1: [[10, 100]]
        2: [[10, 1000]]
      source: "3"
    source: "3"
  0x2002: {name: Zero, type: UNSIGNED8, access: wo, kind: command, values: {1: X}, affects: [0x6010], source: "3"}
  0x2003:
    name: Second axis
    type: INTEGER16
    access: rw
    kind: config
    variants: [two]
    source: "3"
    sources: {kind: "4"}
  0x6010: {name: Tilt X, type: INTEGER16, access: ro, kind: live, mappable: true, source: "3"}
  0x6011: {name: Tilt X fine, type: INTEGER32, access: ro, kind: live, mappable: true, source: "3"}
  0x6012: {name: Tilt X text, type: VISIBLE_STRING, access: ro, kind: live, source: "3"}
  0x6013: {name: Hidden, type: INTEGER16, access: ro, kind: live, mappable: false, source: "3"}
ambiguities:
  - id: T-01
    source: ["3"]
    what: The default of the filter.
    readings:
      - says: Slow.
      - says: Fast.
        changes: {objects/0x2000/default: 2}
    judged_by: either
  - id: T-02
    source: ["3"]
    what: The longest heartbeat time.
    readings:
      - says: Up to 65535 ms.
      - says: Up to 30000 ms.
        changes:
          objects/0x1017/ranges: [[0, 0], [10, 30000]]
          services/heartbeat_producer/max_ms: 30000
    judged_by: 2
"""


def changed(text: str, *edits: Edit) -> str:
    for old, new in edits:
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in the good spec"
        text = text.replace(old, new)
    return text


def with_lines(sentence: str, text: str) -> str:
    """Put the file and the line of a mark in the place of ``L1: ``."""

    def place(found: re.Match[str]) -> str:
        lines = text.split("\n")
        line = next(n for n, t in enumerate(lines, 1) if re.search(rf"#{found[1]}\b", t))
        return f"spec.yaml:{line}: "

    return re.sub(r"^L(\d+): ", place, sentence)


@pytest.fixture(scope="session")
def good() -> str:
    """The text of the good spec."""
    return GOOD


@pytest.fixture
def edited() -> Edited:
    """The good spec after some replacements ``(old, new)``."""
    return lambda *edits: changed(GOOD, *edits)


@pytest.fixture
def problems(tmp_path: Path) -> Problems:
    """The sentences on a spec, as the command line prints them, without the folder."""

    def find(text: str) -> list[str]:
        path = tmp_path / "spec.yaml"
        path.write_text(text, encoding="utf-8", newline="")
        return [str(p).removeprefix(f"{tmp_path}{os.sep}") for p in find_problems(path)[1]]

    return find


@pytest.fixture
def complains(problems: Problems) -> Complains:
    """Asserts that the good spec after some replacements gets these sentences and no others."""

    def check(edits: Edit | list[Edit], *sentences: str) -> None:
        text = changed(GOOD, *(edits if isinstance(edits, list) else [edits]))
        expected = "\n".join(with_lines(sentence, text) for sentence in sentences)
        assert "\n".join(problems(text)) == expected

    return check


@pytest.fixture
def loaded(tmp_path: Path) -> Loaded:
    """The spec in a text."""

    def load(text: str) -> SpecFile:
        path = tmp_path / "spec.yaml"
        path.write_text(text, encoding="utf-8", newline="")
        return load_spec(path)

    return load
