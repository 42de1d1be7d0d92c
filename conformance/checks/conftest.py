"""What a check is handed: the bench, the node under test and the verdict to fill."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from conformance.bench.node.node import Node
from conformance.bench.sensor.settling import Settling
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.emcy import EmcyPort
from conformance.bench.services.heartbeat import HeartbeatPort
from conformance.bench.services.lights import LightsPort
from conformance.bench.services.lss import LssPort
from conformance.bench.session import Bench
from conformance.bench.settings.in_force import InForce
from conformance.checks import BENCH, PASSED, VERDICT
from conformance.effects import IN_FORCE
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict


@pytest.fixture
def bench(pytestconfig: pytest.Config) -> Bench:
    """The open bench."""
    bench = pytestconfig.stash.get(BENCH, None)
    if bench is None:
        pytest.exit("expected --device NAME (see canopen-conformance devices)", returncode=4)
    return bench


@pytest.fixture
def spec(bench: Bench) -> DeviceSpec:
    """What the device is held against."""
    return bench.spec


@pytest.fixture
def node(bench: Bench, request: pytest.FixtureRequest) -> Iterator[Node]:
    """The node under test, in Pre-operational; what the check does to it is undone."""
    node = bench.node()
    yield node
    bench.done(node, doubtful=not request.node.stash.get(PASSED, False))


@pytest.fixture
def heartbeat(node: Node, spec: DeviceSpec) -> HeartbeatPort:
    """The node's heartbeat producer."""
    return HeartbeatPort(node, spec.services.heartbeat_producer)


@pytest.fixture
def stimulus(bench: Bench, node: Node) -> Iterator[Stimulus]:
    """What can be changed around the node; it is brought back afterwards."""
    stimulus = Stimulus(bench.link, Settling(node), bench.tilting, bench.exposings)
    yield stimulus
    stimulus.rest()


@pytest.fixture
def in_force(bench: Bench, node: Node) -> Iterator[InForce]:
    """What puts values in force that wait for a store; what the node had stored is put back afterwards."""
    port = InForce(
        node,
        allowed=bench.definition.allows(IN_FORCE) and not bench.worn,
        by_supply=bench.definition.switches_supply,
    )
    yield port
    port.leave()


@pytest.fixture
def emcy(node: Node, spec: DeviceSpec, stimulus: Stimulus) -> Iterator[EmcyPort]:
    """The node's EMCY producer; what was provoked is brought back afterwards."""
    port = EmcyPort(node, spec.services.emcy_producer, stimulus)
    yield port
    port.leave()


@pytest.fixture
def lss(bench: Bench, node: Node, spec: DeviceSpec) -> Iterator[LssPort]:
    """The node's LSS slave; the node is brought back to its place afterwards."""
    port = LssPort(node, bench.reach, spec.services.lss)
    yield port
    port.leave()


@pytest.fixture
def lights(bench: Bench, spec: DeviceSpec) -> LightsPort:
    """The node's lights, looked at by the bench's operator."""
    return LightsPort(spec, bench.operator)


@pytest.fixture
def verdict(request: pytest.FixtureRequest, bench: Bench) -> Verdict:
    """What the check measures goes here; the plug-in concludes it."""
    stash: pytest.Stash = request.node.stash
    return stash.setdefault(VERDICT, Verdict(bench.link.uncertainty_ms))
