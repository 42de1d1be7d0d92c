"""python-canopen as master: TPDOs and their mapping, on every simulated device by the EDS of its spec."""

from __future__ import annotations

from itertools import pairwise

import pytest
from canopen.pdo import PdoMap
from canopen.sdo.exceptions import SdoAbortedError
from master import Master


def first(master: Master) -> PdoMap:
    """Return the first TPDO, as the device holds it."""
    pdo: PdoMap = master.node.tpdo[1]
    pdo.read()
    return pdo


def save(master: Master, pdo: PdoMap) -> None:
    """Save a TPDO; python-canopen's own way ends where the COB-ID cannot be written."""
    if master.spec.entries[0x1800, 1].writable:
        pdo.save()
        return
    with pytest.raises(SdoAbortedError, match="0x06010002"):
        pdo.save()
    for sub, value in ((2, pdo.trans_type), (5, pdo.event_timer)):
        if value is not None:
            pdo.com_record[sub].raw = value


def test_the_mapping_is_read_as_documented(master: Master) -> None:
    spec = master.spec
    assert spec.services.tpdo is not None

    for number in range(1, spec.services.tpdo.count + 1):
        pdo = master.node.tpdo[number]
        pdo.read()
        mapping = spec.services.tpdo.mapping + number - 1
        words = [it.index << 16 | it.subindex << 8 | it.length for it in pdo.map if it.index]
        count = spec.entries[mapping, 0].default
        documented = [spec.entries[mapping, n + 1].default for n in range(int(count or 0))]
        assert words == [word for word in documented if word], f"{mapping:04X}h"
        parameter = spec.entries[spec.services.tpdo.communication + number - 1, 1]
        assert isinstance(parameter.default, int)
        assert pdo.cob_id == parameter.default & 0x7FF
        assert pdo.enabled == (parameter.default >> 31 == 0)


def test_a_tpdo_carries_what_was_mapped(master: Master) -> None:
    pdo = first(master)
    mapped = [
        entry
        for entry in master.entries
        if entry.mappable and entry.readable and entry.type.is_integer
    ]
    count = master.spec.entries[0x1A00, 0]
    if count.writable:
        pdo.clear()
        for entry in reversed(mapped[-2:]):
            pdo.add_variable(entry.index, entry.sub)
    pdo.enabled, pdo.trans_type, pdo.event_timer = True, 254, 100
    save(master, pdo)
    words = [(it.index, it.subindex, it.length) for it in pdo.map]
    pdo.read()
    assert [(it.index, it.subindex, it.length) for it in pdo.map] == words
    assert (pdo.trans_type, pdo.event_timer) == (254, 100)

    master.node.nmt.state = "OPERATIONAL"
    assert pdo.wait_for_reception(1) is not None
    begun = pdo.timestamp
    assert pdo.wait_for_reception(1) == pytest.approx((begun or 0) + 0.1, abs=0.002)

    for it in pdo.map:
        assert it.raw == master.read(master.spec.entries[it.index, it.subindex])


def test_a_tpdo_follows_the_sync_of_the_master(master: Master) -> None:
    pdo = first(master)
    pdo.enabled, pdo.trans_type, pdo.event_timer = True, 2, None
    save(master, pdo)
    times: list[float] = []
    pdo.add_callback(lambda _: times.append(master.now_s))
    master.node.nmt.state = "OPERATIONAL"
    master.sleep(0.2)
    times.clear()

    master.network.sync.start(0.05)
    master.sleep(0.99)
    master.network.sync.stop()
    master.sleep(0.2)

    assert len(times) == 10  # every second of 20
    gaps = [b - a for a, b in pairwise(times)]
    assert gaps == pytest.approx([0.1] * 9, abs=0.002)


def test_a_tpdo_is_asked_for_where_documented(master: Master) -> None:
    tpdo = master.spec.services.tpdo
    assert tpdo is not None
    if not any(low <= 253 <= high for low, high in tpdo.transmission_types):
        pytest.skip("no TPDO on request in the manual")
    pdo = first(master)
    pdo.trans_type, pdo.event_timer, pdo.rtr_allowed, pdo.enabled = 253, None, True, True
    pdo.save()
    master.node.nmt.state = "OPERATIONAL"
    master.sleep(0.2)

    assert pdo.wait_for_reception(0.5) is None
    pdo.remote_request()
    assert pdo.wait_for_reception(0.5) is not None


def test_the_configuration_of_the_eds_is_loaded(master: Master) -> None:
    if not master.spec.entries[0x1800, 1].writable:
        pytest.skip("the COB-ID cannot be written")
    service = master.spec.services.tpdo
    assert service is not None
    number = next(
        n
        for n in range(1, service.count + 1)
        if all(it.default is not None for it in master.spec.subs(service.mapping + n - 1))
    )
    pdo = master.node.tpdo[number]
    pdo.read()
    before = (pdo.cob_id, pdo.trans_type, pdo.event_timer, [it.name for it in pdo.map])
    pdo.trans_type, pdo.event_timer = 1, 0
    pdo.save()

    pdo.read(from_od=True)
    pdo.save()
    pdo.read()

    assert before == (pdo.cob_id, pdo.trans_type, pdo.event_timer, [it.name for it in pdo.map])


def test_a_disabled_tpdo_is_silent(master: Master) -> None:
    if not master.spec.entries[0x1800, 1].writable:
        pytest.skip("the COB-ID cannot be written")
    pdo = first(master)
    pdo.trans_type, pdo.event_timer, pdo.enabled = 254, 100, False
    pdo.save()
    master.node.nmt.state = "OPERATIONAL"

    assert pdo.wait_for_reception(0.5) is None
