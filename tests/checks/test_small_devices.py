"""Devices that offer as little as CiA 301 lets them, or something in an unusual way, are judged as they are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

HEAD = """\
format: 1
device: {vendor: Nobody, name: Small}
manual: {title: Small manual}
factory: {node_id: 127, bitrate: 20000, source: "1"}
variants: {only: {title: The only one, source: "1"}}
services:
  nmt: {source: "1"}
"""
MANDATORY = """\
objects:
  0x1000: {name: Device type, type: UNSIGNED32, access: ro, kind: identity, default: 0, source: "2"}
  0x1001: {name: Error register, type: UNSIGNED8, access: ro, kind: live, source: "2"}
  0x1018:
    name: Identity
    source: "2"
    subs:
      0: {name: Highest sub-index, type: UNSIGNED8, access: ro, kind: constant, default: 1}
      1: {name: Vendor-ID, type: UNSIGNED32, access: ro, kind: identity, default: 5}
"""
GUARDING = """\
  0x100C: {name: Guard time, type: UNSIGNED16, access: rw, kind: config, default: 0, source: "2"}
  0x100D: {name: Life time factor, type: UNSIGNED8, access: rw, kind: config, default: 0, source: "2"}
"""
LONG = "".join(chr(ord("A") + n % 26) for n in range(1500))
TEXTS = f"""\
  0x1008: {{name: Name, type: VISIBLE_STRING, access: const, kind: identity, default: {LONG}, source: "2"}}
  0x1009: {{name: Version, type: VISIBLE_STRING, access: const, kind: identity, octets: [3000, 9000], source: "2"}}
  0x2000: {{name: Text, type: VISIBLE_STRING, access: rw, kind: config, default: {LONG}, source: "2"}}
  0x2001: {{name: Block, type: DOMAIN, access: rw, kind: config, default: "", source: "2"}}
"""
TPDO = "tpdo: {count: 4, max_mapped: 2, transmission_types: [[0, 240], [254, 255]], map_only_while: [], source: '1'}"
SYNC = "  sync_consumer: {source: '1'}\n"
MAPPED = """\
  0x2100:
    name: Values
    source: "2"
    subs:
      0: {name: Highest sub-index, type: UNSIGNED8, access: const, kind: constant, default: 4}
      1: {name: A, type: REAL32, access: ro, kind: live, default: "1.5", mappable: true}
      2: {name: B, type: INTEGER32, access: ro, kind: live, default: -3, mappable: true}
      3: {name: C, type: UNSIGNED32, access: ro, kind: live, default: 0xFFFFFFFF, mappable: true}
      4: {name: D, type: REAL32, access: ro, kind: live, default: "-0.001", mappable: true}
  0x2101: {name: Valid, type: BOOLEAN, access: ro, kind: live, default: "1", mappable: true, source: "2"}
"""


def heartbeat(
    least: int, most: int, states: str = "pre-operational, operational, stopped"
) -> tuple[str, str]:
    """Return a heartbeat service and its object."""
    service = f"object: 0x1017, min_ms: {least}, max_ms: {most}, states: [{states}], source: '1'"
    ranges = f"ranges: [[0, 0], [{least}, {most}]]"
    entry = f"type: UNSIGNED16, access: rw, kind: config, default: 0, {ranges}, source: '2'"
    return f"  heartbeat_producer: {{{service}}}\n", f"  0x1017: {{name: Heartbeat, {entry}}}\n"


def tpdos(kind: str, event: str = "") -> str:
    """Return four TPDOs of fixed mapping whose COB-IDs are fixed too."""
    text = MAPPED
    for n in range(4):
        text += f"""\
  0x{0x1800 + n:X}:
    name: Communication
    source: "2"
    subs:
      0: {{name: Highest sub-index, type: UNSIGNED8, access: const, kind: constant, default: {5 if event else 2}}}
      1: {{name: COB-ID, type: UNSIGNED32, access: ro, kind: config, default: "{0x180 + 0x100 * n} + NODEID"}}
      2: {{name: Type, type: UNSIGNED8, kind: config, {kind}}}
"""
        if event:
            text += f"      5: {{name: Event timer, type: UNSIGNED16, kind: config, {event}}}\n"
        text += f"""\
  0x{0x1A00 + n:X}:
    name: Mapping
    source: "2"
    subs:
      0: {{name: Count, type: UNSIGNED8, access: ro, kind: constant, default: 2}}
      1: {{name: One, type: UNSIGNED32, access: ro, kind: constant, default: {0x21000120 + (n << 8)}}}
      2: {{name: Two, type: UNSIGNED32, access: ro, kind: constant, default: 0x21010001}}
"""
    return text


BRIEF = heartbeat(20, 50, "operational")
SLOW = heartbeat(5000, 65535)
FREE = "access: rw, default: 254"
SLOW_TIMER = "access: rw, default: 0, ranges: [[0, 0], [250, 5000]]"

PLACES = """\
  node_id: {object: 0x2200, effective: at-once, source: '1'}
  bitrate: {object: 0x2201, effective: at-once, source: '1'}
