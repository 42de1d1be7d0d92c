"""Writes what runs leave behind to `reports/samples`: three devices, one of them defective, and a lot of 50.

By hand: `make samples`.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

from conformance.resources import data

SAMPLES: Final = {
    "heartbeat-slow": "siko_ims360 --serial 40117 --select HB --fault heartbeat-slow-10-percent",
    "baumer_gim140r": 'baumer_gim140r --serial 2210 --select "BOOT or HB or EMCY"',
    "danfoss_dst_x730": "danfoss_dst_x730 --serial 730204 --acceptance",
}
"""Folder of a sample to the arguments of its run."""

LOT: Final = "lot-of-50"
BAD: Final = {
    40_004: "heartbeat-slow-10-percent",
    40_020: "wrong-identity",
    40_044: "no-boot-up",
}
"""Serial number of a unit of the lot to its fault."""

LOT_FILE: Final = """format: 1
part: IMS360, one axis
order: sample
device: siko_ims360
serials: {serials}
level: II
aql: 1.0
seed: 5
select: OD-09 or HB-01 or BOOT-01
simulation:
  faults: {faults}
"""

SUMMARY: Final = "summary.txt"
LARGEST_TRACE: Final = 200_000
"""Octets of a trace that is kept."""

CALLED: Final = "from conformance.cli import main; main()"
PLACE: Final = "reports/samples"


def make(name: str, folder: Path) -> None:
    """Write a sample.

    Args:
        name: One of `SAMPLES`.
        folder: Where it is to be, new or not.
    """
    shutil.rmtree(folder, ignore_errors=True)
    printed = _printed("run", *shlex.split(SAMPLES[name]), "--report-dir", str(folder))
    _printed("certificate", str(folder))
    (folder / SUMMARY).write_text(printed.replace(str(folder), f"{PLACE}/{name}"), encoding="utf-8")
    (folder / "journal.json").unlink()
    trace = folder / "trace.log"
    if trace.stat().st_size > LARGEST_TRACE:
        trace.unlink()


def make_lot(folder: Path) -> None:
    """Write what the inspection of a lot leaves behind, but for the records of its runs.

    Args:
        folder: Where it is to be, new or not.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    file = folder / "lot.yaml"
    faults = {unit: [fault] for unit, fault in BAD.items()}
    text = LOT_FILE.format(serials=list(range(40_001, 40_051)), faults=faults)
    file.write_text(text, encoding="utf-8", newline="\n")
    printed = _printed("inspect", str(file), "--report-dir", str(folder))
    (folder / SUMMARY).write_text(printed.replace(str(folder), f"{PLACE}/{LOT}"), encoding="utf-8")
    shutil.rmtree(folder / "units")
    (folder / ".lock").unlink(missing_ok=True)


def make_certificate_of_all(place: Path) -> None:
    """Write the certificate of all samples, with its summary."""
    folders = [str(place / name) for name in SAMPLES]
    output = str(place / "certificate-of-three.pdf")
    _printed("certificate", *folders, "--lot-title", "Three samples", "--output", output)


def _printed(*arguments: str) -> str:
    ended = subprocess.run(
        [sys.executable, "-c", CALLED, *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
        env=os.environ | {"NO_COLOR": "1", "COLUMNS": "120"},
    )
    if ended.returncode not in (0, 1):
        raise SystemExit(ended.stdout + ended.stderr)
    return ended.stdout


def main() -> None:
    """Write all samples."""
    place = data("reports") / "samples"
    for name in SAMPLES:
        make(name, place / name)
    make_certificate_of_all(place)
    make_lot(place / LOT)


if __name__ == "__main__":
    main()
