"""Who is there: the LSS addresses of all slaves, by halves of the numbers they may have (CiA 305 v3.0, 6.7)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final, TypeAlias

from conformance.bench.bus.link import Link
from conformance.bench.services.lss_address import LssAddress
from conformance.bench.services.lss_master import LssMaster
from conformance.wire.lss import IdentifyRemoteSlave, IdentifySlave, LssCommand

Range: TypeAlias = tuple[int, int]

HIGHEST: Final = 0xFFFF_FFFF
TOGETHER_S: Final = 0.05
"""By how much slaves that are asked at once may answer one after the other."""

LATER: Final = 20
"""So many times as long as for the first answer an answer is waited for, but 100 ms at least."""
LEAST_S: Final = 0.1


class Search:
    """Looks for all slaves of a product.

    Args:
        link: The link to the bus; the slaves are in LSS waiting.
        timeout_s: Longest wait for an answer.
        vendor: Vendor-ID.
        product: Product code.
    """

    def __init__(self, link: Link, timeout_s: float, vendor: int, product: int) -> None:
        self._link = link
        self._master = LssMaster(link, timeout_s)
        self._timeout_s = timeout_s
        self._product = vendor, product

    def addresses(self) -> list[LssAddress]:
        """Return the addresses of all, the lowest revision and serial number first.

        Slaves that answer at once send the same frame, so their number does not matter.
        """
        every = 0, HIGHEST
        begun_s = self._link.now()
        if not self._is_there(every, every):
            return []
        took_s = self._link.now() - begun_s - TOGETHER_S
        self._master = LssMaster(self._link, min(self._timeout_s, max(LEAST_S, LATER * took_s)))
        return [
            LssAddress(*self._product, revision, serial)
            for revision in within(*every, partial(self._has_revision, every))
            for serial in within(*every, partial(self._has_serial, (revision, revision)))
        ]

    def _has_revision(self, serials: Range, low: int, high: int) -> bool:
        return self._is_there((low, high), serials)

    def _has_serial(self, revisions: Range, low: int, high: int) -> bool:
        return self._is_there(revisions, (low, high))

    def _is_there(self, revisions: Range, serials: Range) -> bool:
        first = LssCommand.IDENTIFY_VENDOR
        numbers = (*self._product, *revisions, *serials)
        request = [IdentifyRemoteSlave(LssCommand(first + n), it) for n, it in enumerate(numbers)]
        answer = self._master.ask(*request).message
        self._link.listen(TOGETHER_S, lambda _: False)
        return isinstance(answer, IdentifySlave)


def within(low: int, high: int, is_any: Callable[[int, int], bool]) -> Iterator[int]:
    """Return the numbers in a range in which there is one."""
    if low == high:
        if is_any(low, high):  # an answer that came late may have led here
            yield low
        return
    middle = (low + high) // 2
    lower = is_any(low, middle)
    if lower:
        yield from within(low, middle, is_any)
    if not lower or is_any(middle + 1, high):
        yield from within(middle + 1, high, is_any)
