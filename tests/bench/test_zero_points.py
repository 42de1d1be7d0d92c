"""Zero points are moved, stored and restored; a node keeps what it had stored before."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.session import Bench
from conformance.bench.settings.zero_points import SHIFT, Tried, ZeroPoint, observe_zero_points
from conformance.errors import SetupRefused
from conformance.simulator.interface import SimulatorBus
from conformance.spec.document import Store
from conformance.spec.load import load_spec

X = ZeroPoint((0x6010, 0), (0x6012, 0), (0x6013, 0))
Y = ZeroPoint((0x6020, 0), (0x6022, 0), (0x6023, 0))


@contextmanager
def open_bench(
    device: str = "danfoss_dst_x730", variant: str = "xy-30", **options: Any
) -> Iterator[Bench]:
    path = resources.find("device_specs", device, "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    spec = load_spec(path).resolve(variant)
    options = {"channel": str(path), "variant": variant, **options}
    bench = Bench.open(definition, spec, options, None)
    try:
        yield bench
    finally:
        bench.close()


def tried(bench: Bench) -> Tried:
    node = bench.node()
    restore = node.spec.services.restore
    assert isinstance(restore, Store)
    seen = observe_zero_points(node, [X, Y], restore, 1)
    assert [node.number(*point.offset) for point in (X, Y)] == [0, 0]
    node.reset()
    assert [node.number(*point.offset) for point in (X, Y)] == [0, 0]
    return seen


def memory(bench: Bench) -> dict[Any, Any]:
    rig = bench.link.rig
    assert isinstance(rig, SimulatorBus)
    with rig.present() as bus:
        return dict(bus.nodes[0].memory.values)


@pytest.mark.parametrize(
    ("options", "kept"),
    [({}, SHIFT), ({"readings": {"DST-15": 2}}, 0), ({"readings": {"DST-79": 2}}, SHIFT)],
)
def test_a_stored_zero_point_is_kept_until_it_is_restored(
    options: dict[str, Any], kept: int
) -> None:
    with open_bench(**options) as bench:
        seen = tried(bench)
        assert memory(bench) == {}

    for point in (X, Y):
        assert seen.found[point.offset] == 0
        assert seen.stored[point.offset] == SHIFT
        assert seen.after[point.offset] == kept
        assert seen.restored[point.offset] == seen.restored[point.preset] == 0


def test_a_zero_point_that_no_restore_takes_away_is_taken_away_by_presets() -> None:
    with open_bench(faults=["restore-forgets"]) as bench:
        seen = tried(bench)

    assert seen.restored[X.offset] == SHIFT


def test_a_preset_without_effect_decides_nothing() -> None:
    with open_bench(faults=["preset-ignored"]) as bench:
        with pytest.raises(SetupRefused, match="has no effect"):
            tried(bench)
        assert memory(bench) == {}


def test_zero_points_of_coupled_slopes_come_back_as_they_were_stored() -> None:
    narrow, wide = X, ZeroPoint((0x6110, 0), (0x6112, 0), (0x6113, 0))
    with open_bench("baumer_gim140r", "two-dimensional", faults=["restore-forgets"]) as bench:
        node = bench.node()
        node.write(*narrow.preset, node.spec.entries[narrow.preset].type.encode(50))
        node.save({narrow.offset[0]})
        held = memory(bench)
        restore = node.spec.services.restore
        assert isinstance(restore, Store)
        observe_zero_points(node, [narrow, wide], restore, 1)

        assert memory(bench) == held
