"""Runs the suite against python-canopen's LocalNode, a CANopen device that nobody here wrote.

By hand: `python tests/independent/local_node.py siko_ims360 --select "HB or SDO"`. The device and
the suite share one process, for python-can's `virtual` interface reaches no further. All stack
behaviour is python-canopen's: SDO server, NMT slave, heartbeat, TPDO maps. What is added is the
application that its documentation leaves to the user, and nothing that makes a check pass: the
values of the objects, and starting and stopping of TPDOs by state, event timer and SYNC.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import time
from pathlib import Path

import can
import canopen
from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable
from canopen.pdo import PdoMap
from canopen.sdo.exceptions import SdoAbortedError

from conformance import cli, resources
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec, Entry
from conformance.wire.datatypes import Value

OPERATIONAL = 5
SYNCHRONOUS = range(1, 241)
ASYNCHRONOUS = (254, 255)
COMMUNICATION, MAPPING = range(0x1800, 0x1A00), range(0x1A00, 0x1C00)
BENCH = """\
format: 1
what: python-canopen's LocalNode in this process.
interface: virtual
channel: {channel}
power: none
allow: [reads, writes, resets, restores, non-volatile, other-nodes]
sdo_timeout_s: 2
boot_up_timeout_s: 0.5
"""
"""Every request is answered, so a long SDO timeout costs nothing and rides out a busy machine; no
reset is followed by a boot-up message, so each costs the whole of the other."""


def build_dictionary(spec: DeviceSpec) -> ObjectDictionary:
    """Return what the manual lists, in python-canopen's terms; reserved entries do not exist."""
    dictionary = ObjectDictionary()  # type: ignore[no-untyped-call]  # canopen is partly untyped
    for index in spec.indices():
        entries = [entry for entry in spec.subs(index) if not entry.reserved]
        if not entries[0].in_record:
            dictionary.add_object(_variable(entries[0]))
            continue
        record = ODRecord(f"Object {index:04X}h", index)
        for entry in entries:
            record.add_member(_variable(entry))
        dictionary.add_object(record)
    return dictionary


def _variable(entry: Entry) -> ODVariable:
    variable = ODVariable(f"{entry.name} {entry.address}", entry.index, entry.sub)
    variable.data_type = int(entry.type)
    variable.access_type = entry.access
    variable.pdo_mappable = bool(entry.mappable)
    variable.default = _value(entry)  # type: ignore[assignment]  # declared int, strings are taken
    if entry.legal:
        variable.min, variable.max = entry.legal[0][0], entry.legal[-1][1]
    return variable


def _value(entry: Entry) -> Value:
    """Return the default; where the manual prints none, some value of the right length."""
    if entry.default is not None:
        return entry.default
    if not entry.type.is_integer:
        return "1" * (entry.octets or (7, 7))[0]
    return 0 if entry.writable else entry.index & 0x3F


class LocalDevice(canopen.LocalNode):
    """A LocalNode with the application that makes it send TPDOs."""

    def __init__(self, spec: DeviceSpec) -> None:
        super().__init__(spec.node_id, build_dictionary(spec))
        self._spec = spec
        self._syncs: dict[int, int] = {}
        self._held_at_start = {
            key: entry.type.encode(_value(entry)) for key, entry in spec.entries.items()
        }

    def start(self, network: canopen.Network) -> None:
        """Boot on an open network."""
        network.add_node(self)
        # Subscribed after LocalNode's own, so called after it, in the same thread.
        network.subscribe(0x000, self._on_nmt)
        sync = int.from_bytes(self.get_data(0x1005, 0), "little") & 0x7FF
        network.subscribe(sync, self._on_sync)
        self.nmt.state = "INITIALISING"
        self.nmt.state = "PRE-OPERATIONAL"

    def changed(self) -> dict[str, str]:
        """Return the entries that no longer hold what the node started with, with their content."""
        return {
            self._spec.entries[index, sub].address: data.hex(" ").upper()
            for index, subs in self.data_store.items()
            for sub, data in subs.items()
            if data != self._held_at_start[index, sub]
        }

    def set_data(
        self, index: int, subindex: int, data: bytes, check_writable: bool = False
    ) -> None:
        """Store what was written, as LocalNode does, then configure the TPDO it belongs to."""
        super().set_data(index, subindex, data, check_writable)
        if index in COMMUNICATION or index in MAPPING:
            self._configure(index % 0x200 + 1)

    def _on_nmt(self, _can_id: int, _data: bytearray, _time_s: float) -> None:
        for number in self.tpdo:
            self._configure(number)

    def _configure(self, number: int) -> None:
        pdo = self.tpdo[number]
        pdo.stop()
        self._syncs[number] = 0
        if self.nmt._state != OPERATIONAL or not self._fill(pdo):
            return
        if pdo.trans_type in ASYNCHRONOUS and pdo.event_timer:
            pdo.start(pdo.event_timer / 1000)

    def _fill(self, pdo: PdoMap) -> bool:
        """Take the TPDO's parameters from the dictionary; tell whether it is to be sent."""
        try:
            pdo.read()
        except (KeyError, SdoAbortedError):
            return False
        for variable in pdo.map:
            variable.set_data(self.get_data(variable.index, variable.subindex))
        return pdo.enabled and 0 < pdo.length <= 64

    def _on_sync(self, _can_id: int, _data: bytearray, _time_s: float) -> None:
        for number, pdo in self.tpdo.items():
            if self.nmt._state != OPERATIONAL or not pdo.enabled:
                continue
            if pdo.trans_type in SYNCHRONOUS:
                self._syncs[number] += 1
                if self._syncs[number] % pdo.trans_type == 0:
                    pdo.transmit()


def judge(device: str, select: str, report_dir: Path) -> None:
    """Run the suite's command against a LocalNode built from a spec, and exit as it does."""
    report_dir.mkdir(parents=True, exist_ok=True)
    bench = report_dir / "bench.yaml"
    channel = f"local-node-{time.monotonic_ns()}"
    bench.write_text(BENCH.format(channel=channel), encoding="utf-8")
    spec = load_spec(resources.find("device_specs", device, "DEVICE")).resolve()
    logging.getLogger("canopen").setLevel(logging.CRITICAL)
    bus = can.Bus(interface="virtual", channel=channel, ignore_config=True)
    with canopen.Network(bus) as network:
        network.connect()
        node = LocalDevice(spec)
        node.start(network)
        try:
            sys.argv = ["canopen-conformance", "run", device, "--bench", str(bench)]
            sys.argv += ["--select", select, "--report-dir", str(report_dir)]
            cli.main()
        finally:
            node.nmt.stop_heartbeat()  # type: ignore[no-untyped-call]  # canopen is partly untyped
            changed = json.dumps(node.changed(), indent=1)
            (report_dir / "changed.json").write_text(changed, encoding="utf-8")


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("device")
    parser.add_argument("--select", default="")
    parser.add_argument("--report-dir", type=Path, default=Path("reports/runs/local-node"))
    arguments = parser.parse_args()
    judge(arguments.device, arguments.select, arguments.report_dir)


if __name__ == "__main__":
    main()
