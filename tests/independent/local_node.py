"""A device made with python-canopen's LocalNode, which nobody here wrote; it exports its own EDS.

All stack behaviour is python-canopen's: SDO server, NMT slave, heartbeat, TPDO maps. What is added
is the application that its documentation leaves to the user, and nothing that makes a check pass:
the objects, their values, and starting and stopping of TPDOs by state, event timer and SYNC.
"""

from __future__ import annotations

import io

import can
import canopen
from canopen import objectdictionary
from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable, datatypes
from canopen.pdo import PdoMap
from canopen.sdo.exceptions import SdoAbortedError

NODE_ID = 0x01
OPERATIONAL = 5
SYNCHRONOUS = range(1, 241)
ASYNCHRONOUS = (254, 255)
COMMUNICATION, MAPPING = range(0x1800, 0x1A00), range(0x1A00, 0x1C00)
FILTER_TIME, TEMPERATURE, HUMIDITY = 0x2000, 0x6000, 0x6001
WORDS = [[TEMPERATURE << 16 | 16, 0, 0, 0], [TEMPERATURE << 16 | 16, HUMIDITY << 16 | 8, 0, 0]]


def build_dictionary() -> ObjectDictionary:
    """Return what a small thermometer has."""
    dictionary = ObjectDictionary()  # type: ignore[no-untyped-call]  # canopen is partly untyped
    info = dictionary.device_information
    info.vendor_name, info.product_name = "Nobody", "thermometer"
    info.allowed_baudrates = {125_000}
    dictionary.node_id, dictionary.bitrate = NODE_ID, 125_000
    u8, u16, u32 = datatypes.UNSIGNED8, datatypes.UNSIGNED16, datatypes.UNSIGNED32
    text = datatypes.VISIBLE_STRING
    variables = (
        ("Device type", 0x1000, u32, "ro", 0x0002_0191),
        ("Error register", 0x1001, u8, "ro", 0),
        ("COB-ID SYNC", 0x1005, u32, "rw", 0x80),
        ("Device name", 0x1008, text, "const", "thermometer"),
        ("Hardware version", 0x1009, text, "const", "A"),
        ("Software version", 0x100A, text, "const", "1.00"),
        ("Producer heartbeat time", 0x1017, u16, "rw", 0),
        ("Filter time", FILTER_TIME, u16, "rw", 100),
        ("Place", 0x2002, text, "rw", "hall 3, rack 12"),
        ("Tag", 0x2003, datatypes.UNSIGNED64, "rw", 0),
        ("Blink", 0x2004, u8, "wo", 0),
        ("Temperature", TEMPERATURE, datatypes.INTEGER16, "ro", 215),
        ("Humidity", HUMIDITY, u8, "ro", 45),
    )
    for name, index, kind, access, value in variables:
        variable = _variable(name, index, 0, kind, access, value)
        variable.pdo_mappable = index in (TEMPERATURE, HUMIDITY)
        if index == FILTER_TIME:
            variable.min, variable.max = 10, 2000
        dictionary.add_object(variable)
    identity = (4, 0x0000_0001, 0x0000_0002, 0x0001_0000, 0x0000_2A17)
    _add_record(dictionary, "Identity", 0x1018, [(u32, "ro", value) for value in identity])
    ids = [(u32, "ro", cob_id + NODE_ID) for cob_id in (0x600, 0x580)]
    _add_record(dictionary, "SDO server parameter", 0x1200, [(u8, "ro", 2), *ids])
    limits = [(datatypes.INTEGER16, "rw", -400), (datatypes.INTEGER16, "rw", 850)]
    hysteresis = (datatypes.REAL32, "rw", 0.5)
    _add_record(dictionary, "Limits", 0x2001, [(u8, "ro", 3), *limits, hysteresis])
    for place, words in enumerate(WORDS):
        parameter = ((u8, "ro", 5), (u32, "rw", 0x180 + 0x100 * place + NODE_ID), (u8, "rw", 254))
        times = ((u16, "rw", 0), (u8, "rw", 0), (u16, "rw", 0))
        _add_record(dictionary, f"TPDO {place + 1}", 0x1800 + place, [*parameter, *times])
        count = (u8, "rw", sum(map(bool, words)))
        mapped = [(u32, "rw", word) for word in words]
        _add_record(dictionary, f"TPDO {place + 1} mapping", 0x1A00 + place, [count, *mapped])
    return dictionary


