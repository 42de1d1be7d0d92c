"""What the EMCY port makes of a spec, and that it leaves the node as it was."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.sensor.settling import Settling
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.emcy import EmcyPort, depths
from conformance.bench.services.provocations import provocations
from conformance.bench.session import Bench
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec


def spec_of(device: str, variant: str) -> DeviceSpec:
    return load_spec(resources.find("device_specs", device, "DEVICE")).resolve(variant)


@pytest.fixture
def bench() -> Iterator[Bench]:
    path: Path = resources.find("device_specs", "siko_ims360", "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    spec = load_spec(path).resolve("two-axis")
    options = {"channel": str(path), "variant": "two-axis"}
    opened = Bench.open(definition, spec, options, None)
    yield opened
    opened.close()


def test_errors_above_the_limits_come_first() -> None:
    spec = spec_of("danfoss_dst_x730", "xy-10")

    found = provocations(spec, spec.services.emcy_producer)

    angles = [(error.axis, error.beyond_deg(0.0), error.within_deg) for error in found]
    assert angles == [
        ("tilt-x", 12.0, 10.0),
        ("tilt-y", 12.0, 10.0),
        ("tilt-x", -12.0, -10.0),
        ("tilt-y", -12.0, -10.0),
    ]


@pytest.mark.parametrize(
    ("device", "variant"),
    [("danfoss_dst_x730", "z-360"), ("siko_ims360", "one-axis"), ("baumer_gim140r", "redundant")],
)
def test_a_sensor_without_limits_has_no_errors_to_provoke(device: str, variant: str) -> None:
    spec = spec_of(device, variant)

    assert provocations(spec, spec.services.emcy_producer) == []


def test_the_depth_of_a_history_is_that_of_its_readings() -> None:
    assert depths(spec_of("siko_ims360", "two-axis"), 0x1003) == {8, 10, 16}
    assert depths(spec_of("baumer_gim140r", "redundant"), 0x1003) == {8}


def test_the_node_is_left_as_it_was(bench: Bench) -> None:
    bench.find_node()
    node = bench.node()
    spec = bench.spec
    port = EmcyPort(node, spec.services.emcy_producer, Stimulus(bench.link, Settling(node)))
    before = node.number(0x1014), node.number(0x6110), node.number(0x1003)
    error = provocations(spec, spec.services.emcy_producer)[0]

    port.calm()
    port.move(0x680)
    assert [seen.frame.can_id for seen in port.provoke(error)] == [0x680]
    assert port.past(8) == [0x5010]
    port.leave()
    bench.done(node, doubtful=False)

    assert (node.number(0x1014), node.number(0x6110), node.number(0x1003)) == before
