"""A device made with durand, a CANopen library that nobody here wrote; its EDS is durand's own.

All stack behaviour is durand's. What is added is the application that its documentation leaves to
the user: the objects and their values.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import can
import durand  # type: ignore[import-untyped]  # it has no types
from durand.node import Node, NodeCapabilities  # type: ignore[import-untyped]  # nor here
from durand.scheduler import AbstractScheduler, SyncScheduler  # type: ignore[import-untyped]  # nor here
from virtual_time import Station

from conformance.simulator.agenda import Timer
from conformance.simulator.segment import SECOND

NODE_ID = 0x01
DEVICE_TYPE = 0x0002_0191
STORED_EDS = 0x1021
SIZE = NodeCapabilities(sdo_servers=1, rpdos=1, tpdos=2)
TEMPERATURE, LIMITS = 0x6000, 0x2001


class Scheduler(AbstractScheduler[Timer]):  # type: ignore[misc]  # durand has no types
    """durand's timers on a station's agenda."""

    def __init__(self, station: Station) -> None:
        self._agenda = station.agenda

    def add(
        self,
        delay: float,
        callback: Callable[..., object],
        args: tuple[Any, ...] = (),
        kwargs: dict[str, Any] | None = None,
    ) -> Timer:
        def fire(_due_ns: int) -> None:
            callback(*args, **kwargs or {})

        timer = self._agenda.timer(fire)
        timer.start(self._agenda.now_ns + round(delay * SECOND))
        return timer

    def cancel(self, entry: Timer) -> None:
        entry.stop()

    @property
    def lock(self) -> None:
        raise NotImplementedError


def boot(bus: can.BusABC, station: Station | None) -> Any:
    """Start the device on a bus, with timers of its own where there is no station."""
    if station is None:
        scheduler = SyncScheduler()
        threading.Thread(target=scheduler.run, daemon=True).start()
    else:
        scheduler = Scheduler(station)
    durand.set_scheduler(scheduler)
    network = durand.CANBusNetwork(bus)
    node = Node(network, NODE_ID, capabilities=SIZE)
    node.eds.device_info.VendorName = "Nobody"
    node.eds.device_info.BaudRate_125 = 1
    add_objects(node.object_dictionary)
    node.tpdo[0].mapping = [(TEMPERATURE, 0)]
    node.tpdo[1].mapping = [(TEMPERATURE, 0), (LIMITS, 1), (LIMITS, 2)]
    node.tpdo[1].transmission_type = 1
    return node


def add_objects(dictionary: Any) -> None:
    """Add what a small thermometer has."""
    kind = durand.DatatypeEnum
    dictionary.write(0x1000, 0, DEVICE_TYPE)
    dictionary.write(0x1008, 0, b"thermometer")
    dictionary.write(0x1009, 0, b"A")
    dictionary.write(0x100A, 0, b"1.00")
    for sub, value in enumerate((0x0000_0001, 0x0000_0002, 0x0001_0000, 0x0000_2A17), 1):
        dictionary.write(0x1018, sub, value)
    dictionary[0x2000] = durand.Variable(
        kind.UNSIGNED16, "rw", 100, minimum=10, maximum=2000, name="Filter time"
    )
    limits = durand.Record(name="Limits")
    limits[1] = durand.Variable(kind.INTEGER16, "rw", -400, name="Low limit")
    limits[2] = durand.Variable(kind.INTEGER16, "rw", 850, name="High limit")
    limits[3] = durand.Variable(kind.REAL32, "rw", 0.5, name="Hysteresis")
    dictionary[LIMITS] = limits
    dictionary[0x2002] = durand.Variable(
        kind.VISIBLE_STRING, "rw", b"hall 3, rack 12", name="Place"
    )
    dictionary[0x2003] = durand.Variable(kind.UNSIGNED64, "rw", 0, name="Tag")
    dictionary[0x2004] = durand.Variable(kind.UNSIGNED8, "wo", 0, name="Blink")
    dictionary[TEMPERATURE] = durand.Variable(kind.INTEGER16, "ro", 215, name="Temperature")


def eds_of(node: Any) -> str:
    """Return the EDS that durand makes of the dictionary."""
    content: str = node.eds.content
    return content


def contents(node: Any) -> dict[str, Any]:
    """Return what every entry holds, by its address; 1021h is the EDS, made anew each time."""
    dictionary = node.object_dictionary
    return {
        f"{index:04X}h:{sub:02X}": dictionary.read(index, sub)
        for index, item in dictionary
        if index != STORED_EDS
        for sub, _ in ([(0, item)] if isinstance(item, durand.Variable) else item)
    }
