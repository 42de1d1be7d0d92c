"""Gives a sensor its place by LSS, which tells it from others of its node-ID by its serial number (CiA 305 v3.0)."""

from __future__ import annotations

from typing import Final

from conformance.bench.node.node import Node
from conformance.bench.node.reach import Place
from conformance.bench.services.lss import index_of
from conformance.bench.services.lss_address import LssAddress
from conformance.bench.services.lss_master import DONE, ENTER, LssAnswer, LssMaster, usable_state
from conformance.bench.session import Bench
from conformance.commissioning.giving import NotSelected
from conformance.commissioning.record import Unit
from conformance.errors import SetupRefused
from conformance.spec.model import DeviceSpec
from conformance.wire import lss

_NEEDED: Final = ("configure-node-id", "store-configuration")


class ByLss:
    """LSS master that configures one slave after the other.

    Args:
        bench: The open bench.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self.master = LssMaster(bench.link, bench.definition.sdo_timeout_s)

    @staticmethod
    def can(spec: DeviceSpec) -> bool:
        """Tell whether a device documents what it takes."""
        service = spec.services.lss
        return (
            service is not None
            and "switch-state-selective" in service.waiting
            and all(it in service.configuration for it in _NEEDED)
        )

    @staticmethod
    def finds(spec: DeviceSpec) -> bool:
        """Tell whether a device documents how slaves are found whose serial numbers nobody knows."""
        service = spec.services.lss
        return service is not None and "identify-remote-slave" in service.waiting

    @staticmethod
    def rates(spec: DeviceSpec) -> list[int]:
        """Return the bit rates that can be given."""
        service = spec.services.lss
        if service is None or "configure-bit-timing" not in service.configuration:
            return []
        return sorted(lss.BIT_RATES.values())

    def prepare(self, node: Node) -> None:
        """Bring every sensor at the bench's place to where LSS works, and its slaves to LSS waiting."""
        node.nmt(ENTER[usable_state(node.spec)])
        self.master.wait()

    def configure(self, unit: Unit, start: Place, to: Place, *, rate: bool) -> Place:
        """Tell one sensor its place, to be in force after a reset.

        Args:
            unit: The sensor.
            start: Where it is.
            to: Where it is to be.
            rate: Tell it the bit rate as well.

        Returns:
            Where it is meanwhile.

        Raises:
            NotSelected: It is not there.
            SetupRefused: It does not confirm a step.
        """
        self._bench.reach.go(start)
        node = self._bench.node()
        self.prepare(node)
        try:
            answer = self.master.ask(*LssAddress(*unit.identity).select())
            if not isinstance(answer.message, lss.SwitchSelectiveReply):
                raise NotSelected(f"{unit} does not confirm that it is selected ({answer})")
            self._done(unit, "node-ID", self.master.ask(lss.ConfigureNodeId(to.node_id)))
            if rate:
                index = index_of(to.bitrate)
                assert index is not None  # required before
                timing = lss.ConfigureBitTiming(0, index)
                self._done(unit, "bit rate", self.master.ask(timing))
            self._bench.non_volatile_writes += 1
            self._done(unit, "store", self.master.ask(lss.StoreConfiguration()))
        finally:
            self.master.wait()
            self._bench.done(node, doubtful=False)
        return start

    @staticmethod
    def _done(unit: Unit, what: str, answer: LssAnswer) -> None:
        if answer.error_code != DONE:
            raise SetupRefused(f"{unit} does not confirm the {what} ({answer})")
