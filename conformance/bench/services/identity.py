"""What a node says it is."""

from __future__ import annotations

from conformance.bench.node.node import Node
from conformance.errors import NodeTimeout
from conformance.wire.datatypes import DataType


def read_identity(node: Node) -> dict[str, str]:
    """Return what the objects hold that say what a node is, by address; texts are data, never trusted.

    Args:
        node: The node under test.
    """
    identity: dict[str, str] = {}
    for entry in node.spec.by_kind("identity"):
        if not entry.readable or entry.optional:
            continue
        try:
            transfer = node.sdo.upload(entry.index, entry.sub)
        except NodeTimeout as error:
            identity[entry.address] = str(error)
            break
        if transfer.data is None:
            identity[entry.address] = str(transfer)
            if transfer.fault:
                break
        elif entry.type is DataType.VISIBLE_STRING:
            identity[entry.address] = transfer.data.decode("latin-1")
        else:
            identity[entry.address] = transfer.data.hex(" ").upper()
    return identity
