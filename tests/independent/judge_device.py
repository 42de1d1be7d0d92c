"""Runs the suite against a device that nobody here wrote, held against its own EDS.

By hand: `python tests/independent/judge_device.py local_node --select "HB or SDO"`. The device and the
suite share one process and a virtual clock, or with `--real-time` python-can's `virtual` interface.
"""

from __future__ import annotations

import argparse
import importlib
import json
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import can
from virtual_time import INTERFACE, LibraryBus, Station, on_the_bus

from conformance import cli
from conformance.bench import definition
from conformance.spec.eds.to_spec import import_eds

BITRATE = 125_000
CHANNEL = "independent"
BENCH = """\
format: 1
what: A device in this process.
interface: {interface}
channel: {channel}
power: none
allow: [reads, writes, resets, restores, non-volatile, node-id, bitrate, other-nodes]
"""


@contextmanager
def booted(device: ModuleType, *, real_time: bool) -> Iterator[Any]:
    """Give a device its bus, and end it afterwards."""
    if real_time:
        with can.Bus(interface="virtual", channel=CHANNEL, ignore_config=True) as bus:
            yield device.boot(bus, None)
        return
    station = Station(BITRATE)
    with on_the_bus(station, CHANNEL), LibraryBus(station) as bus:
        yield device.boot(bus, station)


def judge(name: str, select: str, folder: Path, *, real_time: bool) -> None:
    """Run the suite's command against a device, and exit as it does.

    The folder gets the record of the run, the EDS, the spec made of it, and `changed.json`: what
    entries hold in the end that they did not hold before.
    """
    folder.mkdir(parents=True, exist_ok=True)
    definition.TELLING |= {INTERFACE}  # no cable
    device = importlib.import_module(name)
    bench, eds, spec = (folder / f"{name}.{kind}" for kind in ("bench.yaml", "eds", "yaml"))
    interface = "virtual" if real_time else INTERFACE
    bench.write_text(BENCH.format(interface=interface, channel=CHANNEL), encoding="utf-8")
    with booted(device, real_time=real_time) as node:
        eds.write_text(device.eds_of(node), encoding="utf-8")
        spec.write_text(import_eds(eds).text, encoding="utf-8")
        before = device.contents(node)
        sys.argv = ["canopen-conformance", "run", str(spec), "--bench", str(bench), "--eds"]
        sys.argv += [str(eds), "--select", select, "--report-dir", str(folder)]
        try:
            cli.main()
        finally:
            after = device.contents(node)
            changed = {key: str(value) for key, value in after.items() if value != before[key]}
            (folder / "changed.json").write_text(json.dumps(changed, indent=1), encoding="utf-8")


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("device", choices=("local_node", "durand_node"))
    parser.add_argument("--select", default="")
    parser.add_argument("--report-dir", type=Path, default=Path("reports/runs/independent"))
    parser.add_argument("--real-time", action="store_true")
    arguments = parser.parse_args()
    logging.disable()
    judge(
        arguments.device,
        arguments.select,
        arguments.report_dir,
        real_time=arguments.real_time,
    )


if __name__ == "__main__":
    main()
