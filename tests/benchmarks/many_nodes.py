"""For a process of its own: 64 nodes, each with a TPDO every 20 ms and a heartbeat every 100 ms, for some seconds.

    many_nodes.py simulated|canopen SECONDS

Prints as JSON how many frames came, how many were missed, and by how much intervals were off.
"""

from __future__ import annotations

import json
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import can
import canopen

from conformance import resources
from conformance.simulator.channel import NodeName, build_devices
from conformance.simulator.live_segment import LiveSegment
from conformance.simulator.serving.loop import Loop
from conformance.wire import cob_id, nmt, sdo
from conformance.wire.frame import Frame

NODES = 64
TPDO_MS, HEARTBEAT_MS = 20, 100
SETTLE_S = 1.5

Times = Mapping[int, Sequence[float]]
"""When frames were sent, in seconds, by identifier."""


def simulated(seconds: float) -> Times:
    """Let simulated devices live, and note when each sends."""
    times: dict[int, list[float]] = defaultdict(list)
    segment = LiveSegment(lambda it: times[it.can_id].append(time.monotonic()), 1_000_000)
    loop = Loop(segment)
    spec = str(resources.find("device_specs", "siko_ims360", "spec"))
    with loop.present():
        for device in build_devices([NodeName(spec, None, n) for n in range(1, NODES + 1)]):
            segment.add_node(device)
    _live(loop, 1.0)
    with loop.present():
        for node_id in range(1, NODES + 1):
            for index, sub, value, size in (
                (0x1800, 2, 254, 1),
                (0x1800, 5, TPDO_MS, 2),
                (0x1017, 0, HEARTBEAT_MS, 2),
            ):
                request = sdo.InitiateDownload(index, sub, value.to_bytes(size, "little"))
                segment.hear(Frame(cob_id.sdo_request(node_id), sdo.encode(request)))
        segment.hear(nmt.encode_request(nmt.NmtRequest(nmt.NmtCommand.START, 0)))
    _live(loop, SETTLE_S)
    times.clear()
    _live(loop, seconds)
    return times


def _live(loop: Loop, seconds: float) -> None:
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        loop.turn(until_s - time.monotonic())


def library(seconds: float) -> Times:
    """Let python-canopen's nodes live, and note when each sends."""
    times: dict[int, list[float]] = defaultdict(list)
    sending = can.Bus("nodes", "virtual")
    hearing = can.Bus("nodes", "virtual")
    network: Any = canopen.Network(sending)
    network.connect()
    for node_id in range(1, NODES + 1):
        dictionary: Any = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
        _describe(dictionary)
        node: Any = network.create_node(node_id, dictionary)
        node.nmt.start_heartbeat(HEARTBEAT_MS)
        network.send_periodic(0x180 + node_id, bytes(8), TPDO_MS / 1000)
    _drain(hearing, times, SETTLE_S)
    times.clear()
    _drain(hearing, times, seconds)
    network.disconnect()
    hearing.shutdown()
    return times


def _describe(dictionary: Any) -> None:
    variable = canopen.objectdictionary.ODVariable("Producer heartbeat time", 0x1017, 0)
    variable.data_type = canopen.objectdictionary.UNSIGNED16
    variable.value = variable.default = HEARTBEAT_MS
    dictionary.add_object(variable)


def _drain(bus: can.BusABC, times: dict[int, list[float]], seconds: float) -> None:
    until_s = time.monotonic() + seconds
    while (left_s := until_s - time.monotonic()) > 0:
        message = bus.recv(left_s)
        if message is not None:
            times[message.arbitration_id].append(message.timestamp)


def told(times: Times, seconds: float) -> dict[str, float]:
    """Return the figures: those of TPDOs for the intervals."""
    tpdos = [times[it] for it in times if 0x180 < it <= 0x180 + NODES]
    off_ms = sorted(
        abs((second - first) * 1000 - TPDO_MS) for sent in tpdos for first, second in pairwise(sent)
    )
    count = sum(map(len, times.values()))
    due = NODES * seconds * 1000 * (1 / TPDO_MS + 1 / HEARTBEAT_MS)
    return {
        "frames_per_s": round(count / seconds),
        "missed": max(0, round(due) - count),
        "late": sum(it > TPDO_MS / 2 for it in off_ms),
        "p50_ms": round(off_ms[len(off_ms) // 2], 3),
        "p99_ms": round(off_ms[len(off_ms) * 99 // 100], 3),
        "max_ms": round(off_ms[-1], 3),
    }


KINDS: Mapping[str, Callable[[float], Times]] = {"simulated": simulated, "canopen": library}

if __name__ == "__main__":
    lasting_s = float(sys.argv[2])
    began_s = time.process_time()
    figures = told(KINDS[sys.argv[1]](lasting_s), lasting_s)
    sys.stdout.write(json.dumps(figures | {"cpu_s": round(time.process_time() - began_s, 2)}))
