"""The node's LSS slave as a master sees it, and the way back to where the node was found (CiA 305 v3.0)."""

from __future__ import annotations

from conformance.bench.node.channel import SdoChannel
from conformance.bench.node.node import PROBE, Node
from conformance.bench.node.reach import Place, Reach
from conformance.bench.node.sdo import SdoPort
from conformance.bench.services.lss_address import LssAddress
from conformance.bench.services.lss_master import (
    CONFIGURATION,
    DONE,
    ENTER,
    WAITING,
    LssAnswer,
    LssMaster,
    is_answer,
    usable_state,
)
from conformance.errors import SetupRefused
from conformance.spec.document import Lss
from conformance.spec.model import StateName
from conformance.wire import lss
from conformance.wire.lss import LssCommand
from conformance.wire.nmt import NmtCommand
from conformance.wire.sdo import InitiateUpload

IDENTITY = 0x1018
SWITCH_DELAY_MS = 100
_SETTLE_S = 0.1
_MOST = 127


class LssPort(LssMaster):
    """LSS slave of a node; `leave` brings the node back to its place, whatever was configured.

    Args:
        node: The node under test, in Pre-operational.
        reach: Where it is reached.
        service: The LSS service as judged.
    """

    def __init__(self, node: Node, reach: Reach, service: Lss | None) -> None:
        if service is None:
            raise SetupRefused("the manual documents no LSS")
        super().__init__(node.link, node.channel.timeout_s)
        self.node = node
        self.reach = reach
        self.service = service
        self.address = LssAddress(*(node.number(IDENTITY, sub) for sub in range(1, 5)))
        self._away: dict[Place, None] = {}
        self._stored = False

    # Talking to the slave

    def serial_answers(self) -> list[LssAnswer]:
        """Ask for the serial number, which only a slave in LSS configuration tells."""
        return self.ask_all(lss.InquireIdentity(LssCommand.INQUIRE_SERIAL))

    @property
    def configuring(self) -> bool:
        """A slave answers what only the configuration state allows."""
        return self.ask(lss.InquireIdentity(LssCommand.INQUIRE_SERIAL)).received is not None

    # Set-up: what fails here makes the check inconclusive.

    def begin(self) -> None:
        """Reset the node before anything is stored: a store may keep every setting."""
        self.reach.begin(self.node)

    def enter(self, state: StateName | None = None) -> None:
        """Enter an NMT state, by default one in which every reading has LSS, and LSS waiting."""
        self.enter_nmt(state)
        self.wait()

    def enter_nmt(self, state: StateName | None = None) -> None:
        """Enter an NMT state, by default one in which every reading has LSS."""
        self.node.nmt(ENTER[state or usable_state(self.node.spec)])

    def settle(self) -> None:
        """Give the node time for what it may do by itself."""
        self._link.listen(_SETTLE_S, is_answer)

    def require_waiting(self) -> None:
        """Make sure that LSS waiting can be entered and told from the configuration state.

        Raises:
            SetupRefused: What belongs to the configuration state is answered in it.
        """
        self.wait()
        if self.configuring:
            raise SetupRefused("the node shows no LSS waiting state, see LSS-01")

    def configure(self, *, serial: int | None = None) -> None:
        """Switch the node to LSS configuration, it alone.

        Raises:
            SetupRefused: It does not confirm.
        """
        answer = self.ask(*self.address.select(serial))
        if not isinstance(answer.message, lss.SwitchSelectiveReply):
            raise SetupRefused(f"the node was not selected ({answer}), see LSS-03")

    def node_id(self, node_id: int) -> LssAnswer:
        """Configure a node-ID; the way back begins at the places where the node may then be."""
        known = node_id if 1 <= node_id <= _MOST else self.reach.home.node_id
        self._away[Place(known, self.reach.home.bitrate)] = None
        return self.ask(lss.ConfigureNodeId(node_id))

    def bit_timing(self, table: int, index: int) -> LssAnswer:
        """Configure a bit rate of a table."""
        rate = lss.BIT_RATES.get(index, self.reach.home.bitrate)
        self._away[Place(self.node.node_id, rate)] = None
        return self.ask(lss.ConfigureBitTiming(table, index))

    def activate(self, bitrate: int) -> None:
        """Activate what was configured, go to that bit rate, and wait until the node may send."""
        self.tell(lss.ActivateBitTiming(SWITCH_DELAY_MS))
        self._link.listen(SWITCH_DELAY_MS / 1000, is_answer)
        self.reach.go(Place(self.node.node_id, bitrate))
        self._link.listen(SWITCH_DELAY_MS / 1000 + _SETTLE_S, is_answer)

    def store(self) -> LssAnswer:
        """Store what was configured."""
        self._stored = True
        self.node.non_volatile_writes += 1
        return self.ask(lss.StoreConfiguration())

    def prepared(self, what: str, answer: LssAnswer, see: str) -> None:
        """Make sure that a configuring service was done.

        Raises:
            SetupRefused: It was not; another requirement judges that.
        """
        if answer.error_code != DONE:
            raise SetupRefused(f"{what} was not confirmed ({answer}), see {see}")

    # Where the node is

    def locate(self, *places: Place) -> Place | None:
        """Go to the first of some places at which the node answers; None when it does nowhere."""
        for place in places:
            self.reach.go(place)
            self.node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
            if self.node.answers():
                return place
        return None

    def at(self, node_id: int) -> SdoPort:
        """Return the SDO server of any node-ID, at the present bit rate."""
        if node_id == self.node.node_id:
            return self.node.sdo
        return SdoPort(SdoChannel(self._link, node_id, self.node.channel.timeout_s))

    def answers_at(self, node_id: int) -> bool:
        """Tell whether any node answers at a node-ID, at the present bit rate."""
        return self.at(node_id).ask(InitiateUpload(*PROBE)).received is not None

    def free_node_id(self) -> int:
        """Return a node-ID at which nobody answers.

        Raises:
            SetupRefused: There is none among those tried.
        """
        home = self.reach.home.node_id
        for step in range(1, 5):
            other = (home + step - 1) % (_MOST - 1) + 1
            if other != home and not self.answers_at(other):
                return other
        raise SetupRefused("no free node-ID was found next to the node's own")

    # And back

    def leave(self) -> None:
        """Bring the node to LSS waiting and to where it was found.

        Raises:
            NodeTimeout: It is found nowhere, or does not come back.
        """
        if self._away:
            self._go_back()
        else:
            self.enter()
            if self.configuring:
                self.node.reset()
        self.reach.bring_home(self.node)

    def bring_back(self) -> None:
        """Bring the node home from where it is, where somebody who is gone has left it.

        Raises:
            NodeTimeout: It is found nowhere, or does not come back.
        """
        self._away[self.reach.here] = None
        self._stored = True
        self.leave()

    def _go_back(self) -> None:
        home = self.reach.home
        mixed = [Place(a.node_id, b.bitrate) for a in self._away for b in self._away]
        places = tuple(dict.fromkeys((self.reach.here, home, *self._away, *mixed)))
        if self.locate(*places) is not None:
            self.enter_nmt()
            self._configure_home()
            if self.reach.reset(self.node, home, *places, command=NmtCommand.RESET_COMMUNICATION):
                self.node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        if self.reach.here != home and self.node.switchable:
            self.reach.power_cycle(self.node, home, *places)

    def _configure_home(self) -> None:
        """Configure the places found, and keep them if others were kept."""
        home = self.reach.home
        self.tell(lss.SwitchStateGlobal(WAITING))
        if not isinstance(self.ask(*self.address.select()).message, lss.SwitchSelectiveReply):
            self.tell(lss.SwitchStateGlobal(CONFIGURATION))
        self.ask(lss.ConfigureNodeId(home.node_id))
        index = index_of(home.bitrate)
        if index is not None and any(p.bitrate != home.bitrate for p in self._away):
            self.ask(lss.ConfigureBitTiming(0, index))
        if self._stored:
            self.store()
        if self.reach.here.bitrate != home.bitrate:
            self.activate(home.bitrate)
        self.wait()


def index_of(bitrate: int) -> int | None:
    """Return the place of a bit rate in the standard's table, None when it is not in it."""
    return next((index for index, rate in lss.BIT_RATES.items() if rate == bitrate), None)
