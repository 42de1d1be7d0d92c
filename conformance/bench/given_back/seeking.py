"""A node that may be anywhere: looked for at every bit rate and node-ID, and brought home."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from conformance.bench.bus.link import Link
from conformance.bench.node.node import PROBE, Node
from conformance.bench.node.reach import Place, is_any_boot_up, node_id_of
from conformance.bench.services.lss import LssPort
from conformance.bench.session import Bench
from conformance.errors import BenchError, ConformanceError, NodeTimeout, SetupRefused
from conformance.spec.bit_rates import documented_rates
from conformance.spec.model import DeviceSpec, Key
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand
from conformance.wire.sdo import InitiateUpload, encode

IDENTITY = ((0x1000, 0), (0x1018, 1), (0x1018, 2))
"""What tells a device of this kind from others on the bus."""

BROADCAST = 0
LAST_NODE_ID = 127
AT_ONCE = 8
"""Requests that any adapter takes without a pause."""
PAUSE_S = 0.02


def bring_home(bench: Bench, held: Mapping[Key, bytes | str], *, restarts: bool) -> None:
    """Find the node wherever it is, or goes when it restarts, and bring it to where it was.

    Args:
        bench: The open bench; its home is where the node was.
        held: What the node's settings held there.
        restarts: The node may be restarted.

    Raises:
        NodeTimeout: It is found nowhere, or does not come home.
    """
    node, reach = bench.node(), bench.reach
    if not seek(bench, node):
        raise NodeTimeout("the node is found nowhere")
    moves = restarts and reach.here == reach.home and reach.reset(node, reach.home) is None
    if moves and not seek(bench, node):
        raise NodeTimeout("the node is found nowhere after a reset")
    if reach.here == reach.home:
        return
    reach.expect({key: data for key, data in held.items() if isinstance(data, bytes)})
    try:
        reach.bring_home(node)
    except (NodeTimeout, SetupRefused, BenchError):
        if bench.spec.services.lss is None or not seek(bench, node):
            raise
        LssPort(node, reach, bench.spec.services.lss).bring_back()
    bench.done(node, doubtful=False)


def seek(bench: Bench, node: Node) -> bool:
    """Go to where a node of this kind answers; tell whether there is one."""
    for bitrate in _rates(bench):
        for place in _places(bench, node, bitrate):
            bench.reach.go(place)
            if node.answers() and _is_one(bench, node):
                return True
    return False


def _rates(bench: Bench) -> Iterator[int]:
    """Return the bit rates at which the bench can be, that of the node's home first."""
    home = bench.reach.home
    rates = documented_rates(bench.spec) if bench.definition.sets_bitrate else ()
    for bitrate in dict.fromkeys((home.bitrate, *rates)):
        try:
            bench.reach.go(Place(home.node_id, bitrate))
        except SetupRefused:
            continue  # the adapter has no such bit rate
        yield bitrate


def _places(bench: Bench, node: Node, bitrate: int) -> Iterator[Place]:
    """Return where nodes may be at the present bit rate: its home, where one starts, all others."""
    yield Place(bench.reach.home.node_id, bitrate)
    mark = node.link.mark()
    if bench.definition.allows(["other-nodes"]):
        node.nmt(NmtCommand.RESET_NODE, node_id=BROADCAST)
        node.link.wait(is_any_boot_up, bench.definition.boot_up_timeout_s, mark)
        for seen in node.link.since(mark, is_any_boot_up):
            yield Place(node_id_of(seen.frame), bitrate)
    for node_id in answering(node.link, node.channel.timeout_s):
        yield Place(node_id, bitrate)


def answering(link: Link, timeout_s: float) -> list[int]:
    """Return at which node-IDs anybody answers an SDO request.

    Args:
        link: The link to the bus.
        timeout_s: How long to wait for the last answer.
    """
    mark = link.mark()
    request = encode(InitiateUpload(*PROBE))
    for node_id in range(1, LAST_NODE_ID + 1):
        link.send(Frame(cob_id.sdo_request(node_id), request))
        if node_id % AT_ONCE == 0:
            link.listen(PAUSE_S, lambda _: False)
    link.listen(timeout_s, lambda _: False)
    ids = {cob_id.sdo_response(node_id): node_id for node_id in range(1, LAST_NODE_ID + 1)}
    seen = link.since(mark, lambda frame: frame.can_id in ids and not frame.extended)
    return sorted({ids[it.frame.can_id] for it in seen})


def _is_one(bench: Bench, node: Node) -> bool:
    """Tell whether a node is of the kind that the spec describes, as far as its identity says."""
    try:
        return all(node.number(*key) == value for key, value in said_identity(bench.spec).items())
    except ConformanceError:
        return False


def said_identity(spec: DeviceSpec) -> dict[Key, int]:
    """Return what a spec says of the objects that tell devices of its kind from others."""
    entries = (spec.entries.get(key) for key in IDENTITY)
    return {
        entry.key: entry.default
        for entry in entries
        if entry is not None and isinstance(entry.default, int)
    }
