"""What a node says it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from conformance.bench.node.node import Node
from conformance.errors import NodeTimeout
from conformance.spec.model import DeviceSpec, Entry
from conformance.wire.datatypes import DataType

MOST_DIGITS: Final = 20
"""Longer texts are no serial numbers."""


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


def told_serial(spec: DeviceSpec, identity: Mapping[str, str]) -> str:
    """Return the serial number that a node told, in decimal; empty if it told none.

    Args:
        spec: What the node is held against.
        identity: As of `read_identity`.
    """
    for entry in spec.by_kind("identity"):
        told = identity.get(entry.address)
        if entry.follows == "serial-number" and told and (shown := _number(entry, told)):
            return shown
    return ""


def _number(entry: Entry, told: str) -> str:
    """Return a serial number as a user writes it; empty where the node told no number."""
    if entry.type is DataType.VISIBLE_STRING:
        text = told.strip(" \0")
        decimal = text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS
        return str(int(text)) if decimal else ""
    try:
        return str(int.from_bytes(bytes.fromhex(told), "little"))
    except ValueError:  # what the node answered instead
        return ""
