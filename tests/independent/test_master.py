"""python-canopen as master: SDO, NMT, EMCY, store, on every simulated device by the EDS of its spec.

What it does is python-canopen's; what must come of it is in the spec. python-canopen's own `nmt.state`
is what it last sent or heard, so states are asked of the heartbeat.
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from pathlib import Path

import canopen
import pytest
from canopen.sdo.exceptions import SdoAbortedError
from master import BOOT_UP_S, Master, master_of

from conformance.simulator.device import SimulatedDevice
from conformance.spec.fields import key_of
from conformance.spec.model import Entry
from conformance.wire.datatypes import DataType, Value

WITH_BLOCKS = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"
HEARTBEAT_MS = 50
NO_BLOCKS = 0x0504_0001


def state(master: Master) -> str:
    """Return the NMT state that the next heartbeat tells."""
    name: str = master.node.nmt.wait_for_heartbeat(1)
    return name


def start_heartbeat(master: Master) -> None:
    master.node.sdo[0x1017].raw = HEARTBEAT_MS


# SDO


def test_every_entry_is_read_with_its_default(master: Master) -> None:
    read: dict[str, Value] = {
        entry.address: master.read(entry) for entry in master.entries if entry.readable
    }

    assert read == {
        entry.address: read[entry.address]
        if entry.default_value is None or entry.kind in ("live", "counter")
        else entry.default_value
        for entry in master.entries
        if entry.readable
    }


def test_a_setting_takes_its_default_and_keeps_it(master: Master) -> None:
    settings = master.settings

    assert settings
    for entry in settings:
        master.variable(entry).raw = entry.default_value
        assert master.read(entry) == entry.default_value, entry.address


def test_what_is_read_only_is_not_written(master: Master) -> None:
    for entry in master.entries:
        if entry.access in ("ro", "const") and entry.type.is_integer:
            with pytest.raises(SdoAbortedError) as refused:
                master.node.sdo.download(entry.index, entry.sub, entry.type.encode(0))
            assert refused.value.code in (0x0601_0002, 0x0800_0000), entry.address


def test_a_text_is_read_in_segments_as_at_once(master: Master) -> None:
    texts = [entry for entry in master.entries if entry.type is DataType.VISIBLE_STRING]

    for entry in texts:
        whole = master.node.sdo.upload(entry.index, entry.sub)
        with master.node.sdo.open(entry.index, entry.sub, "rb", buffering=3) as stream:
            assert stream.read() == whole
        assert master.read(entry) == whole.decode("ascii")


def test_a_download_in_segments_arrives(master: Master) -> None:
    server = master.spec.services.sdo_server
    entry = next(entry for entry in master.settings if entry.type.is_integer)
    octets = entry.type.encode(int(entry.default or 0))

    if server is not None and not server.segmented_download:
        with pytest.raises(SdoAbortedError):
            master.node.sdo.download(entry.index, entry.sub, octets, force_segment=True)
        return
    master.node.sdo.download(entry.index, entry.sub, octets, force_segment=True)

    assert master.read(entry) == entry.default_value


def test_blocks_are_refused(master: Master) -> None:
    with pytest.raises(SdoAbortedError) as refused:
        in_blocks(master, 0x1008)
    assert refused.value.code == NO_BLOCKS

    assert master.node.sdo.upload(0x1008, 0)


def test_blocks_are_carried_out_where_there_are_some() -> None:
    with master_of(WITH_BLOCKS) as master:
        master.boot()
        entry = next(
            it for it in master.entries if it.type is DataType.UNICODE_STRING and it.writable
        )
        text = "bei der Pumpe im Süden".encode("utf-16-le")[
            : entry.octets[1] if entry.octets else 0
        ]

        assert in_blocks(master, 0x1008) == master.node.sdo.upload(0x1008, 0)
        with master.node.sdo.open(
            entry.index, entry.sub, "wb", size=len(text), block_transfer=True
        ) as stream:
            stream.write(text)
        assert in_blocks(master, entry.index, entry.sub) == text


def in_blocks(master: Master, index: int, sub: int = 0) -> bytes:
    with master.node.sdo.open(index, sub, "rb", block_transfer=True) as stream:
        read: bytes = stream.read()
    return read


# NMT


def test_states_are_entered_and_told(master: Master) -> None:
    start_heartbeat(master)
    heard: list[int] = []
    master.node.nmt.add_heartbeat_callback(heard.append)

    for name in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL", "OPERATIONAL"):
        master.node.nmt.state = name
        assert state(master) == name
    master.network.nmt.state = "STOPPED"  # to every node
    assert state(master) == "STOPPED"

    assert heard == [5, 4, 127, 5, 4]


@pytest.mark.parametrize("command", ["RESET", "RESET COMMUNICATION"])
def test_a_reset_leads_to_a_boot_up(master: Master, command: str) -> None:
    start_heartbeat(master)
    master.node.nmt.state = "OPERATIONAL"

    master.node.nmt.state = command
    master.node.nmt.wait_for_bootup(BOOT_UP_S)

    assert master.node.sdo[0x1017].raw == 0
    start_heartbeat(master)
    assert state(master) == "PRE-OPERATIONAL"


def test_what_the_master_sends_beside_is_not_answered(master: Master) -> None:
    start_heartbeat(master)
    heard: list[int] = []

    master.node.nmt.state = "SLEEP"  # a command that CiA 301 reserves
    assert state(master) == "PRE-OPERATIONAL"
    master.node.sdo[0x1017].raw = 0
    master.sleep(0.1)
    master.node.nmt.add_heartbeat_callback(heard.append)
    master.node.nmt.start_node_guarding(0.1)
    master.network.time.transmit()
    master.sleep(0.5)
    master.node.nmt.stop_node_guarding()

    assert heard == []


def test_heartbeats_keep_their_period(master: Master) -> None:
    times: list[float] = []
    start_heartbeat(master)
    for _ in range(5):
        state(master)
        times.append(master.node.nmt.timestamp or 0.0)

    gaps_ms = [(b - a) * 1000 for a, b in pairwise(times)]
    assert gaps_ms == pytest.approx([HEARTBEAT_MS] * 4, abs=1)


# EMCY


def test_an_error_comes_and_goes(master: Master) -> None:
    emcy = master.spec.services.emcy_producer
    if emcy is None:
        pytest.skip("no EMCY in the manual")
    for code in (code for code in emcy.codes if code):
        master.stimulate(partial(SimulatedDevice.raise_error, code=code))
        error = master.node.emcy.wait(code, 1)

        assert error is not None
        assert error.register == master.node.sdo[0x1001].raw
        assert [it.code for it in master.node.emcy.active] == [code]
        if emcy.history is not None:
            assert master.node.sdo[emcy.history][1].raw & 0xFFFF == code

        master.stimulate(partial(SimulatedDevice.clear_error, code=code))
        gone = master.node.emcy.wait(0, 1)

        assert gone is not None
        assert gone.register == master.node.sdo[0x1001].raw == 0
        assert master.node.emcy.active == []


# Store and restore


def storable(master: Master) -> Entry:
    """Return a setting that a store keeps, and that takes effect at once."""
    store = master.spec.services.store
    assert store is not None
    return next(
        entry
        for entry in master.settings
        if entry.type.is_integer
        and store.covers(1, entry.index)
        and entry.persistent is not False
        and entry.effective == "at-once"
        and len(other_values(entry)) > 0
        and not reaches(master, entry)
    )


def other_values(entry: Entry) -> list[int]:
    edges = sorted({edge for low_high in entry.legal or () for edge in low_high})
    return [value for value in edges if value != entry.default]


def reaches(master: Master, entry: Entry) -> bool:
    """Tell whether an entry holds node-ID or bit rate, or starts the node."""
    services = master.spec.services
    held = {it.object for it in (services.node_id, services.bitrate) if it is not None}
    by = services.nmt.start_by
    return entry.index in held or (by is not None and key_of(by.object)[0] == entry.index)


def test_settings_are_stored_and_restored(master: Master) -> None:
    services = master.spec.services
    if services.store is None or services.restore is None:
        pytest.skip("the manual documents no store")
    entry = storable(master)
    master.variable(entry).raw = other_values(entry)[0]

    master.boot()
    assert master.read(entry) == entry.default

    master.variable(entry).raw = other_values(entry)[0]
    master.node.store()
    master.sleep(services.store.settle_ms / 1000)
    master.boot()
    assert master.read(entry) == other_values(entry)[0]

    master.node.restore()
    master.sleep(services.restore.settle_ms / 1000)
    master.boot()
    assert master.read(entry) == entry.default


# The network


def test_the_scanner_finds_the_device_alone(master: Master) -> None:
    master.network.scanner.reset()
    master.network.scanner.search()
    master.sleep(0.5)

    assert master.network.scanner.nodes == [master.spec.node_id]


def test_a_node_that_is_off_is_missed(master: Master) -> None:
    master.bus.power_off(master.device)

    with pytest.raises(canopen.SdoCommunicationError):
        master.node.sdo.upload(0x1000, 0)
    with pytest.raises(canopen.nmt.NmtError):
        master.node.nmt.wait_for_heartbeat(1)
