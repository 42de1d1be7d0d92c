"""A walk over a node's whole object dictionary by SDO uploads (CiA 301 v4.2.0, 7.2.4, 7.4)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from conformance.bench.node.sdo import Transfer
from conformance.bench.session import Bench
from conformance.errors import NodeTimeout
from conformance.spec.model import Key, address
from conformance.wire.abort import AbortCode

INDICES = 0x10000
SUBS = range(1, 0xFF)
"""FFh is left out: there the standard has the structure of the object (CiA 301 v4.2.0, 7.4)."""

MOST_OCTETS = 4096
"""A longer value is read so far."""

MOST_FOUND = 1000
MOST_SILENT = 8
NO_OBJECT, NO_SUB = (0x0000, 0), (0x1000, 1)
"""What no node has: how it says so holds for other objects and sub-indices too."""

PAGE = 256
"""Indices after which the frames seen so far are forgotten; the trace keeps them."""


@dataclass(frozen=True, slots=True)
class Found:
    """An entry that answers and is not documented.

    Args:
        key: Index and sub-index.
        transfer: What came of its upload.
        first: Line of the trace where the upload begins.
        last: Where it ends.
    """

    key: Key
    transfer: Transfer
    first: int
    last: int


class Scan:
    """Asks for sub-index 0 of every index, and for the others of each index that exists.

    Args:
        bench: The open bench.

    Attributes:
        absent: Abort codes by which the node says that an object does not exist.
        missing: Those by which it says that a sub-index does not exist.
        indices: Indices done.
        uploads: Uploads done.
        total: Uploads to do, as far as is known.
        found: What answers and is not documented.
        ended: Why the walk ended early, empty while it goes on and when it is complete.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._node = bench.node()
        self._silent = 0
        self.absent: set[int] = {AbortCode.OBJECT_DOES_NOT_EXIST}
        self.missing: set[int] = {AbortCode.SUB_INDEX_DOES_NOT_EXIST}
        self.indices = 0
        self.uploads = 0
        self.total = INDICES + 2
        self.found: list[Found] = []
        self.ended = ""

    @property
    def complete(self) -> bool:
        """Every index was asked for."""
        return self.indices == INDICES and not self.ended

    def walk(self) -> Iterator[None]:
        """Go on by one upload at a time."""
        for key, codes in ((NO_OBJECT, self.absent), (NO_SUB, self.missing)):
            abort = self._upload(key).abort
            codes.update(() if abort is None else (abort,))
        for index in range(INDICES):
            if index % PAGE == 0:
                self._bench.link.forget()
                self._bench.channel.begin()
            exists = self._ask((index, 0))
            yield
            if exists:
                self.total += len(SUBS)
                for sub in SUBS:
                    if self.ended:
                        break
                    self._ask((index, sub))
                    yield
            if self.ended:
                return
            self.indices += 1

    def leave(self) -> None:
        """End the walk: make sure that the node is still there.

        Raises:
            NodeTimeout: It does not answer any more.
        """
        self._bench.done(self._node, doubtful=True)

    def _ask(self, key: Key) -> bool:
        """Upload an entry, and return whether its index exists."""
        first = self._bench.link.line + 1
        transfer = self._upload(key)
        if transfer.abort not in self.absent | self.missing and key not in self._bench.spec.entries:
            self.found.append(Found(key, transfer, first, self._bench.link.line))
            if len(self.found) == MOST_FOUND:
                self.ended = f"{MOST_FOUND} entries that are not documented are enough"
        if not transfer.answered:
            self._after_silence(key)
        return transfer.answered and transfer.abort not in self.absent

    def _upload(self, key: Key) -> Transfer:
        self.uploads += 1
        try:
            return self._node.sdo.upload(*key, most_octets=MOST_OCTETS)
        except KeyboardInterrupt:
            self._node.sdo.abort(*key, AbortCode.GENERAL_ERROR)
            raise

    def _after_silence(self, key: Key) -> None:
        """Bring a node back that an upload may have silenced; end when it is silent too often."""
        self._silent += 1
        if self._silent == MOST_SILENT:
            self.ended = f"no answer to {MOST_SILENT} uploads, at last of {address(*key)}"
        elif not self._node.answers():
            try:
                self._node.recover()
            except NodeTimeout as error:
                self.ended = f"{error}, since the upload of {address(*key)}"
