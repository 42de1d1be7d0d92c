"""For a guest: a simulated device behind an slcan line that is a network interface with a bit rate.

    slcan_interface.py BITRATE FOLDER

Prints what candump sees when the device is asked for its device type.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

from simulated_process import simulating


def main(bitrate: str, folder: Path) -> None:
    link = folder / "tty"
    with simulating("siko_ims360", "--slcan-pty", str(link)) as process:
        attached = subprocess.Popen(("slcand", "-F", "-o", str(link.resolve()), "can0"))
        try:
            limit_s = time.monotonic() + 20
            while not Path("/sys/class/net/can0").exists():
                assert time.monotonic() < limit_s
                time.sleep(0.1)
            subprocess.run(
                ("ip", "link", "set", "can0", "up", "type", "can", "bitrate", bitrate), check=True
            )
            watching = subprocess.Popen(("candump", "-T", "3000", "can0"))
            time.sleep(1)
            subprocess.run(("cansend", "can0", "632#4000100000000000"), check=True)
            watching.wait(20)
        finally:
            attached.terminate()
        assert process.end() == (0, "")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
