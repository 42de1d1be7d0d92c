"""Heartbeat producer and boot-up message (CiA 301 v4.2.0, 7.2.8.3.2.2 and 7.5.2.20)."""

from __future__ import annotations

from functools import partial

from conformance.simulator.node import Node
from conformance.spec.document import HeartbeatProducer as HeartbeatSpec
from conformance.spec.model import Entry, Range
from conformance.wire import cob_id
from conformance.wire.datatypes import Value
from conformance.wire.frame import Frame
from conformance.wire.nmt import Heartbeat, NmtState, encode_heartbeat

_MS = 1_000_000
_LATE_NS = 50 * _MS
"""How much later than its services a defective device announces itself."""

_TOGGLE = 0x80

_STRANGE_NS = 2 * _MS
"""How long a frame for others keeps a defective device busy."""

_STARVED_NS = 10 * _MS
"""From what is left to do for frames of others it has no time for its heartbeat."""


class HeartbeatProducer:
    """Sends the boot-up message and, where the device has a heartbeat, the NMT state at its period."""

    def __init__(self, node: Node, spec: HeartbeatSpec | None) -> None:
        self._node = node
        self._timer = node.agenda.timer(self._beat_due)
        self._jittered = node.agenda.timer(lambda _due_ns: self._beat())
        self._told = NmtState.PRE_OPERATIONAL
        self._period_ns = 0
        self._waits_for_command = False
        self._toggle = 0
        self._busy_until_ns = 0
        self._off = 0 if spec is None else spec.off
        self._states = () if spec is None else tuple(_states(spec))
        self._key = None if spec is None else (spec.object, 0)
        if self._key is None or self._key not in node.dictionary.entries:
            return
        node.dictionary.observers[self._key].append(self._period_written)
        if spec is not None:
            node.dictionary.ranges[self._key] = _accepted(spec, node.dictionary.entries[self._key])
        if spec is not None and spec.below_minimum == "clamped":
            least = spec.min_ms
            node.dictionary.adjusts[self._key] = lambda value: (
                value if value == self._off else max(least, int(value))
            )
        if spec is not None and spec.below_minimum == "ignored":
            node.dictionary.adjusts[self._key] = partial(self._unless_too_short, spec)

    def _unless_too_short(self, spec: HeartbeatSpec, value: Value) -> Value:
        fits = value == spec.off or int(value) >= spec.min_ms
        return value if fits else self._node.dictionary.number(spec.object)

    def boot(self) -> None:
        """Send the boot-up message, which counts as the first heartbeat."""
        if self._node.faults.boot_up == "late":
            self._node.agenda.after(_LATE_NS, self._announce)
        elif self._node.faults.boot_up != "missing":
            self._announce()
        if not self._node.faults.heartbeat_waits_after_start:
            self.resume()

    def _announce(self) -> None:
        node_id = self._node.faults.boot_up_node_id or self._node.node_id
        as_state = self._node.faults.boot_up == "as-state"
        told = NmtState.PRE_OPERATIONAL if as_state else NmtState.BOOT_UP
        frame = encode_heartbeat(Heartbeat(node_id, told))
        for _ in range(2 if self._node.faults.boot_up == "twice" else 1):
            self._node.send(frame)

    def resume(self) -> None:
        """Take over the period; the first heartbeat comes after it."""
        if self._key is not None:
            self._set_period(self._node.dictionary.number(*self._key))
            if self._period_ns:
                self._timer.start(self._node.agenda.now_ns + self._period_ns)

    def entered(self, before: NmtState) -> None:
        """Note a change of state."""
        if self._node.state is not before:
            self._told = before
        if self._waits_for_command:
            self._start()

    def requested(self) -> None:
        """Answer a guarding request, as only a defective device does."""
        if self._node.faults.answers_guarding:
            self._toggle ^= _TOGGLE
            state = self._node.state | (self._toggle ^ _TOGGLE)
            self._node.send(Frame(cob_id.heartbeat(self._node.node_id), bytes((state,))))

    def overheard(self) -> None:
        """Note a frame for others: many of them keep a defective device from its heartbeat."""
        now_ns = self._node.agenda.now_ns
        busy_until_ns = max(self._busy_until_ns, now_ns) + _STRANGE_NS
        self._busy_until_ns = min(busy_until_ns, now_ns + 2 * _STARVED_NS)

    def _period_written(self, value: Value) -> None:
        faults, before_ns = self._node.faults, self._period_ns
        if value == self._off and faults.heartbeat_never_stops and before_ns:
            return
        if value != self._off and faults.heartbeat_keeps_period and before_ns:
            return
        self._set_period(int(value))
        if faults.heartbeat_ends_when_written_again and self._period_ns == before_ns:
            self._period_ns = 0
        if self._node.faults.heartbeat_starts_late:
            self._timer.stop()
            self._waits_for_command = True
            return
        self._start()

    def _set_period(self, value: int) -> None:
        factor = self._node.faults.heartbeat_period_factor
        if value != self._off and self._node.faults.heartbeat_wraps_ms is not None:
            value %= self._node.faults.heartbeat_wraps_ms
        self._period_ns = 0 if value == self._off else round(value * _MS * factor)

    def _start(self) -> None:
        """Begin at once: the first heartbeat now, the next one a period later."""
        self._waits_for_command = False
        self._timer.stop()
        if self._period_ns:
            self._beat_due(self._node.agenda.now_ns)

    def _beat_due(self, due_ns: int) -> None:
        operational = self._node.state is NmtState.OPERATIONAL
        factor = self._node.faults.heartbeat_factor_operational if operational else 1.0
        self._timer.start(due_ns + round(self._period_ns * factor))
        jitter_ns = round(self._node.faults.heartbeat_jitter_ms * _MS)
        if jitter_ns:
            self._jittered.start(due_ns + self._node.random.randint(0, jitter_ns))
        else:
            self._beat()

    def _beat(self) -> None:
        if self._node.state not in self._states or self._starves():
            return
        told = self._told if self._node.faults.heartbeat_wrong_state else self._node.state
        frame = encode_heartbeat(Heartbeat(self._node.node_id, told))
        octets = self._node.faults.heartbeat_octets
        self._node.send(Frame(frame.can_id, frame.data[:octets].ljust(octets, b"\0")))

    def _starves(self) -> bool:
        """Return whether there is no time for a heartbeat, which may be the end of all."""
        left_ns = self._busy_until_ns - self._node.agenda.now_ns
        under_load = self._node.faults.heartbeat_under_load
        if under_load == "comes" or left_ns < _STARVED_NS:
            return False
        if under_load == "ends":
            self._period_ns = 0
            self._timer.stop()
        return True


def _accepted(spec: HeartbeatSpec, entry: Entry) -> tuple[Range, ...]:
    """Return the times that a download may have: inside the entry's ranges and the service's."""
    whole = ((entry.type.minimum, entry.type.maximum),)
    if spec.below_minimum != "refused":
        return ((spec.off, entry.type.maximum),)
    service = ((spec.off, spec.off), (spec.min_ms, spec.max_ms))
    return tuple(
        (max(low, first), min(high, last))
        for low, high in entry.ranges or whole
        for first, last in service
        if max(low, first) <= min(high, last)
    )


def _states(spec: HeartbeatSpec) -> list[NmtState]:
    return [NmtState[name.upper().replace("-", "_")] for name in spec.states]
