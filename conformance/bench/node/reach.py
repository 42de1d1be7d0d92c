"""Where the node is reached, node-ID and bit rate: the bench follows it there and brings it back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from conformance.bench.bus.link import Link
from conformance.bench.node.channel import SdoChannel
from conformance.bench.node.node import Node
from conformance.errors import BenchError, BenchLacks, NodeTimeout, SetupRefused
from conformance.interrupts import uninterrupted
from conformance.spec.bit_rates import documented_rates
from conformance.spec.model import DeviceSpec, Key
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand

_ERROR_CONTROL = 0x700
AT_ONCE_S = 0.05
"""From the answer to a change that takes effect at once to the first look."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a node is reached.

    Args:
        node_id: 1..127.
        bitrate: In bit/s.
    """

    node_id: int
    bitrate: int

    def __str__(self) -> str:
        return f"node-ID {self.node_id} at {self.bitrate / 1000:g} kbit/s"


class Astray(NodeTimeout):
    """The node was given back the place where it was found, and answers at another one."""

    def __init__(self, home: Place, place: Place) -> None:
        super().__init__(f"the node does not come back as {home}; it is {place}")
        self.place = place


class Reach:
    """Moves the bench to the node's node-ID and bit rate, and the node back to where it was.

    The one order of use: `begin`, then write a new node-ID or bit rate (with `write`, or by other
    means), then `reset`, `power_cycle` or `find` with the places at which the node may be; the
    bench is where it was found. At the end, whatever happened, `bring_home`.

    Args:
        link: The link to the bus.
        channel: The node's SDO server; it follows to the node-ID.
        spec: What the node is held against.
        home: Where the node is before and after each check.
        boot_up_timeout_s: Longest wait for a node after a restart.
    """

    def __init__(
        self,
        link: Link,
        channel: SdoChannel,
        spec: DeviceSpec,
        home: Place,
        boot_up_timeout_s: float,
    ) -> None:
        self._link = link
        self._channel = channel
        self._spec = spec
        self.home = home
        self.here = home
        self._timeout_s = boot_up_timeout_s
        self._visited: dict[Place, None] = {}
        self._found: dict[Key, bytes] | None = None

    # Away

    def begin(self, node: Node) -> None:
        """Reset the node and note what the objects hold that say how it is reached.

        Saving keeps all settings: after the reset there are none that were not saved already.
        """
        if self._found is None:
            node.reset()
            self._found = {key: node.upload(*key) for key in self._objects() if self._reads(key)}

    def write(self, node: Node, keys: Iterable[Key], data: bytes, *places: Place) -> None:
        """Write a node-ID or bit rate to objects, for set-up.

        Args:
            node: The node under test.
            keys: The objects: all that must agree.
            data: The value.
            places: Where the node may be at once, the likeliest first.

        Raises:
            SetupRefused: An object does not take it.
        """
        for key in keys:
            transfer = node.write(*key, data)
            if transfer.refused:
                raise SetupRefused(f"node {node.node_id} refused a new place: {transfer}")
            if places:
                self._link.listen(AT_ONCE_S, lambda _: False)
                self.find(node, self.here, *places)

    @uninterrupted()
    def go(self, place: Place) -> None:
        """Speak with the node at a place from now on; the node is not touched.

        Raises:
            BenchLacks: The adapter does not take the bit rate; the bench stays where it is.
        """
        if place.bitrate != self.here.bitrate:
            try:
                self._link.use_bitrate(place.bitrate)
            except BenchError as error:
                raise BenchLacks(
                    f"the adapter does not take {place.bitrate / 1000:g} kbit/s: {error}"
                ) from error
        if place != self.home:
            self._visited[place] = None
        self._channel.follow(place.node_id)
        self.here = place

    def find(self, node: Node, *places: Place) -> Place | None:
        """Go to the first of some places at which the node answers; None when it does nowhere."""
        for place in places:
            self.go(place)
            if node.answers():
                return place
        return None

    def reset(
        self, node: Node, *places: Place, command: NmtCommand = NmtCommand.RESET_NODE
    ) -> Place | None:
        """Reset the node where it is now and go to where it comes back.

        Args:
            node: The node under test.
            places: Where it may come back, the likeliest first.
            command: Which reset.

        Returns:
            The place, None when it is at none of them.
        """
        return self._come_back(node, node.begin_reset(command), places)

    def power_cycle(self, node: Node, *places: Place) -> Place | None:
        """Switch the node off and on and go to where it comes back, as `reset` does."""
        return self._come_back(node, node.begin_power_cycle(), places)

    def _come_back(self, node: Node, mark: int, places: tuple[Place, ...]) -> Place | None:
        likeliest, *_ = places
        self.go(likeliest)
        by_id = {p.node_id: p for p in reversed(places) if p.bitrate == likeliest.bitrate}
        boot_ups = {cob_id.heartbeat(node_id): place for node_id, place in by_id.items()}

        def is_boot_up(frame: Frame) -> bool:
            return frame.can_id in boot_ups and frame.data == b"\0" and not frame.remote

        seen = self._link.wait(is_boot_up, self._timeout_s, mark)
        first = places if seen is None else (boot_ups[seen.frame.can_id], *places)
        found = self.find(node, *first)
        if found is not None:
            node.hold_back()
        return found

    def expect(self, held: Mapping[Key, bytes]) -> None:
        """Take it that `begin` was called when the node held this, by somebody who is gone."""
        self._found = {key: held[key] for key in self._objects() if key in held}

    # And back

    @uninterrupted()
    def bring_home(self, node: Node, write: Callable[[], None] | None = None) -> None:
        """Bring node and bench to where they were before `begin`, also after a failure half-way.

        A reset is enough when nothing was kept; else the objects are written back and saved.

        Args:
            node: The node under test.
            write: Gives the node its place back by other means than objects.

        Raises:
            NodeTimeout: The node is found nowhere, or does not come home.
            Astray: It answers where it must not be any more.
        """
        if self._found is None and not self._visited:
            return
        places = tuple(dict.fromkeys((self.here, self.home, *self._visited)))
        try:
            self._back(node, places, write)
        finally:
            self.go(self.home)
            self._visited.clear()
            self._found = None

    def _back(
        self, node: Node, places: tuple[Place, ...], write: Callable[[], None] | None
    ) -> None:
        if self.find(node, *places) is None and self.search(node, *places) is None:
            raise NodeTimeout(f"the node answers neither as {' nor as '.join(map(str, places))}")
        self.reset(node, *dict.fromkeys((self.here, *places)))
        if self._is_home(node):
            return
        if write is not None:
            write()
        self._write_back(node)
        self.reset(node, self.home, *places)
        if not self._is_home(node) and node.switchable:
            self.power_cycle(node, self.home, *places)
        if not self._is_home(node):
            answers = node.answers() or self.search(node, *places) is not None
            if answers and self.here != self.home:
                raise Astray(self.home, self.here)
            raise NodeTimeout(f"the node does not come back as {self.home}")

    def search(self, node: Node, *places: Place) -> Place | None:
        """Look for the node at any node-ID when it starts anew, where the bench can make it.

        Args:
            node: The node under test.
            places: Those of the likeliest bit rates, which are tried first.

        Returns:
            The place, to which the bench has gone; None where there is none.
        """
        if not node.switchable:
            return None
        visited = [place.bitrate for place in places]
        for bitrate in dict.fromkeys((*visited, *documented_rates(self._spec))):
            self.go(Place(self.home.node_id, bitrate))
            mark = node.begin_power_cycle()
            seen = self._link.wait(is_any_boot_up, self._timeout_s, mark)
            if seen is not None:
                self.go(Place(node_id_of(seen.frame), bitrate))
                return self.here
        return None

    def _write_back(self, node: Node) -> None:
        """Write back what the objects held; after each the node may be home already."""
        for key, data in (self._found or {}).items():
            node.write(*key, data)
            self.find(node, self.here, self.home)
        node.save({index for index, _ in self._objects()})

    def _is_home(self, node: Node) -> bool:
        if self.here != self.home or not node.answers():
            return False
        return all(node.upload(*key) == data for key, data in (self._found or {}).items())

    def _objects(self) -> tuple[Key, ...]:
        """Return the objects that hold node-ID and bit rate: aliases and partners included."""
        services = self._spec.services
        moved = [s for s in (services.node_id, services.bitrate) if s is not None]
        keys = [key for service in moved for key in self._spec.companions((service.object, 0))]
        return tuple(dict.fromkeys(keys))

    def _reads(self, key: Key) -> bool:
        entry = self._spec.entry(*key)
        return entry is not None and entry.readable and entry.writable


def node_id_of(boot_up: Frame) -> int:
    """Return the node-ID of a boot-up message."""
    return boot_up.can_id - _ERROR_CONTROL


def is_any_boot_up(frame: Frame) -> bool:
    """Tell whether a frame is the boot-up message of whichever node-ID."""
    first = _ERROR_CONTROL
    return first < frame.can_id <= first + 127 and frame.data == b"\0" and not frame.remote
