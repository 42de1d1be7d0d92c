"""`recover` begins anew where one answer did not come or a step was refused, and says so."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import pytest
from meddler import Meddler
from meddling import Mischief
from planned import LAST, Deed, Planned

from conformance.bench.given_back.journal import NAME, Found, Journal, load_journal
from conformance.commands.recover import recover
from conformance.errors import BenchError
from conformance.simulator import channel, device
from conformance.spec.model import Key
from conformance.wire.frame import Frame

BENCH = """format: 1
what: The simulated device, at which a run was cut short.
interface: canopen_simulator
channel: siko_ims360
allow: [reads, writes, resets, non-volatile]
"""
TIMER = (0x1800, 5)
SPEC = Path(__file__).parents[2] / "device_specs" / "siko_ims360.yaml"
STORED = b"\x60\x10\x10"
ANSWERS = 90
"""Of a recovery where all goes well."""

Recover: TypeAlias = Callable[..., list[str]]


class RefusesOnce(Mischief):
    """Takes the first store back."""

    def answer(self, frame: Frame) -> Iterable[Frame]:
        if not frame.data.startswith(STORED) or self.count:
            return (frame,)
        self.count += 1
        return (Frame(frame.can_id, b"\x80" + frame.data[1:4] + b"\x21\0\0\x08"),)


@pytest.fixture
def recovered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Recover:
    """Recover a device of which somebody spoils some frames; return what is said."""

    def run(mischief: Mischief, more: Mapping[Key, bytes] = MappingProxyType({})) -> list[str]:
        def meddled(*arguments: Any, **options: Any) -> Meddler:
            return Meddler(device.SimulatedDevice(*arguments, **options), mischief)

        monkeypatch.setattr(channel, "SimulatedDevice", meddled)
        (tmp_path / "bench.yaml").write_text(BENCH, encoding="utf-8")
        settings = {TIMER: b"\x2c\x01", **more}
        journal = Journal(str(SPEC), "one-axis", str(tmp_path / "bench.yaml"), 50, 125_000)
        journal.keep(tmp_path / NAME, Found(settings, settings))
        recover(tmp_path)
        assert load_journal(tmp_path).given_back
        return capsys.readouterr().out.splitlines()

    return run


GIVEN_BACK = "given back as it was found: 1 settings"


def test_nothing_is_said_where_every_answer_comes(recovered: Recover) -> None:
    assert recovered(Planned([])) == [GIVEN_BACK]


def test_an_answer_that_stays_out_is_no_reason_to_give_up(recovered: Recover) -> None:
    """Whichever it is; one of the first is asked for again at once."""
    said = [recovered(Planned([Deed("drop", nth, LAST)])) for nth in range(1, ANSWERS, 4)]
    assert {it[-1] for it in said} == {GIVEN_BACK}
    again = [line for it in said for line in it[:-1]]
    assert len(again) > len(said) / 2
    assert all(line.endswith("; beginning anew, try 2 of 3") for line in again)


def test_a_step_that_is_refused_once_is_no_reason_to_give_up(recovered: Recover) -> None:
    again, last = recovered(RefusesOnce(0))
    assert again.startswith("node 50 aborted download 1010h:")
    assert last == GIVEN_BACK


def test_a_node_that_is_nowhere_after_three_tries_leaves_a_list_to_set_by_hand(
    recovered: Recover, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(BenchError, match="the node is found nowhere; what it had stored is"):
        recovered(Planned([Deed("drop", 1, 1)]), {(0x1000, 0): bytes(4)})
    said = capsys.readouterr().out
    assert said.count("the node is found nowhere; beginning anew, try") == 2
    assert "1800h:05  Event timer" in said
    assert "2C 01" in said
    assert "1000h" not in said
