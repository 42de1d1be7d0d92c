"""python-canopen as LSS master, on every simulated device whose manual documents LSS."""

from __future__ import annotations

from typing import Any

import pytest
from canopen.lss import LssError
from master import DEVICES, Master, name_of

from conformance.spec.bit_rates import documented_rates
from conformance.spec.load import load_spec
from conformance.wire.lss import BIT_RATES

WITH_LSS = [
    (path, variant)
    for path, variant in DEVICES
    if load_spec(path).resolve(variant).services.lss is not None
]
pytestmark = pytest.mark.parametrize("master", WITH_LSS, indirect=True, ids=name_of)
NEW_NODE_ID = 0x5A
IDENTITY = tuple(range(0x5A, 0x5E))
"""Commands of LSS that ask for vendor-ID, product code, revision number and serial number."""


@pytest.fixture
def lss(master: Master) -> Any:
    """python-canopen's LSS master, partly untyped, of a node in a state in which it hears it."""
    service = master.spec.services.lss
    assert service is not None
    if "pre-operational" not in service.states:
        master.node.nmt.state = service.states[0].upper()
    return master.network.lss


def identity(master: Master) -> list[int]:
    numbers = [master.spec.entries[0x1018, sub].default for sub in (1, 2, 3)]
    return [int(number or 0) for number in numbers] + [master.device.memory.serial_number]


def test_lss_selects_the_device_by_its_identity(master: Master, lss: Any) -> None:
    wrong = [*identity(master)[:3], identity(master)[3] + 1]
    with pytest.raises(LssError):
        lss.send_switch_state_selective(*wrong)

    assert lss.send_switch_state_selective(*identity(master))

    assert [lss.inquire_lss_address(command) for command in IDENTITY] == identity(master)
    assert lss.inquire_node_id() == master.spec.node_id
    lss.send_switch_state_global(lss.WAITING_STATE)
    with pytest.raises(LssError):
        lss.inquire_node_id()


def test_lss_gives_and_stores_a_node_id(master: Master, lss: Any) -> None:
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    with pytest.raises(LssError, match="1"):
        lss.configure_node_id(200)
    lss.configure_node_id(NEW_NODE_ID)
    lss.store_configuration()
    lss.send_switch_state_global(lss.WAITING_STATE)

    master.speak_with(NEW_NODE_ID)
    master.boot()

    assert master.node.sdo[0x1000].raw == master.spec.entries[0x1000, 0].default
    assert master.spec.node_id == NEW_NODE_ID


def test_lss_gives_a_bit_rate(master: Master, lss: Any) -> None:
    index = {rate: index for index, rate in BIT_RATES.items()}
    rates = [rate for rate in documented_rates(master.spec) if rate in index]
    rate = next(rate for rate in rates if rate != master.device.bitrate)
    lss.send_switch_state_global(lss.CONFIGURATION_STATE)
    with pytest.raises(LssError, match="1"):
        lss.configure_bit_timing(42)
    lss.configure_bit_timing(index[rate])

    lss.activate_bit_timing(100)
    master.sleep(0.1)
    master.station.bitrate = rate
    master.sleep(0.1)

    assert lss.inquire_node_id() == master.spec.node_id
    lss.send_switch_state_global(lss.WAITING_STATE)
    assert master.device.bitrate == rate


def test_lss_identifies_the_device_where_documented(master: Master, lss: Any) -> None:
    service = master.spec.services.lss
    heard: list[bytes] = []
    master.network.subscribe(0x7E4, lambda _id, data, _time: heard.append(bytes(data)))
    vendor, product, revision, serial = identity(master)

    lss.send_identify_remote_slave(vendor, product, 0, revision, serial, 0xFFFF_FFFF)
    master.sleep(0.1)
    known = list(heard)
    lss.send_identify_remote_slave(vendor, product, 0, revision, serial + 1, 0xFFFF_FFFF)
    master.sleep(0.1)

    documented = service is not None and "identify-remote-slave" in service.waiting
    assert known == ([bytes([0x4F, *bytes(7)])] if documented else [])
    assert heard == known


def test_a_fast_scan_finds_no_configured_device(lss: Any) -> None:
    assert lss.fast_scan() == (False, None)
