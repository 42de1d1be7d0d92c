"""What a COB-ID written to an object must satisfy (CiA 301 v4.2.0, 7.3.5, 7.5.2.5, 7.5.2.17, 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from conformance.simulator.node import Node
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.document import Services
from conformance.spec.model import Key
from conformance.wire.abort import AbortCode
from conformance.wire.cob_id import is_restricted
from conformance.wire.datatypes import Value

NOT_VALID: Final = 1 << 31
NO_RTR: Final = 1 << 30
GENERATES: Final = 1 << 30
"""Bit 30 of the SYNC COB-ID."""

CAN_ID: Final = 0x7FF
_WIDE: Final = 0x3FFF_F800
"""Bits 11 to 29: only with 29-bit identifiers, which the devices do not offer."""


def guard_cob_ids(node: Node, services: Services) -> None:
    """Let the COB-IDs of SYNC, EMCY and TPDOs be written by the rules only."""
    if services.sync_consumer is not None and services.sync_consumer.object is not None:
        anything = services.sync_consumer.restricted == "accepted"
        key = services.sync_consumer.object, 0
        _guard(node, key, partial(_check_sync, anything=anything))
    if services.emcy_producer is not None:
        emcy = services.emcy_producer
        check = _producer_check(emcy.change_while_valid, emcy.restricted)
        _guard(node, (emcy.object, 0), check)
    if services.tpdo is not None:
        check = _producer_check(services.tpdo.change_while_valid, services.tpdo.restricted)
        for number in range(services.tpdo.count):
            _guard(node, (services.tpdo.communication + number, 1), check)


def _guard(node: Node, key: Key, check: Callable[[Node, Key, Value], None]) -> None:
    node.dictionary.guards[key].append(partial(check, node, key))


def _check_sync(node: Node, _key: Key, value: Value, *, anything: bool) -> None:
    word = int(value)
    if word & (GENERATES | _WIDE):
        raise SdoAbortError(AbortCode.INVALID_VALUE)
    if not anything:
        _check_restricted(node, word)


def _producer_check(while_valid: str, restricted: str) -> Callable[[Node, Key, Value], None]:
    return partial(
        _check_producer, movable=while_valid == "accepted", anything=restricted == "accepted"
    )


def _check_producer(node: Node, key: Key, value: Value, *, movable: bool, anything: bool) -> None:
    word = int(value)
    before = node.dictionary.number(*key)
    if word & _WIDE and not node.faults.cob_id_ignores_bit_29:
        raise SdoAbortError(AbortCode.INVALID_VALUE)
    if word & NOT_VALID:
        return
    if not anything:
        _check_restricted(node, word)
    moved = (word ^ before) & CAN_ID and not before & NOT_VALID
    if moved and not movable and not node.faults.cob_id_changes_while_valid:
        raise SdoAbortError(AbortCode.INVALID_VALUE)


def _check_restricted(node: Node, word: int) -> None:
    if is_restricted(word & CAN_ID) and not node.faults.cob_id_accepts_restricted:
        raise SdoAbortError(AbortCode.INVALID_VALUE)
