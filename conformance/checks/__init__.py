"""The checks: a folder per area, one module per service, one test function per requirement."""

import pytest

from conformance.bench.session import Bench
from conformance.verdict import Verdict

JUDGED_SERVICES = frozenset(
    {
        "nmt",
        "sdo_server",
        "emcy_producer",
        "heartbeat_producer",
        "sync_consumer",
        "tpdo",
        "store",
        "restore",
        "node_id",
        "bitrate",
        "lss",
        "leds",
        "bus_errors",
        "supply",
    }
)
"""The services of a spec that checks judge; a report says which documented ones are left out."""

BENCH = pytest.StashKey[Bench]()
"""The open bench of a session, in pytest's config."""

PASSED = pytest.StashKey[bool]()
"""Whether an item's check passed, in the item."""

VERDICT = pytest.StashKey[Verdict]()
"""An item's verdict, in the item."""

LATE_MS = pytest.StashKey[float]()
"""By how much timestamps were late where that alone left an item open, else 0, in the item."""