def _add_record(
    dictionary: ObjectDictionary, name: str, index: int, members: list[tuple[int, str, float]]
) -> None:
    record = ODRecord(name, index)
    for sub, (kind, access, value) in enumerate(members):
        number = datatypes.UNSIGNED8 if sub == 0 else kind
        record.add_member(_variable(f"{name} {sub}", index, sub, number, access, value))
    dictionary.add_object(record)


def _variable(
    name: str, index: int, sub: int, kind: int, access: str, value: float | str
) -> ODVariable:
    variable = ODVariable(name, index, sub)
    variable.data_type, variable.access_type = kind, access
    variable.default = value  # type: ignore[assignment]  # declared int, strings are taken
    return variable


class LocalDevice(canopen.LocalNode):
    """A LocalNode with the application that makes it send TPDOs."""

    def __init__(self) -> None:
        super().__init__(NODE_ID, build_dictionary())
        self._syncs: dict[int, int] = {}

    def start(self, network: canopen.Network) -> None:
        """Boot on an open network."""
        network.add_node(self)
        # Subscribed after LocalNode's own, so called after it.
        network.subscribe(0x000, self._on_nmt)
        sync = int.from_bytes(self.get_data(0x1005, 0), "little") & 0x7FF
        network.subscribe(sync, self._on_sync)
        self.nmt.state = "INITIALISING"
        self.nmt.state = "PRE-OPERATIONAL"

    def set_data(
        self, index: int, subindex: int, data: bytes, check_writable: bool = False
    ) -> None:
        """Store what was written, as LocalNode does, then configure the TPDO it belongs to."""
        super().set_data(index, subindex, data, check_writable)
        if index in COMMUNICATION or index in MAPPING:
            self._configure(index % 0x200 + 1)

    def _on_nmt(self, _can_id: int, _data: bytearray, _time_s: float) -> None:
        for number in self.tpdo:
            self._configure(number)

    def _configure(self, number: int) -> None:
        pdo = self.tpdo[number]
        pdo.stop()
        self._syncs[number] = 0
        if self.nmt._state != OPERATIONAL or not self._fill(pdo):
            return
        if pdo.trans_type in ASYNCHRONOUS and pdo.event_timer:
            pdo.start(pdo.event_timer / 1000)

    def _fill(self, pdo: PdoMap) -> bool:
        """Take the TPDO's parameters from the dictionary; tell whether it is to be sent."""
        try:
            pdo.read()
        except (KeyError, SdoAbortedError):
            return False
        for variable in pdo.map:
            variable.set_data(self.get_data(variable.index, variable.subindex))
        return pdo.enabled and 0 < pdo.length <= 64

    def _on_sync(self, _can_id: int, _data: bytearray, _time_s: float) -> None:
        for number, pdo in self.tpdo.items():
            if self.nmt._state != OPERATIONAL or not pdo.enabled:
                continue
            if pdo.trans_type in SYNCHRONOUS:
                self._syncs[number] += 1
                if self._syncs[number] % pdo.trans_type == 0:
                    pdo.transmit()


def boot(bus: can.BusABC, _station: object) -> LocalDevice:
    """Start the device on a bus."""
    network = canopen.Network(bus)
    network.connect()
    node = LocalDevice()
    node.start(network)
    return node


def eds_of(node: LocalDevice) -> str:
    """Return the EDS that python-canopen makes of the dictionary."""
    text = io.StringIO()
    objectdictionary.export_od(node.object_dictionary, text, "eds")
    return text.getvalue()


def contents(node: LocalDevice) -> dict[str, bytes]:
    """Return what every entry holds, by its address."""
    held = {}
    for item in node.object_dictionary.values():
        for variable in [item] if isinstance(item, ODVariable) else item.values():
            address = f"{variable.index:04X}h:{variable.subindex:02X}"
            held[address] = node.get_data(variable.index, variable.subindex)
    return held
