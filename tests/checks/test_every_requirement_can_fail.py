"""Each requirement is seen failing on a device with a defect of its kind; none is dead.

``defects/`` has a file per service: the requirement's id, and the fault that makes it fail on the
two-axis IMS360, or ``{fault: …, device: …, variant: …, reading: …}`` where another device shows it. ``elsewhere``
stands for a requirement that `test_seeded_defects.py` sees failing on a changed spec, or
`test_sdo_blocks.py` on a device with block transfers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.catalogue import load_checks
from conformance.spec.yaml_reader import read_yaml

FOLDER = Path(__file__).with_name("defects")
ENTRIES = [
    entry for path in sorted(FOLDER.glob("*.yaml")) for entry in read_yaml(path).data.items()
]
FAULTS = {name: defect for name, defect in ENTRIES if defect != "elsewhere"}


def test_every_requirement_has_its_defect() -> None:
    assert Counter(name for name, _ in ENTRIES) == Counter(load_checks().keys())


@pytest.mark.parametrize("requirement", FAULTS)
def test_requirement_fails_on_its_defect(requirement: str, judge: Callable[..., Any]) -> None:
    defect = FAULTS[requirement]
    if isinstance(defect, str):
        defect = {"fault": defect, "device": "siko_ims360", "variant": "two-axis"}
    more = [
        text
        for key in ("variant", "reading")
        if key in defect
        for text in (f"--{key}", defect[key])
    ]

    finished = judge(
        "--fault",
        defect["fault"],
        "--select",
        requirement,
        "--strict",
        *more,
        device=defect["device"],
    )

    assert finished.code == 1
    assert finished.requirements("fail") == {requirement}
