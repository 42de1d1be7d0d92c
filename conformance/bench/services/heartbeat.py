"""The node's heartbeats: switched by its producer heartbeat time and observed on the bus."""

from __future__ import annotations

from conformance.bench.bus.intervals import gaps_ms, mean_ms
from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.errors import SetupRefused
from conformance.spec.document import HeartbeatProducer
from conformance.wire.errors import WireError
from conformance.wire.nmt import NmtCommand, NmtState, decode_heartbeat

TYPICAL_MS = 100
NO_HEARTBEAT = "no heartbeat"


class HeartbeatPort:
    """Heartbeat producer of a node.

    Args:
        node: The node under test.
        producer: The spec's heartbeat service.
    """

    def __init__(self, node: Node, producer: HeartbeatProducer | None) -> None:
        if producer is None:
            raise SetupRefused("the manual documents no heartbeat, by which the state is seen")
        self._node = node
        self.producer = producer

    @property
    def typical_ms(self) -> int:
        """A period well inside the documented range."""
        return min(max(TYPICAL_MS, self.producer.min_ms), self.producer.max_ms)

    def enter(self) -> None:
        """Bring the node to a state in which the manual has it produce heartbeats."""
        if "pre-operational" not in self.producer.states:
            self._node.nmt(NmtCommand.START)

    def set(self, period_ms: int) -> None:
        """Write the producer heartbeat time; for set-up."""
        self._node.download(self.producer.object, 0, period_ms)

    def collect(self, count: int, timeout_s: float) -> list[Stamped]:
        """Receive until ``count`` heartbeats came, or the time is over."""
        return self._node.link.collect(count, timeout_s, self._node.is_error_control)

    def beats(self, count: int, period_ms: int) -> list[Stamped]:
        """Return ``count`` + 1 heartbeats of about this period, fewer when they stay away."""
        return self.collect(count + 1, (count + 2) * period_ms * 2 / 1000 + 0.1)

    def gaps_ms(self, count: int, period_ms: int) -> list[float]:
        """Return the intervals between ``count`` + 1 heartbeats, fewer when they stay away."""
        return self.rhythm(count, period_ms)[0]

    def rhythm(
        self, count: int, period_ms: int, near_ms: float | None = None
    ) -> tuple[list[float], list[float]]:
        """Return the intervals between ``count`` + 1 heartbeats and, as a list of one, their mean.

        Args:
            count: Intervals wanted; fewer are returned when heartbeats stay away.
            period_ms: About what they are.
            near_ms: What they should be, if that is not the same.
        """
        seen = self.beats(count, period_ms)
        near_ms = period_ms if near_ms is None else near_ms
        link = self._node.link
        return gaps_ms(link, seen, near_ms), mean_ms(link, seen, near_ms)

    def state(self) -> str:
        """Return the state that the heartbeats report once three periods have passed.

        With the heartbeat off it is switched on; it stays on until the check is over.
        """
        if self._node.number(self.producer.object) != self.typical_ms:
            self.set(self.typical_ms)
        return self.state_now()

    def state_now(self) -> str:
        """Return the state that the third heartbeat from now reports; no SDO is needed."""
        seen = self.collect(3, self.typical_ms * 6 / 1000)
        return state_of(seen[-1]) if len(seen) >= 3 else NO_HEARTBEAT


def state_of(heartbeat: Stamped) -> str:
    """Return the NMT state in a heartbeat as the standard names it."""
    try:
        return name_of(decode_heartbeat(heartbeat.frame).state)
    except WireError:
        return f"none ({heartbeat.frame})"


def name_of(state: NmtState) -> str:
    """Return the state's name: ``Pre-operational (7Fh)``."""
    return f"{state.name.replace('_', '-').capitalize()} ({state.value:02X}h)"
