"""A simulated device and python-canopen as its master."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from master import DEVICES, Master, master_of, name_of


@pytest.fixture(params=DEVICES, ids=name_of)
def master(request: pytest.FixtureRequest) -> Iterator[Master]:
    """A master whose device has booted."""
    with master_of(*request.param) as made:
        made.boot()
        yield made