"""
PLACE_OBJECTS = """\
  0x2200: {name: Node-ID, type: UNSIGNED8, access: rw, kind: config, default: 127, ranges: [[1, 127]],
           persistent: true, source: "2"}
  0x2201: {name: Bit rate, type: UNSIGNED16, access: rw, kind: config, default: 20,
           values: {20: 20 kbit/s, 50: 50 kbit/s}, persistent: true, source: "2"}
"""
LSS = """\
  lss:
    waiting: [switch-state-global, switch-state-selective]
    configuration: [switch-state-global, inquire-identity, configure-bit-timing, activate-bit-timing]
    source: "1"
"""
IDENTITY = "".join(
    f"      {n}: {{name: Number, type: UNSIGNED32, access: ro, kind: identity, default: {n}}}\n"
    for n in (2, 3, 4)
)

DEVICES = {
    "node-ID and bit rate at once, and kept": (
        HEAD + PLACES + MANDATORY + PLACE_OBJECTS,
        {"OD-11", "OD-13", "NID-01", "BIT-01"},
        {"LSS-21"},
    ),
    "LSS without another bit rate": (
        HEAD + LSS + MANDATORY.replace("constant, default: 1", "constant, default: 4") + IDENTITY,
        {"LSS-01"},
        {"LSS-21"},
    ),
    "mandatory objects alone": (HEAD + MANDATORY, {"OD-09", "NMT-02"}, {"NMT-01", "HB-01"}),
    "node guarding": (HEAD + MANDATORY + GUARDING, {"OD-10", "BOOT-01"}, {"BOOT-02"}),
    "a heartbeat in Operational, 50 ms at most": (
        HEAD + BRIEF[0] + MANDATORY + BRIEF[1],
        {"HB-01", "HB-02", "HB-03", "HB-04", "HB-05"},
        {"NMT-01"},
    ),
    "a heartbeat of 5 s at least, and long texts": (
        HEAD + SLOW[0] + MANDATORY + SLOW[1] + TEXTS,
        {"HB-01", "HB-04", "OD-03", "SDO-01", "SDO-06"},
        set(),
    ),
    "four TPDOs, nothing to be written": (
        f"{HEAD}  {TPDO}\n{MANDATORY}{tpdos('access: ro, default: 255', 'access: ro, default: 30')}",
        {"TPDO-01", "TPDO-02", "TPDO-05"},
        {"TPDO-03", "TPDO-04", "TPDO-06"},
    ),
    "four TPDOs by SYNC alone": (
        f"{HEAD}  {TPDO}\n{SYNC}{MANDATORY}{tpdos('access: ro, default: 3')}",
        {"TPDO-01", "TPDO-03", "TPDO-05"},
        {"TPDO-02"},
    ),
    "four TPDOs by change alone": (
        f"{HEAD}  {TPDO}\n{MANDATORY}{tpdos(FREE)}",
        {"OD-10"},
        {"TPDO-01", "TPDO-02", "TPDO-03", "TPDO-05"},
    ),
    "four TPDOs, not more often than every 250 ms": (
        f"{HEAD}  {TPDO[:-1]}, min_cycle_ms: 250}}\n{MANDATORY}{tpdos(FREE, SLOW_TIMER)}",
        {"TPDO-01", "TPDO-02", "TPDO-05"},
        set(),
    ),
}


@pytest.mark.parametrize("what", DEVICES)
def test_a_device_is_judged_by_what_it_offers(
    what: str, judge: Callable[..., Any], tmp_path: Path
) -> None:
    text, judged, absent = DEVICES[what]
    spec = tmp_path / "small.yaml"
    spec.write_text(text, encoding="utf-8")

    finished = judge(device=spec)

    assert finished.items("fail") == finished.items("inconclusive") == [], finished.out
    assert finished.code == 0
    assert judged <= finished.requirements("pass")
    assert absent <= finished.requirements("not_applicable")


def test_a_record_may_be_full(judge: Callable[..., Any], tmp_path: Path) -> None:
    subs = "".join(
        f"      {n}: {{name: V{n}, type: UNSIGNED8, access: ro, kind: live}}\n"
        for n in range(1, 255)
    )
    count = "      0: {name: Count, type: UNSIGNED8, access: const, kind: constant, default: 254}\n"
    spec = tmp_path / "full.yaml"
    spec.write_text(
        f'{HEAD}{MANDATORY}  0x2000:\n    name: Full\n    source: "2"\n    subs:\n{count}{subs}',
        encoding="utf-8",
    )

    finished = judge("--select", "OD-01 or OD-16", device=spec)

    assert finished.code == 0
    assert "OD-01/2000h:FE" in finished.items("pass")
    assert "OD-16/2000h" not in finished.items("inconclusive")
