"""SDO abort codes."""

import pytest

from conformance.wire.abort import AbortCode, describe

# CiA 301 v4.2.0, table 22, as reprinted in Danfoss FC 300 and Toshiba VF-S15 manuals.
TABLE_22 = """
05030000 05040000 05040001 05040002 05040003 05040004 05040005 06010000 06010001 06010002 06020000
06040041 06040042 06040043 06040047 06060000 06070010 06070012 06070013 06090011 06090030 06090031
06090032 06090036 060A0023 08000000 08000020 08000021 08000022 08000023 08000024
"""


def test_the_codes_are_those_of_the_standard() -> None:
    assert [f"{code:08X}" for code in AbortCode] == TABLE_22.split()


def test_each_code_has_its_own_text() -> None:
    texts = {code.text for code in AbortCode}
    assert len(texts) == len(AbortCode)
    assert all(texts)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (AbortCode.OBJECT_DOES_NOT_EXIST, "0602 0000h object does not exist"),
        (0x0503_0000, "0503 0000h toggle bit not alternated"),
        (0x060A_0023, "060A 0023h resource not available: SDO connection"),
        (0x1234_ABCD, "1234 ABCDh unknown abort code"),
        (0, "0000 0000h unknown abort code"),
    ],
)
def test_a_code_is_described_as_the_standard_prints_it(code: int, text: str) -> None:
    assert describe(code) == text
