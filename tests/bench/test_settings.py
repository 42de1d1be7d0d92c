"""Store and restore are tried on all settings at once; a node keeps what it had stored before."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from conformance import resources
from conformance.bench.bus.observations import Observations
from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.bench.settings.second_values import second_values
from conformance.bench.settings.settings import Settings, _disabled
from conformance.bench.settings.trials import (
    observe_defaults,
    observe_kept,
    observe_restored,
    observe_wrong_signatures,
)
from conformance.errors import SetupRefused
from conformance.simulator.interface import SimulatorBus
from conformance.spec.document import Store
from conformance.spec.load import load_spec

DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")
EVENT_TIMER = (0x1800, 5)
OWN = (250).to_bytes(2, "little")


def open_bench(device: str, **options: Any) -> Bench:
    path = resources.find("device_specs", device, "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    return Bench.open(
        definition, load_spec(path).resolve(), {"channel": str(path), **options}, None
    )


@pytest.fixture(params=DEVICES)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    """A bench whose node has an event timer stored that is not the default."""
    bench = open_bench(request.param)
    node = bench.node()
    settings = Settings(node)
    settings.begin()
    settings.write({EVENT_TIMER: OWN})
    settings.save()
    node.reset()
    assert node.upload(*EVENT_TIMER) == OWN
    yield bench
    bench.close()


def memory(bench: Bench) -> dict[Any, Any]:
    rig = bench.link.rig
    assert isinstance(rig, SimulatorBus)
    with rig.present() as bus:
        return dict(bus.nodes[0].memory.values)


def restore_of(node: Node) -> Store:
    assert node.spec.services.restore is not None
    return node.spec.services.restore


def store_of(node: Node) -> Store:
    assert node.spec.services.store is not None
    return node.spec.services.store


TRIALS: dict[str, Callable[[Node], object]] = {
    "stored, reset": lambda node: observe_kept(node, save=True, power=False),
    "stored, power cycle": lambda node: observe_kept(node, save=True, power=True),
    "not stored": lambda node: observe_kept(node, save=False, power=True),
    "wrong store": lambda node: observe_wrong_signatures(node, store_of(node), (1,), save=False),
    "wrong restore": lambda node: observe_wrong_signatures(node, restore_of(node), (1,), save=True),
    "restored": lambda node: observe_restored(node, restore_of(node), 1, power=False),
    "restored by power": lambda node: observe_restored(node, restore_of(node), 1, power=True),
    "defaults": lambda node: observe_defaults(node, restore_of(node), 1),
}


@pytest.mark.parametrize("trial", TRIALS)
def test_a_trial_leaves_what_was_stored(bench: Bench, trial: str) -> None:
    before = memory(bench)
    node = bench.node()

    TRIALS[trial](node)
    bench.done(node, doubtful=False)

    assert memory(bench) == before
    assert node.upload(*EVENT_TIMER) == OWN
    node.power_cycle()
    assert node.upload(*EVENT_TIMER) == OWN


def test_what_was_not_stored_costs_no_store(bench: Bench) -> None:
    node = bench.node()

    observe_kept(node, save=False, power=False)

    assert node.non_volatile_writes == 0


def test_a_failure_half_way_leaves_what_was_stored(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = memory(bench)
    node = bench.node()

    def fail(_settings: Settings) -> None:
        raise SetupRefused("half-way")

    with monkeypatch.context() as patched, pytest.raises(SetupRefused, match="half-way"):
        patched.setattr(Node, "power_cycle", fail)
        observe_kept(node, save=True, power=True)

    assert memory(bench) == before


def test_most_settings_take_their_second_value(bench: Bench) -> None:
    node = bench.node()
    settings = Settings(node)
    settings.begin()

    wanted = second_values(node.spec, settings.found, default_will_do=False)
    settings.write(wanted)
    held = settings.read()
    settings.put_back()

    assert len(wanted) >= 7
    assert {key for key, data in wanted.items() if held[key] != data} == set()
    assert all(settings.found[key] != data for key, data in wanted.items())


def test_a_node_with_an_offset_that_nothing_gives_back_is_left_alone() -> None:
    bench = open_bench("danfoss_dst_x730")
    bench.find_node()
    node = bench.node()
    node.download(0x6012, 0, 5)
    node.save({0x6012})
    before = node.number(0x6013)

    with pytest.raises(SetupRefused, match="6013h holds an offset"):
        observe_kept(node, save=True, power=False)

    assert node.number(0x6013) == before != 0
    bench.close()


def test_a_node_that_does_not_take_its_settings_back_is_told_of() -> None:
    bench = open_bench("siko_ims360", faults=["store-skips-defaults"])
    node = bench.node()
    settings = Settings(node)
    settings.begin()
    settings.write({EVENT_TIMER: OWN})
    settings.save()

    with pytest.raises(SetupRefused, match="does not take back what it had stored: 1800h:05"):
        settings.put_back()

    bench.close()


def test_an_observation_is_made_once(bench: Bench) -> None:
    observations = Observations(bench.link)
    node = bench.node()
    made: list[int] = []

    def observe() -> int:
        made.append(1)
        return node.number(*EVENT_TIMER)

    first = observations.once("timer", int, observe)
    second = observations.once("timer", int, observe)

    assert first == second
    assert first.outcome == 250
    assert first.last - first.first == 1
    assert made == [1]


def test_an_observation_that_failed_fails_every_item_alike(bench: Bench) -> None:
    observations = Observations(bench.link)

    def refuse() -> int:
        raise SetupRefused("no")

    for _ in range(2):
        with pytest.raises(SetupRefused, match="no"):
            observations.once("refused", int, refuse)
    with pytest.raises(TypeError):
        observations.once("number", int, lambda: 1)
        observations.once("number", str, lambda: "")


@pytest.mark.parametrize("data", [b"", b"\x80\x01", bytes(5), bytes(10_000)])
def test_a_cob_id_of_another_length_is_no_defect_of_the_suite(data: bytes) -> None:
    with pytest.raises(SetupRefused, match="the COB-ID of a TPDO has"):
        _disabled(data)


def test_an_observation_stays_as_late_as_it_was(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    observations = Observations(bench.link)
    late_ms = iter([8.0, 0.0])
    monkeypatch.setattr(bench.link, "uncertainty_ms", lambda: next(late_ms))

    first = observations.once("timer", int, lambda: 1)
    second = observations.once("timer", int, lambda: 2)

    assert (first.outcome, first.late_ms) == (second.outcome, second.late_ms) == (1, 8.0)
