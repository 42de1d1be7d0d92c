from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from simulated_process import Process, simulating


@pytest.fixture(scope="module")
def one_process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Process]:
    link = Path(tmp_path_factory.mktemp("line")) / "tty"
    with simulating("siko_ims360", "--slcan-pty", str(link)) as process:
        yield process
