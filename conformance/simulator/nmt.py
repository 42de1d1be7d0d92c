"""NMT slave: which commands concern the node and what they do to it (CiA 301 v4.2.0, 7.2.8)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from conformance.simulator.node import Node
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState, decode_request

_STATES: Final = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
_NAMES: Final = {
    NmtCommand.START: "start",
    NmtCommand.STOP: "stop",
    NmtCommand.ENTER_PRE_OPERATIONAL: "enter-pre-operational",
    NmtCommand.RESET_NODE: "reset-node",
    NmtCommand.RESET_COMMUNICATION: "reset-communication",
}
_WORDS: Final = {
    NmtState.BOOT_UP: "",
    NmtState.PRE_OPERATIONAL: "pre-operational",
    NmtState.OPERATIONAL: "operational",
    NmtState.STOPPED: "stopped",
}


class NmtSlave:
    """Obeys node control.

    Args:
        node: The node.
        enter: Enters a state.
        reset: Resets the node (RESET_NODE) or its communication (RESET_COMMUNICATION).
    """

    def __init__(
        self,
        node: Node,
        enter: Callable[[NmtState], None],
        reset: Callable[[NmtCommand], None],
    ) -> None:
        self._node = node
        self._enter = enter
        self._reset = reset

    def receive(self, frame: Frame) -> None:
        """Handle a frame with CAN-ID 000h; one that is no command to this node is ignored."""
        if self._node.faults.nmt_obeys_wrong_length and len(frame.data) > 2:
            frame = Frame(frame.can_id, frame.data[:2])
        try:
            request = decode_request(frame)
        except WireError:
            return
        command = self._known(request.command)
        if command is None:
            return
        if not self._concerned(request.node_id) or _NAMES[command] in self._node.faults.nmt_ignores:
            return
        state = _STATES.get(command)
        if state is self._node.state and self._node.faults.nmt_resets_on_repetition:
            self._reset(NmtCommand.RESET_NODE)
        elif state is not None:
            self._enter(state)
        elif _WORDS[self._node.state] not in self._node.faults.nmt_ignores_resets_in:
            self._reset(command)

    def _known(self, command: int) -> NmtCommand | None:
        if command in _NAMES:
            return NmtCommand(command)
        return NmtCommand.START if self._node.faults.nmt_obeys_unknown_commands else None

    def _concerned(self, node_id: int) -> bool:
        if node_id == 0:
            return not self._node.faults.nmt_ignores_broadcast
        return node_id == self._node.node_id or self._node.faults.nmt_obeys_other_nodes
