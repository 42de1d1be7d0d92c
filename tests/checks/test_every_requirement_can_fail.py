"""Each requirement is seen failing on a device with a defect of its kind; none is dead."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from conformance.catalogue import load_checks

FAULTS = {
    "BOOT-01": "boot-up-twice",
    "BOOT-02": "starts-operational",
    "HB-01": "heartbeat-jitter-20-ms",
    "HB-02": "heartbeat-starts-late",
    "HB-03": "heartbeat-never-stops",
    "HB-04": "accepts-out-of-range",
    "HB-05": "heartbeat-wrong-state",
    "NMT-01": "nmt-broadcast-ignored",
    "NMT-02": "sdo-in-stopped",
    "NMT-03": "nmt-obeys-other-nodes",
    "NMT-04": "nmt-obeys-wrong-length",
    "NMT-05": "nmt-obeys-unknown-commands",
    "NMT-06": "reset-keeps-values",
    "OD-05": "accepts-read-only",
    "OD-06": "sdo-wrong-abort-code",
    "OD-07": "reads-write-only",
    "OD-08": "sdo-wrong-abort-code",
    "OD-09": "wrong-identity",
    "OD-10": "wrong-heartbeat-default",
    "OD-12": "heartbeat-readback-stale",
    "OD-13": "accepts-out-of-range",
    "OD-14": "sdo-abort-bytes-swapped",
    "OD-15": "unknown-sub-index-reads-zero",
    "OD-16": "unknown-sub-index-reads-zero",
    "OD-17": "unknown-object-reads-zero",
    "OD-18": "accepts-in-any-state",
    "SDO-01": "sdo-wrong-size",
    "SDO-02": "accepts-wrong-length",
    "SDO-03": "sdo-wrong-abort-code",
    "SDO-04": "sdo-unknown-command-ignored",
    "SDO-05": "sdo-hangs-after-abort",
    "SDO-06": "sdo-toggle-ignored",
    "SDO-07": "sdo-serves-other-nodes",
    "SDO-08": "sdo-answers-twice",
    "TPDO-01": "tpdo-in-stopped",
    "TPDO-02": "tpdo-timer-slow-10-percent",
    "TPDO-03": "tpdo-sync-off-by-one",
    "TPDO-04": "tpdo-bit-31-ignored",
    "TPDO-05": "tpdo-short",
}
BY_A_CHANGED_SPEC = {"OD-01", "OD-02", "OD-03", "OD-04", "OD-11", "TPDO-06"}
"""Seen failing in `test_seeded_defects.py`."""


def test_every_requirement_has_its_defect() -> None:
    assert set(FAULTS) | BY_A_CHANGED_SPEC == set(load_checks())


@pytest.mark.parametrize("requirement", FAULTS)
def test_requirement_fails_on_its_defect(requirement: str, judge: Callable[..., Any]) -> None:
    finished = judge(
        "--variant", "two-axis", "--fault", FAULTS[requirement], "--select", requirement, "--strict"
    )

    assert finished.code == 1
    assert finished.requirements("fail") == {requirement}
