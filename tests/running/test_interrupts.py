"""An interrupt waits until the device is as it was; a second one does not."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from conformance import resources
from conformance.bench.bus.link import Link
from conformance.bench.definition import load_bench
from conformance.bench.node.reach import Place
from conformance.bench.session import Bench
from conformance.interrupts import interruptible, uninterrupted
from conformance.spec.load import load_spec

AWAY = 500_000


@pytest.fixture(params=[signal.SIGINT, signal.SIGTERM])
def number(request: pytest.FixtureRequest) -> Iterator[signal.Signals]:
    before = signal.getsignal(request.param)
    with interruptible():
        yield request.param
    assert signal.getsignal(request.param) is before


@pytest.fixture
def bench() -> Iterator[Bench]:
    path = resources.find("device_specs", "siko_ims360", "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    bench = Bench.open(definition, load_spec(path).resolve(), {"channel": str(path)}, None)
    yield bench
    bench.close()


def press(number: signal.Signals) -> None:
    os.kill(os.getpid(), number)


def test_an_interrupt_comes_at_once(number: signal.Signals) -> None:
    with pytest.raises(KeyboardInterrupt):
        press(number)


def test_an_interrupt_waits_for_the_end_of_the_outermost_section(number: signal.Signals) -> None:
    done = []

    with pytest.raises(KeyboardInterrupt), uninterrupted():
        with uninterrupted():
            press(number)
            done.append("inner")
        done.append("outer")

    assert done == ["inner", "outer"]
    with uninterrupted():
        done.append("none waits any more")


def test_a_second_interrupt_comes_at_once(number: signal.Signals) -> None:
    done = []

    with pytest.raises(KeyboardInterrupt), uninterrupted():
        press(number)
        done.append("first")
        press(number)
        done.append("second")

    assert done == ["first"]


def test_a_node_is_brought_home_in_spite_of_an_interrupt(
    bench: Bench, number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = bench.node()
    entry = bench.spec.entries[0x2001, 0]
    home = bench.reach.home
    away = Place(home.node_id, AWAY)
    bench.reach.begin(node)
    bench.reach.write(node, (entry.key,), entry.type.encode(AWAY))
    node.save({entry.index})
    assert bench.reach.reset(node, away) == away
    use_bitrate = Link.use_bitrate

    def interrupted(link: Link, bitrate: int) -> None:
        use_bitrate(link, bitrate)
        monkeypatch.undo()
        press(number)

    monkeypatch.setattr(Link, "use_bitrate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.reach.bring_home(node)

    assert bench.reach.here == home
    assert node.number(*entry.key) == home.bitrate
