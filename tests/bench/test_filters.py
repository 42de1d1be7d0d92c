"""Filters are waited for after a tilt, and a node on which they were tried is left as it was."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import pytest

from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.sensor.filters import (
    Choice,
    Look,
    Response,
    choices,
    filters,
    moments,
    observe_filters,
    require_looks,
)
from conformance.bench.sensor.fusion import observe_fusion
from conformance.bench.sensor.settling import Settling
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.session import Bench
from conformance.bench.settings.settings import Settings
from conformance.errors import HostLate, SetupRefused
from conformance.resources import data
from conformance.spec.load import load_spec
from conformance.wire.nmt import NmtCommand

Open: TypeAlias = Callable[..., tuple[Bench, Node, Stimulus]]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Open]:
    benches: list[Bench] = []

    def open_one(device: str, variant: str, **options: object) -> tuple[Bench, Node, Stimulus]:
        path = data("device_specs") / f"{device}.yaml"
        spec = load_spec(path).resolve(variant)
        definition = load_bench(data("fixtures/benches") / "simulator.yaml")
        given = {"channel": str(path), "variant": variant, **options}
        bench = Bench.open(definition, spec, given, tmp_path / "trace.log")
        benches.append(bench)
        bench.find_node()
        node = bench.node()
        return bench, node, Stimulus(bench.link, Settling(node))

    yield open_one
    for bench in benches:
        bench.close()


@pytest.mark.parametrize(("cut_off_mhz", "kind"), [(100, 2), (300, 1), (8000, 2), (2000, 0)])
def test_a_tilt_is_over_when_the_filter_has_followed(
    opened: Open, cut_off_mhz: int, kind: int
) -> None:
    _, node, stimulus = opened("siko_ims360", "two-axis")
    node.download(0x3110, 1, kind)
    node.download(0x3111, 0, cut_off_mhz)

    stimulus.tilt(40.0, -40.0)

    assert node.number(0x6110) == pytest.approx(4000, abs=3)
    assert node.number(0x6120) == pytest.approx(-4000, abs=3)


def test_a_node_that_does_not_answer_is_not_waited_for_long(opened: Open) -> None:
    bench, node, stimulus = opened("siko_ims360", "two-axis")
    node.nmt(NmtCommand.STOP)
    before = bench.link.now()

    stimulus.tilt(40.0, -40.0)

    assert bench.link.now() - before < 2.0


def test_what_to_try_is_legal_and_in_the_documented_order() -> None:
    ims = load_spec(data("device_specs") / "siko_ims360.yaml").resolve("one-axis")
    dst = load_spec(data("device_specs") / "danfoss_dst_x730.yaml").resolve("xy-10")
    assert choices(ims, filters(ims)[0]) == [
        Choice(0, None),
        Choice(1, 2.0),
        Choice(2, 0.5),
        Choice(2, 2.0),
    ]
    assert choices(dst, filters(dst)[0]) == [Choice(0, None), Choice(1, None), Choice(2, None)]
    assert "at-once" in moments(ims, filters(ims)[0])
    assert moments(dst, filters(dst)[0]) == {"after-store", "after-store-and-reset"}


@pytest.mark.parametrize("faults", ["", "readback-stale"])
@pytest.mark.parametrize(
    ("device", "variant", "key", "value"),
    [("siko_ims360", "two-axis", (0x3111, 0), 1234), ("danfoss_dst_x730", "xy-30", (0x2001, 0), 1)],
)
def test_the_node_is_left_with_what_it_had_stored(
    opened: Open, device: str, variant: str, key: tuple[int, int], value: int, faults: str
) -> None:
    _, node, stimulus = opened(device, variant, faults=faults)
    if not faults:
        entry = node.spec.entries[key]
        node.write(*key, entry.type.encode(value))
        Settings(node).begin()
        node.write(*key, entry.type.encode(value))
        node.save({key[0]})
        node.reset()
    before = node.number(*key)

    try:
        observe_filters(node, stimulus, filters(node.spec), (2.0, 2.0), (8.0, 8.0))
    except SetupRefused:
        assert faults
    else:
        assert not faults

    node.power_cycle()
    assert node.number(*key) == before
    assert faults or before == value


@pytest.mark.parametrize("fusion", [0, 1])
def test_filters_are_tried_without_the_fusion_and_the_fusion_without_filter(
    opened: Open, fusion: int
) -> None:
    _, node, stimulus = opened("siko_ims360", "two-axis")
    settings = {(0x3110, 2): fusion, (0x3112, 2): 3}
    for key, value in settings.items():
        node.write(*key, node.spec.entries[key].type.encode(value))
    node.save({0x3110, 0x3112})
    node.reset()
    rules, slow = filters(node.spec), Choice(2, 0.5)

    filtered = observe_filters(node, stimulus, rules, (2.0, 2.0), (8.0, 8.0))
    fused = observe_fusion(node, stimulus, rules, slow, (2.0, 2.0), (8.0, 8.0))

    assert filtered.responses[slow][0x6110, 0].half_s > 0.5
    assert [it[0x6110, 0].half_s < 0.1 for it in fused.responses.values()] == [True, True]
    node.power_cycle()
    assert {key: node.number(*key) for key in settings} == settings


def response_with(answered_s: float) -> Response:
    """Return one that nobody saw for 0.3 s, of which an answer took so long."""
    looks = (Look(0.0, 0, 0.0), Look(0.1, 10, 0.01), Look(0.4, 60, 0.01 + answered_s))
    return Response(0, (*looks, Look(0.5, 100, 0.02 + answered_s)))


def test_a_response_tells_how_long_nobody_looked_before_its_half() -> None:
    response = response_with(answered_s=0.02)

    assert response.half_s == pytest.approx(0.4)
    assert response.gap.unseen_s == pytest.approx(0.3)
    assert response.longest_gap == response.gap


def test_a_computer_that_alone_kept_a_value_from_being_looked_at_is_late() -> None:
    with pytest.raises(HostLate, match=r"nobody could look for 0\.300 s") as caught:
        require_looks([response_with(0.02).gap], 0.2)

    assert caught.value.late_ms == pytest.approx(275)


@pytest.mark.parametrize("answered_s", [0.295, 0.25, 0.2])
def test_a_node_that_kept_one_waiting_is_no_late_computer(answered_s: float) -> None:
    with pytest.raises(SetupRefused, match="the bus is too busy") as caught:
        require_looks([response_with(answered_s).gap], 0.2)

    assert not isinstance(caught.value, HostLate)


def test_a_value_that_was_looked_at_often_enough_may_be_judged() -> None:
    require_looks([response_with(0.02).gap], 0.3001)
