"""For a guest: a device and the suite as two processes on vcan0, with candump beside them.

vcan_run.py DEVICE SELECT FOLDER
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

from simulated_process import COMMAND

BENCH = """format: 1
what: A simulated device in another process, on a virtual SocketCAN interface.
interface: socketcan
channel: vcan0
power: none
allow: [reads, writes, resets, other-nodes]
"""
FIRST = ("chrt", "--fifo", "50")
"""What stands for a device is to be as prompt as one."""


def main(device: str, select: str, folder: Path) -> int:
    bench = folder / "bench.yaml"
    bench.write_text(BENCH, encoding="ascii")
    record = "--report-dir", folder / "record"
    with (folder / "candump.log").open("wb") as log:
        watching = subprocess.Popen((*FIRST, "candump", "-L", "vcan0"), stdout=log)
        simulated = subprocess.Popen(
            (
                *FIRST,
                *COMMAND,
                "simulate",
                device,
                "--interface",
                "socketcan",
                "--channel",
                "vcan0",
            ),
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert simulated.stdout is not None
            assert simulated.stdout.readline()
            judged = subprocess.run(
                (*COMMAND, "run", device, "--bench", bench, "--select", select, *record),
                check=False,
            )
            time.sleep(0.5)
        finally:
            simulated.terminate()
            watching.terminate()
    return judged.returncode or simulated.wait(20)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], Path(sys.argv[3])))
