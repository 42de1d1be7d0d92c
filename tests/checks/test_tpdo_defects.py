"""TPDOs that are sent as no manual lets them: each defect is seen, and is none of the readings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

INVENTED = Path(__file__).parents[1] / "simulator" / "invented.yaml"

BESIDE_THE_ROWS = {
    "RTR although bit 30 forbids it": ("siko_ims360", "tpdo-rtr-bit-30-ignored", "TPDO-16"),
    "type 252 without a request": ("siko_ims360", "tpdo-sent-unasked", "TPDO-16"),
    "type 0 without an answer to SYNC": (INVENTED, "tpdo-sync-ignored", "TPDO-15"),
    "type 0 answered in Stopped": (INVENTED, "tpdo-in-stopped", "TPDO-15"),
    "a request answered in Pre-operational": ("siko_ims360", "tpdo-in-pre-operational", "TPDO-17"),
    "SYNC answered in Stopped": ("baumer_gim140r", "tpdo-in-stopped", "SYNC-02"),
    "an event timer that 0 does not stop": (
        "danfoss_dst_x730",
        "tpdo-timer-never-stops",
        "TPDO-07",
    ),
}


@pytest.mark.parametrize("what", BESIDE_THE_ROWS)
def test_a_defect_is_seen(what: str, judge: Callable[..., Any]) -> None:
    device, fault, requirement = BESIDE_THE_ROWS[what]

    finished = judge("--fault", fault, "--select", requirement, "--strict", device=device)

    assert finished.code == 1
    assert finished.requirements("fail") == {requirement}


def test_an_inhibit_time_counts_in_its_unit(judge: Callable[..., Any]) -> None:
    finished = judge("--reading", "IMS-31=2", "--select", "TPDO-11")

    assert finished.code == 1
    assert finished.items("fail") == [f"TPDO-11/180{n}h" for n in range(4)]


READINGS = {
    "a timer that the inhibit time does not hold back": ("IMS-33", 2, "TPDO-11"),
    "requests allowed by bit 30": ("IMS-29", 2, "TPDO-16"),
    "no type for requests": ("IMS-25", 2, "TPDO-17"),
    "a new event time at the next start": ("IMS-152", 2, "TPDO-08"),
    "undocumented types taken": ("IMS-30", 2, "TPDO-13"),
    "an inhibit time while valid": ("IMS-35", 2, "TPDO-12"),
    "an event time of 0 refused": ("GIM-78", 2, "TPDO-07"),
    "a short event time raised": ("GIM-76", 2, "TPDO-09"),
    "a short event time dropped": ("GIM-76", 3, "TPDO-09"),
    "a short event time taken": ("DST-50", 2, "TPDO-09"),
    "the event timer with a synchronous type": ("DST-125", 2, "TPDO-14"),
}
DEVICES = {"IMS": "siko_ims360", "GIM": "baumer_gim140r", "DST": "danfoss_dst_x730"}


@pytest.mark.parametrize("what", READINGS)
def test_a_reading_is_followed(what: str, judge: Callable[..., Any]) -> None:
    ambiguity, reading, requirement = READINGS[what]

    finished = judge(
        "--reading",
        f"{ambiguity}={reading}",
        "--select",
        requirement,
        device=DEVICES[ambiguity.partition("-")[0]],
    )

    assert finished.code == 0
    passed = [it for it in finished.record["items"] if it["verdict"] == "pass"]
    assert passed
    assert all(it["readings"] == {ambiguity: reading} for it in passed)


def test_octets_behind_the_mapped_objects_may_be_there(judge: Callable[..., Any]) -> None:
    finished = judge("--reading", "DST-52=2", "--select", "TPDO-18", device="danfoss_dst_x730")

    assert finished.items("pass") == ["TPDO-18/1800h"]
