"""EMCY producer and error register of a simulated device (CiA 301 v4.2.0, 7.2.7, 7.5.2.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from conformance.simulator.cob_id_rules import CAN_ID, NOT_VALID
from conformance.simulator.history import ErrorHistory
from conformance.simulator.live import LiveValues
from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.node import Node
from conformance.spec.document import Follows
from conformance.spec.fields import of_variant
from conformance.spec.model import DeviceSpec
from conformance.spec.service import TiltAxis
from conformance.wire import emcy
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtState

_MS: Final = 1_000_000
NO_ERROR: Final = 0x0000
INHIBIT_UNIT_NS: Final = 100_000
_FILLING: Final = 0xA5
_BIT_30: Final = 1 << 30

_GENERIC: Final = 0
_MANUFACTURER: Final = 7
_BITS: Final = {0x10: _GENERIC, 0x20: 1, 0x30: 2, 0x40: 3, 0x81: 4, 0x82: 4}
"""Error register bit by the upper byte of the code, its lower half ignored but for 81h and 82h."""


@dataclass(frozen=True, slots=True)
class Error:
    """An error.

    Args:
        code: Its emergency error code; None for one that shows in the register alone.
        bit: Of the manufacturer code, if any.
        register: Its bits of the error register; those of its code when empty.
    """

    code: int | None
    bit: int | None = None
    register: tuple[int, ...] = field(default=(), compare=False)


class EmcyProducer:
    """Sends an EMCY when an error comes or goes, and keeps register and history.

    Args:
        node: The node.
        spec: The device spec.
        live: The measured values.
        memory: Keeps the history of a device whose history is persistent.
        enter: Changes the NMT state.
    """

    def __init__(
        self,
        node: Node,
        spec: DeviceSpec,
        live: LiveValues,
        memory: NonVolatileMemory,
        enter: Callable[[NmtState], None],
    ) -> None:
        self._node = node
        self._spec = spec.services.emcy_producer
        self._live = live
        self._enter = enter
        self._errors: dict[Error, None] = {}
        self._history = ErrorHistory(node, self._spec, memory)
        self._waiting: list[Frame] = []
        self._free_ns = 0
        self._latched = 0
        self._inhibited = node.agenda.timer(lambda _due_ns: self._send_waiting())
        for entry in node.dictionary.entries.values():
            if entry.follows == "error-register":
                node.dictionary.computed[entry.key] = self._register
        if self._spec is None:
            return
        self._word_at_start = node.dictionary.number(self._spec.object)
        if self._spec.manufacturer_code is not None:
            key = self._spec.manufacturer_code.object, 0
            node.dictionary.computed[key] = self._manufacturer_code
        self._limits = {
            cause.cause: limits
            for cause in self._spec.causes
            if (limits := of_variant(cause.limits, spec.variant)) is not None
        }
        for cause in self._spec.causes:
            if cause.stops and cause.cause in self._limits:
                low, high = self._limits[cause.cause]
                live.stops[cause.cause] = (low, high)

    def update(self) -> None:
        """Find out which axes are beyond their limits now."""
        if self._spec is None:
            return
        found: dict[Error, TiltAxis] = {}
        for cause in self._spec.causes:
            if self._is_beyond(cause.cause):
                found.setdefault(Error(cause.code, cause.bit), cause.cause)
        for cause in self._spec.causes:
            ends = self._spec.lasts == "while-present"
            if ends and Error(cause.code, cause.bit) not in found:
                self.clear_error(cause.code, cause.bit)
        for error, axis in found.items():
            self.raise_error(error.code, error.bit, axis)

    def _is_beyond(self, axis: Follows) -> bool:
        entries = self._node.dictionary.entries.values()
        followed = [entry for entry in entries if entry.follows == axis]
        if not followed:
            return False
        if axis in self._limits:
            low, high = self._limits[axis]
            return self._live.beyond(axis, low, high)
        return any(self._live.out_of_range(entry) for entry in followed)

    def has_error(self, code: int) -> bool:
        """Return whether an error with a code is present."""
        return any(error.code == code for error in self._errors)

    @property
    def beyond_limits(self) -> bool:
        """Whether an angle is in error."""
        causes = self._spec.causes if self._spec is not None else ()
        return any(Error(cause.code, cause.bit) in self._errors for cause in causes)

    def raise_error(
        self,
        code: int | None,
        bit: int | None = None,
        axis: TiltAxis | None = None,
        register: Iterable[int] = (),
    ) -> None:
        """An error has occurred, found at an axis or elsewhere."""
        error = Error(code, bit, tuple(register))
        if error in self._errors:
            return
        first = not self._errors
        self._errors[error] = None
        if code is not None:
            self._history.enter(code)
            if first or self._tells_each_change:
                self._send(code)
                self._tell_again(error)
        self._leave(axis)

    def _tell_again(self, error: Error) -> None:
        """Tell an error again and again, as only a defective device does."""
        every_ms = self._node.faults.emcy_every_ms
        if every_ms is not None:
            self._node.agenda.after(every_ms * _MS, partial(self._tell_if_present, error))

    def _tell_if_present(self, error: Error) -> None:
        if error in self._errors and error.code is not None:
            self._send(error.code)
            self._tell_again(error)

    def tell(self, code: int) -> None:
        """Tell an event that is no error."""
        self._history.enter(code)
        self._send(code)

    def clear_error(self, code: int | None, bit: int | None = None) -> None:
        """An error has gone."""
        error = Error(code, bit)
        if error not in self._errors:
            return
        del self._errors[error]
        if self._spec is None or code is None:
            return
        if self._spec.history_keeps == "errors-and-resets":
            self._history.enter(NO_ERROR)
        if self._spec.cleared == "silent":
            return
        told = not self._errors or self._tells_each_change
        if told and not self._node.faults.emcy_never_clears:
            self._send(NO_ERROR)

    @property
    def _tells_each_change(self) -> bool:
        each = self._spec is not None and self._spec.sends == "each-change"
        return each and not self._node.faults.emcy_first_error_only

    def boot(self) -> None:
        """Tell the errors found during initialisation."""
        self.update()
        if self._node.faults.emcy_at_boot:
            self._send(NO_ERROR)

    def _leave(self, axis: TiltAxis | None) -> None:
        """Enter the state that an error leads to."""
        rule = self._spec.on_error if self._spec is not None else None
        if self._node.faults.error_state is not None:
            self._enter(NmtState[self._node.faults.error_state.upper().replace("-", "_")])
            return
        if rule is None or self._node.dictionary.state not in rule.leaves or axis in rule.mild:
            return
        state = rule.state
        if rule.object is not None:
            state = rule.states.get(self._node.dictionary.number(rule.object))
        if state is not None:
            self._enter(NmtState[state.upper().replace("-", "_")])

    def _register(self) -> int:
        known = self._spec.register_bits if self._spec is not None else {}
        faults = self._node.faults
        register = self._latched
        for error in self._errors if known else ():
            bits = error.register or (_GENERIC, _register_bit(error.code or NO_ERROR, known))
            register |= sum({1 << bit for bit in bits})
        if faults.error_register_latched:
            self._latched = register
        if faults.error_register_without_bit_0:
            register &= ~(1 << _GENERIC)
        return register | (1 << _GENERIC if faults.error_register_stuck else 0)

    def _manufacturer_code(self) -> int:
        present = sum({1 << error.bit for error in self._errors if error.bit is not None})
        return present | self._node.faults.manufacturer_code_bits

    def _send(self, code: int) -> None:
        spec, node = self._spec, self._node
        if spec is None or node.faults.emcy_missing:
            return
        states = [*spec.states, *node.faults.emcy_states]
        if node.dictionary.state not in states:
            return
        word = node.dictionary.number(spec.object)
        if word & NOT_VALID and not node.faults.emcy_ignores_bit_31:
            return
        enabling = 1 << spec.enabled_by if spec.enabled_by is not None else 0
        if word & enabling != enabling or (node.faults.emcy_off_by_bit_30 and word & _BIT_30):
            return
        if node.faults.emcy_keeps_cob_id:
            word = self._word_at_start
        frame = emcy.encode(self._message(code), word & CAN_ID)
        if node.faults.emcy_short:
            frame = Frame(frame.can_id, frame.data[:3])
        for _ in range(1 + node.faults.emcy_repeats):
            self._queue(frame)

    def _message(self, code: int) -> emcy.Emergency:
        faults = self._node.faults
        filling = _FILLING if self._spec is not None and self._spec.other_octets == "any" else 0
        own = bytearray([filling] * 5)
        place = self._spec.manufacturer_code if self._spec is not None else None
        if place is not None and not faults.emcy_without_manufacturer_code:
            own[place.octet] = self._manufacturer_code() & 0xFF
        if faults.emcy_code_plus_one:
            code += 1
        if faults.emcy_code_swapped:
            code = (code & 0xFF) << 8 | code >> 8
        register = self._register() ^ (_FILLING if faults.emcy_wrong_register else 0)
        return emcy.Emergency(code, register, bytes(own))

    def _queue(self, frame: Frame) -> None:
        """Send a frame now, or as soon as the inhibit time is over."""
        spec, now_ns = self._spec, self._node.agenda.now_ns
        inhibit = 0
        if spec is not None and spec.inhibit and not self._node.faults.emcy_ignores_inhibit_time:
            inhibit = self._node.dictionary.number(spec.inhibit)
        if now_ns < self._free_ns and inhibit:
            if spec is not None and spec.inhibited == "delayed":
                self._waiting.append(frame)
                self._inhibited.start(self._free_ns)
            return
        self._node.send(frame)
        self._free_ns = now_ns + inhibit * INHIBIT_UNIT_NS

    def _send_waiting(self) -> None:
        waiting, self._waiting = self._waiting, []
        for frame in waiting:
            self._queue(frame)


def _register_bit(code: int, known: Mapping[int, str]) -> int:
    upper = code >> 8
    bit = _BITS.get(upper if upper in _BITS else upper & 0xF0, _MANUFACTURER)
    if bit in known:
        return bit
    return _MANUFACTURER if _MANUFACTURER in known else _GENERIC
