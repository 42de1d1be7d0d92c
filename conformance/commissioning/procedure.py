"""What is done with sensors fresh from the box, from finding them to seeing them at their places."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from conformance.bench.given_back.seeking import answering
from conformance.bench.node.reach import Place
from conformance.bench.session import Bench
from conformance.commissioning.by_lss import ByLss
from conformance.commissioning.by_objects import ByObjects
from conformance.commissioning.giving import Giving, identity_of, in_the_way
from conformance.commissioning.one_by_one import connected
from conformance.commissioning.record import Record, Spot, Unit
from conformance.commissioning.searching import Search
from conformance.errors import BenchError, BenchLacks
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
        wrong = self._giving.give_node_ids(units)
        home = self._bench.reach.home
        self._bench.reach.go(home)
        if self._bench.node().answers():
            wrong.append(
                f"a sensor is still {home}, and tells nobody its serial number: look at its label"
            )
        return self._switched(units, wrong)

    def _switched(self, units: Sequence[Unit], wrong: Sequence[str]) -> list[str]:
        """Give sensors their bit rate if it is another, and nothing went wrong so far."""
        if not any(unit.switches for unit in units):
            return [*wrong]
        if wrong:
            return [
                *wrong,
                "the bit rate was left as it is: bring them back by --undo, then begin anew",
            ]
        return self._giving.switch(units)

    def one_by_one(self, node_ids: Sequence[int], bitrate: int) -> list[str]:
        """Give sensors their places as the operator connects them, as `all_at_once` does.

        Nobody is asked for more of them than there are node-IDs.
        """
        alone = bitrate != self._bench.reach.home.bitrate
        wrong = []
        for _, identity in zip(node_ids, connected(self._bench, alone=alone), strict=False):
            (unit,) = self._add([identity], node_ids, bitrate)
            console.say(f"connected: {unit}")
            wrong += self._switched([unit], self._giving.give_node_ids([unit]))
        return wrong

    def back(self, *, one_by_one: bool) -> list[str]:
        """Bring all sensors of the record to where they were found; return what went wrong.

        Args:
            one_by_one: The operator connects one after the other.
        """
        units = self._record.in_force
        if not one_by_one and not self._act_at_once(units):
            return self._giving.take_back(units)
        wrong: list[str] = []
        for nth, unit in enumerate(units, 1):
            if not self._bench.operator.connect(
                nth, f"{unit} and no other (it is expected as {unit.given.place})"
            ):
                return [*wrong, f"{len(units) - nth + 1} sensors were not connected"]
            wrong += self._giving.take_back([unit])
        return wrong

    def _act_at_once(self, units: Sequence[Unit]) -> bool:
        """Tell whether one sensor would be at another bit rate than the rest before these are told."""
        service = self._bench.spec.services.bitrate
        at_once = self._by_lss is None and service is not None and service.effective == "at-once"
        return at_once and len(units) > 1 and any(unit.switches for unit in units)

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
        if bitrate != home.bitrate:
            self._require_switch({*answer} - {home.node_id}, bitrate)
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

    def _require_switch(self, others: Collection[int], bitrate: int) -> None:
        """Make sure that bench and bus let all have another bit rate.

        Raises:
            BenchError: They do not.
        """
        reach = self._bench.reach
        if others:
            raise BenchError(in_the_way(others, reach.home.bitrate))
        try:
            reach.go(Place(reach.home.node_id, bitrate))
        except BenchLacks as error:
            raise BenchError(str(error)) from error
        reach.go(reach.home)
