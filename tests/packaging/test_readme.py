"""What README.md says of the suite is true of it."""

from __future__ import annotations

import re
from pathlib import Path

from conformance.checks import JUDGED_SERVICES
from conformance.spec.document import Services

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
WORDS = {
    "nmt": "NMT",
    "sdo_server": "SDO",
    "heartbeat_producer": "heartbeat",
    "sync_consumer": "SYNC",
    "emcy_producer": "EMCY",
    "tpdo": "TPDO",
    "store": "store",
    "restore": "restore",
    "node_id": "node-ID",
    "bitrate": "bit rate",
    "lss": "LSS",
    "leds": "lights",
    "bus_errors": "bus errors",
    "supply": "supply range",
}


def test_the_readme_names_the_services_that_are_judged_and_no_others() -> None:
    (sentence,) = re.findall(r"^Judged today: (.*?)\. ", README, re.DOTALL | re.MULTILINE)
    assert set(WORDS) == set(Services.model_fields)
    words = " ".join(sentence.split())
    assert {name for name, word in WORDS.items() if word in words} == JUDGED_SERVICES
