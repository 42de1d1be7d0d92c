"""A TPDO is set up step by step, and what was written is undone."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.services.tpdo import TpdoPort
from conformance.bench.session import Bench
from conformance.spec.load import load_spec

COB_ID, INHIBIT = (0x1800, 1), (0x1800, 3)


def open_bench(device: str) -> Bench:
    path = resources.find("device_specs", device, "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    bench = Bench.open(definition, load_spec(path).resolve(), {"channel": str(path)}, None)
    bench.find_node()
    return bench


@pytest.fixture
def free() -> Iterator[Bench]:
    """A bench with a device whose TPDOs can be set up in every way."""
    bench = open_bench("siko_ims360")
    yield bench
    bench.close()


@pytest.fixture
def fixed() -> Iterator[Bench]:
    """A bench with a device whose COB-ID and mapping are fixed."""
    bench = open_bench("danfoss_dst_x730")
    yield bench
    bench.close()


def port_of(bench: Bench) -> TpdoPort:
    tpdo = bench.spec.services.tpdo
    assert tpdo is not None
    return TpdoPort(bench.node(), tpdo, 1)


def test_bit_30_of_a_free_cob_id_is_written_and_put_back(free: Bench) -> None:
    tpdo = free.spec.services.tpdo
    assert tpdo is not None
    node = free.node()
    port = TpdoPort(node, tpdo, 1)
    before = node.number(*COB_ID)

    port.allow_remote(1)

    assert port.bits_30 == (0, 1)
    assert node.number(*COB_ID) == before | 1 << 30
    node.restore()
    assert node.number(*COB_ID) == before


def test_bit_30_of_a_fixed_cob_id_is_what_it_is(fixed: Bench) -> None:
    assert port_of(fixed).bits_30 == (0,)


def test_an_inhibit_time_is_written_while_the_tpdo_is_disabled(free: Bench) -> None:
    tpdo = free.spec.services.tpdo
    assert tpdo is not None
    node = free.node()
    port = TpdoPort(node, tpdo, 1)

    port.set_inhibit_time(250)

    assert node.number(*INHIBIT) == 250
    assert not node.number(*COB_ID) >> 31
    node.restore()
    assert node.number(*INHIBIT) == 0


def test_a_request_is_as_long_as_the_tpdo(fixed: Bench) -> None:
    port = port_of(fixed)
    assert port.mapped_octets == 4

    frame = port.request(port.mapped_octets).frame

    assert (frame.can_id, frame.remote, frame.dlc) == (0x1FF, True, 4)
