"""How a node is reached: pairs, aliases, when a new setting counts, and COB-IDs that follow it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

from conformance.simulator.fault_files import load_faults

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"

RESETS = ["reset node", "reset communication"]
STARTS = [*RESETS, "power cycle"]


@pytest.mark.parametrize("how", STARTS)
def test_a_node_id_counts_once_both_objects_hold_it(dst: Build, how: str) -> None:
    device = dst()
    device.set(x20F0=6)
    assert (device.read(0x20F0), device.read(0x20F1)) == (6, 127)
    assert device.reset(how) == ["77F#00"], "one object alone changes nothing"
    assert (device.read(0x20F0), device.read(0x20F1)) == (127, 127)
    device.set(x20F0=6, x20F1=7)
    assert device.reset(how) == ["77F#00"], "they disagree"
    assert (device.read(0x20F0), device.read(0x20F1)) == (127, 127)
    device.set(x20F1=6, x20F0=6)
    assert device.read(0x1017) == 0, "reached under the old one until the reset"
    assert device.reset(how) == ["706#00"]
    assert device.read("0x1200:1") == 0x606
    device.set(x20F1=9)
    assert device.reset(how) == ["706#00"], "what they last agreed on"
    assert device.reset("power cycle") == ["706#00"]


@pytest.mark.parametrize("how", ["reset node", "power cycle"])
def test_a_bit_rate_counts_once_both_objects_hold_it(dst: Build, how: str) -> None:
    device = dst()
    device.set(x20F2=2)
    device.reset(how)
    assert device.device.bitrate == 250_000
    assert (device.read(0x20F2), device.read(0x20F3)) == (3, 3)
    device.set(x20F2=2, x20F3=2)
    assert device.device.bitrate == 250_000
    device.reset(how)
    assert device.device.bitrate == 500_000
    assert (device.read(0x20F2), device.read(0x20F3)) == (2, 2)


@pytest.mark.parametrize("address", [0x20F0, 0x20F1])
@pytest.mark.parametrize("value", [0, 128])
def test_a_node_id_that_is_none_leaves_the_setting(dst: Build, address: int, value: int) -> None:
    device = dst()
    assert device.write(address, value).startswith("abort")
    assert device.read(address) == 127


def test_a_pair_may_read_the_old_value_until_both_agree(dst: Build) -> None:
    device = dst({"DST-94": 2})
    device.set(x20F0=6, x20F2=2)
    assert (device.read(0x20F0), device.read(0x20F2)) == (127, 3)
    device.set(x20F1=7)
    assert (device.read(0x20F0), device.read(0x20F1)) == (127, 127), "they disagree"
    device.set(x20F1=6, x20F3=2)
    assert [device.read(it) for it in (0x20F0, 0x20F1, 0x20F2, 0x20F3)] == [6, 6, 2, 2]
    assert device.reset() == ["706#00"]
    assert device.device.bitrate == 500_000
    device.set(x20F0=7)
    assert device.reset() == ["706#00"]


def test_a_pair_may_have_to_be_saved(dst: Build) -> None:
    device = dst({"DST-96": 2})
    device.set(x20F0=6, x20F1=6, x20F2=2, x20F3=2)
    assert device.reset() == ["77F#00"]
    assert device.device.bitrate == 250_000
    device.set(x20F0=6, x20F1=6, x20F2=2, x20F3=2)
    assert device.save_and_reset() == ["706#00"]
    assert device.device.bitrate == 500_000


def test_a_pair_may_need_the_supply_switched(dst: Build) -> None:
    device = dst({"DST-97": 2})
    device.set(x20F0=6, x20F1=6, x20F2=2, x20F3=2)
    assert device.reset() == ["77F#00"]
    assert device.device.bitrate == 250_000
    assert device.reset("power cycle") == ["706#00"]
    assert device.device.bitrate == 500_000


def test_a_device_delivered_with_a_node_id_of_its_own_falls_back_on_it(dst: Build) -> None:
    device = dst(node_id=5)
    device.set(x20F0=6)
    assert device.reset() == ["705#00"]
    assert device.read(0x20F1) == 5


@pytest.mark.parametrize(("address", "alias"), [(0x2101, 0x3001), (0x2100, 0x3000)])
def test_an_alias_is_the_same_value(gim: Build, address: int, alias: int) -> None:
    device = gim()
    assert device.write(address, 5) == "ok"
    assert device.read(alias) == 5
    assert device.write(alias, 7) == "ok"
    assert device.read(address) == 7
    assert device.write(alias, 200).startswith("abort")
    assert (device.read(address), device.read(alias)) == (7, 7)


@pytest.mark.parametrize("address", [0x2101, 0x3001])
@pytest.mark.parametrize("how", STARTS)
def test_a_node_id_counts_after_save_and_reset(gim: Build, address: int, how: str) -> None:
    device = gim()
    assert device.write(address, 5) == "ok"
    assert device.reset(how) == ["701#00"], "it was not saved"
    assert device.read(address) == 1
    assert device.write(address, 5) == "ok"
    device.save()
    assert device.read(0x2101) == 5, "read under the old node-ID"
    assert device.reset(how) == ["705#00"]
    assert [device.read(it) for it in (0x2101, 0x3001, "0x1200:2")] == [5, 5, 0x585]


@pytest.mark.parametrize("address", [0x2100, 0x3000])
@pytest.mark.parametrize("how", STARTS)
def test_a_bit_rate_counts_after_save_and_reset(gim: Build, address: int, how: str) -> None:
    device = gim()
    assert device.write(address, 8) == "ok"
    device.save()
    assert device.device.bitrate == 250_000
    device.reset(how)
    assert device.device.bitrate == 10_000


@pytest.mark.parametrize("how", RESETS)
def test_a_setting_may_need_the_supply_switched(gim: Build, how: str) -> None:
    device = gim({"GIM-25": 2})
    device.set(x3001=5, x2100=2)
    assert device.save_and_reset(how) == ["701#00"]
    assert device.device.bitrate == 250_000
    assert (device.read(0x2101), device.read(0x3000)) == (5, 2)
    assert device.reset("power cycle") == ["705#00"]
    assert device.device.bitrate == 500_000


def at_node_4(gim: Build, readings: dict[str, int] | None = None) -> Wired:
    """A device at node-ID 4 whose COB-IDs were moved up by 3: EMCY 87h, TPDO 187h."""
    device = gim(readings, node_id=4)
    assert (device.read(0x1014), device.read("0x1800:1")) == (0x84, 0x184)
    device.set(x1014=0x8000_0084)
    device.set(x1014=0x87)
    device.set(x1800_1=0x8000_0184)
    device.set(x1800_1=0x187)
    return device


@pytest.mark.parametrize(
    ("readings", "emcy", "tpdo"),
    [({}, 0x8C, 0x18C), ({"GIM-83": 2}, 0x89, 0x18C), ({"GIM-84": 2}, 0x8C, 0x187)],
)
def test_a_cob_id_is_kept_as_its_difference(
    gim: Build, readings: dict[str, int], emcy: int, tpdo: int
) -> None:
    device = at_node_4(gim, readings)
    assert device.fail(0x1000) == ["087#0010010000000000"], "it counts at once"
    device.recover(0x1000)
    device.set(x3001=9)
    device.save()
    assert device.read(0x1014) == 0x87, "node-ID 4 is still in force"
    assert device.reset() == ["709#00"]
    assert (device.read(0x1014), device.read("0x1800:1")) == (emcy, tpdo)
    assert device.fail(0x1000) == [f"{emcy:03X}#0010010000000000"]
    device.device.clear_error(0x1000)
    assert device.nmt(0x01, 0.05)[-1].startswith(f"{tpdo:03X}#")
    assert device.reset("power cycle") == ["709#00"]
    assert device.read(0x1014) == emcy


def test_a_cob_id_of_the_default_follows_the_node_id(gim: Build) -> None:
    device = gim(node_id=4)
    device.set(x2101=9)
    device.save_and_reset()
    assert (device.read(0x1014), device.read("0x1800:1")) == (0x89, 0x189)


def test_the_difference_is_kept_with_a_node_id_that_counts_at_once(gim: Build) -> None:
    device = at_node_4(gim, {"GIM-26": 3})
    device.set(x2101=9)
    device.run(0.01)
    assert device.device.node_id == 9
    assert device.read(0x1014) == 0x8C


def test_a_restore_brings_back_the_default_difference(gim: Build) -> None:
    device = at_node_4(gim)
    device.save_and_reset()
    assert device.read(0x1014) == 0x87
    device.load()
    assert device.reset() == ["701#00"]
    assert device.read(0x1014) == 0x81


@pytest.mark.parametrize(
    ("name", "address", "readings"),
    [
        ("gim", 0x1014, {"GIM-85": 2}),
        ("gim", "0x1800:1", {"GIM-58": 2}),
        ("dst", 0x1014, {"DST-42": 2}),
        ("ims", "0x1800:1", {"IMS-35": 2}),
    ],
)
def test_a_valid_cob_id_must_be_made_invalid_before_it_moves_unless_a_reading_lets_it(
    request: pytest.FixtureRequest, name: str, address: int | str, readings: dict[str, int]
) -> None:
    build: Build = request.getfixturevalue(name)
    device = build()
    own = int(str(device.read(address)))
    assert device.write(address, 0x201).startswith("abort")
    assert device.read(address) == own
    assert device.write(address, own | 1 << 31) == "ok"
    assert device.write(address, 0x201) == "ok"
    lax = build(readings)
    assert lax.write(address, 0x201) == "ok"
    assert lax.read(address) == 0x201


def test_the_inhibit_time_may_change_while_valid_with_everything_else(ims: Build) -> None:
    assert ims().write("0x1800:3", 10).startswith("abort")
    device = ims({"IMS-35": 2})
    assert device.write("0x1800:3", 10) == "ok"
    assert device.write("0x1A00:0", 0).startswith("abort"), "everything but the mapping"


@pytest.mark.parametrize("address", ["0x20F0", "0x20F1"])
def test_a_node_id_of_which_one_object_is_not_kept_does_not_count(dst: Build, address: str) -> None:
    device = dst(faults=load_faults([f"objects/{address}/persistent=false"]))
    device.set(x20F0=6, x20F1=6)
    assert device.reset() == ["77F#00"]


@pytest.mark.parametrize(("address", "default"), [("0x2100", 4), ("0x2101", 2)])
def test_a_device_with_another_default_is_delivered_where_others_are(
    gim: Build, address: str, default: int
) -> None:
    device = gim(faults=load_faults([f"objects/{address}/default={default}"]))
    assert (device.device.node_id, device.device.bitrate) == (1, 250_000)
    device.load()
    device.reset()
    assert device.read(int(address, 16)) == default
