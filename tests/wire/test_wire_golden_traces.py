"""Frames printed in manuals, decoded and encoded again: vectors that this project did not make."""

import re
from collections.abc import Callable, Iterator
from typing import Final

import pytest
from ruamel.yaml import YAML

from conformance.resources import data
from conformance.wire import emcy, lss, nmt, pdo, sdo, sync
from conformance.wire.frame import Frame

_FRAME: Final = re.compile(r"\(?([<>]) ([0-9A-F]{3})#((?:[0-9A-F]{2}|\.\.)*)\)?")


def frames() -> Iterator[str]:
    """Yield each line with a frame once, bytes left open as 00h."""
    for path in sorted(data("fixtures/traces").glob("*.yaml")):
        for trace in YAML(typ="safe").load(path)["traces"]:
            fill = trace.get("fill", {})
            for line in trace["frames"]:
                if _FRAME.fullmatch(line.format_map(fill)):
                    yield line.format_map(fill).replace("..", "00").strip("()")


def _emcy(frame: Frame) -> Frame:
    return emcy.encode(emcy.decode(frame), frame.can_id)


def _sdo_response(frame: Frame) -> Frame:
    return Frame(frame.can_id, sdo.encode(sdo.decode_response(frame.data)))


def _sdo_request(frame: Frame) -> Frame:
    return Frame(frame.can_id, sdo.encode(sdo.decode_request(frame.data)))


def _lss(frame: Frame) -> Frame:
    decode = lss.decode_master if frame.can_id == 0x7E5 else lss.decode_slave
    return Frame(frame.can_id, lss.encode(decode(frame.data)))


def _pdo(frame: Frame) -> Frame:
    words = pdo.unpack(frame.data, [16] * (len(frame.data) // 2))
    return Frame(frame.can_id, pdo.pack([(word, 16) for word in words]))


CODECS: Final[tuple[tuple[range, Callable[[Frame], Frame]], ...]] = (
    (range(1), lambda frame: nmt.encode_request(nmt.decode_request(frame))),
    (range(0x080, 0x081), lambda frame: sync.encode(sync.decode(frame))),
    (range(0x081, 0x100), _emcy),
    (range(0x181, 0x500), _pdo),
    (range(0x581, 0x600), _sdo_response),
    (range(0x601, 0x680), _sdo_request),
    (range(0x701, 0x780), lambda frame: nmt.encode_heartbeat(nmt.decode_heartbeat(frame))),
    (range(0x7E4, 0x7E6), _lss),
)
"""By the place in the predefined connection set."""


@pytest.mark.parametrize("line", sorted(set(frames())))
def test_a_printed_frame_survives_its_codec(line: str) -> None:
    match = _FRAME.fullmatch(line)
    assert match is not None
    frame = Frame(int(match[2], 16), bytes.fromhex(match[3]))

    (again,) = (codec(frame) for ids, codec in CODECS if frame.can_id in ids)

    assert again == frame
