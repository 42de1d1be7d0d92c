"""Whatever comes over the bus, the simulated device goes on; `make hostile` has it take 10 million frames."""

from __future__ import annotations

import os

import pytest
from random_frames import live_through

from conformance import resources
from conformance.spec.load import load_spec

FRAMES = int(os.environ.get("HOSTILE_FRAMES", "50000"))
DEVICES = resources.names("device_specs")


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", DEVICES)
def test_random_frames_leave_a_device_that_answers(name: str) -> None:
    file = load_spec(resources.find("device_specs", name, "DEVICE"))
    share = FRAMES // len(file.variants)
    for seed, variant in enumerate(file.variants, 1):
        vendor_id = file.resolve(variant).entries[0x1018, 1]
        assert isinstance(vendor_id.default, int)
        expected = bytes.fromhex("43181001") + vendor_id.default.to_bytes(4, "little")

        answers = [life.vendor_id() for life in live_through(file, variant, seed, share)]

        assert set(answers) == {expected}
