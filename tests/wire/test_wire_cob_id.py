"""COB-IDs."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.wire import cob_id
from conformance.wire.cob_id import CobId
from conformance.wire.errors import WireError


@pytest.mark.parametrize(
    ("function", "first", "last"),
    [
        (cob_id.emcy, 0x081, 0x0FF),
        (cob_id.sdo_response, 0x581, 0x5FF),
        (cob_id.sdo_request, 0x601, 0x67F),
        (cob_id.heartbeat, 0x701, 0x77F),
    ],
)
def test_the_predefined_connection_set_adds_the_node_id(
    function: Callable[[int], int], first: int, last: int
) -> None:
    assert (function(1), function(127)) == (first, last)
    for node_id in (-1, 0, 128):
        with pytest.raises(WireError, match="node-ID: expected 1h to 7Fh"):
            function(node_id)


def test_pdos_alternate_between_transmit_and_receive() -> None:
    assert [cob_id.tpdo(number, 0x32) for number in (1, 2, 3, 4)] == [0x1B2, 0x2B2, 0x3B2, 0x4B2]
    assert [cob_id.rpdo(number, 0x32) for number in (1, 2, 3, 4)] == [0x232, 0x332, 0x432, 0x532]


@pytest.mark.parametrize("function", [cob_id.tpdo, cob_id.rpdo])
@pytest.mark.parametrize("number", [0, 5])
def test_only_four_pdos_are_predefined(function: Callable[[int, int], int], number: int) -> None:
    with pytest.raises(WireError, match="PDO number: expected 1h to 4h"):
        function(number, 1)


def test_the_fixed_can_ids_are_those_of_the_standards() -> None:
    fixed = (cob_id.NMT, cob_id.SYNC, cob_id.TIME, cob_id.LSS_SLAVE, cob_id.LSS_MASTER)
    assert fixed == (0, 0x80, 0x100, 0x7E4, 0x7E5)


def test_restricted_can_ids_are_those_the_conformance_test_tool_writes() -> None:
    # Case 8.10 of CiA's tool (CANopenNode/CANopenDemo): 797 CAN-IDs per object.
    restricted = [can_id for can_id in range(0x800) if cob_id.is_restricted(can_id)]
    assert len(restricted) == 797
    edges = [
        can_id
        for can_id in range(0x800)
        if cob_id.is_restricted(can_id) != cob_id.is_restricted(can_id - 1)
    ]
    assert edges == [0, 0x80, 0x101, 0x181, 0x581, 0x600, 0x601, 0x680, 0x6E0, 0x700, 0x701]


BOTH_WAYS = [
    (CobId(0), 0),
    (CobId(0x1B2), 0x0000_01B2),
    (CobId(0x1B2, rtr_allowed=False), 0x4000_01B2),
    (CobId(0x1B2, valid=False), 0x8000_01B2),
    (CobId(0x7FF, valid=False, rtr_allowed=False), 0xC000_07FF),
    (CobId(0x18FF50E5, extended=True), 0x38FF_50E5),
    (CobId(0x181, extended=True), 0x2000_0181),
]


@pytest.mark.parametrize(("entry", "word"), BOTH_WAYS)
def test_a_cob_id_entry_encodes_and_decodes(entry: CobId, word: int) -> None:
    assert entry.to_word() == word
    assert CobId.from_word(word) == entry


@pytest.mark.parametrize("word", [0x0000_0801, 0x1000_0181, -1, 2**32])
def test_a_word_that_is_no_cob_id_entry_is_refused(word: int) -> None:
    with pytest.raises(WireError, match="COB-ID: expected"):
        CobId.from_word(word)


def test_a_can_id_beyond_its_format_is_refused() -> None:
    with pytest.raises(WireError, match="CAN-ID: expected 0h to 7FFh, got 800h"):
        CobId(0x800)


@given(st.integers(0, 0xFFFF_FFFF))
def test_any_word_survives_or_is_refused(word: int) -> None:
    try:
        entry = CobId.from_word(word)
    except WireError:
        assert not word & 1 << 29
    else:
        assert entry.to_word() == word
