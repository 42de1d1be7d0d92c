"""What is done with sensors fresh from the box, from finding them to seeing them at their places."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from conformance.bench.given_back.seeking import answering
from conformance.bench.session import Bench
from conformance.commissioning.by_lss import ByLss
from conformance.commissioning.by_objects import ByObjects
from conformance.commissioning.giving import Giving, identity_of
from conformance.commissioning.one_by_one import connected
from conformance.commissioning.record import Record, Spot, Unit
from conformance.commissioning.searching import Search
from conformance.errors import BenchError
from conformance.report.console import console


class Procedure:
    """One commissioning, or the way back from it.

    Args:
        bench: The open bench; its home is where sensors fresh from the box are.
        record: What is found and given.
        path: Of the record.
    """

    def __init__(self, bench: Bench, record: Record, path: Path) -> None:
        self._bench = bench
        self._record = record
        self._by_lss = ByLss(bench) if ByLss.can(bench.spec) else None
        way = self._by_lss or ByObjects(bench)
        self._giving = Giving(bench, way, lambda: record.keep(path))

    def all_at_once(
        self, serials: Sequence[int], node_ids: Sequence[int], bitrate: int
    ) -> list[str]:
        """Give all sensors on the bus their places by LSS; return what went wrong, a sentence each.

        Args:
            serials: Their serial numbers; looked for where there are none.
            node_ids: To give, as far as nobody has them.
            bitrate: To give, in bit/s.

        Raises:
            BenchError: Nobody is there, or there are too few node-IDs.
        """
        assert self._by_lss is not None  # asked before
        self._bench.find_node(several=True)
        units = self._add(self._identities(self._by_lss, serials), node_ids, bitrate)
        console.say(f"sensors: {', '.join(map(str, units)) or 'none'}")
        wrong = self._giving.give(units)
        home = self._bench.reach.home
        self._bench.reach.go(home)
        if self._bench.node().answers():
            wrong.append(
                f"a sensor is still {home}: give the serial number on its label by --serial"
            )
        return wrong

    def one_by_one(self, node_ids: Sequence[int], bitrate: int) -> list[str]:
        """Give sensors their places as the operator connects them, as `all_at_once` does."""
        alone = bitrate != self._bench.reach.home.bitrate
        wrong = []
        for identity in connected(self._bench, alone=alone):
            (unit,) = self._add([identity], node_ids, bitrate)
            console.say(f"connected: {unit}")
            wrong += self._giving.give([unit])
        return wrong

    def back(self) -> list[str]:
        """Bring all sensors of the record to where they were found; return what went wrong."""
        return self._giving.take_back(self._record.in_force)

    def _identities(self, by_lss: ByLss, serials: Sequence[int]) -> list[list[int]]:
        """Return the identities of all sensors, which differ in revision and serial number alone."""
        node = self._bench.node()
        vendor, product, revision, *_ = identity_of(node)
        if serials:
            return [[vendor, product, revision, it] for it in serials]
        search = Search(self._bench.link, self._bench.definition.sdo_timeout_s, vendor, product)
        by_lss.prepare(node)
        try:
            return [list(it.numbers) for it in search.addresses()]
        finally:
            self._bench.done(node, doubtful=False)

    def _add(
        self, identities: Sequence[list[int]], node_ids: Sequence[int], bitrate: int
    ) -> list[Unit]:
        """Note sensors and the places that they are to have."""
        bench = self._bench
        home = Spot.of(bench.reach.home)
        bench.reach.go(bench.reach.home)
        given = {unit.given.node_id for unit in self._record.units}
        answer = answering(bench.link, bench.definition.sdo_timeout_s)
        free = [it for it in node_ids if it not in {home.node_id, *given, *answer}]
        if len(free) < len(identities):
            raise BenchError(
                f"expected {len(identities)} free node-IDs, got {len(free)}: give others by --node-ids"
            )
        units = [
            Unit(identity=identity, found=home, given=Spot(node_id=node_id, bitrate=bitrate))
            for identity, node_id in zip(identities, free, strict=False)
        ]
        self._record.units += units
        return units
