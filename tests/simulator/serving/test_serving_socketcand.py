from __future__ import annotations

import pytest

from conformance.simulator.serving.socketcand import MOST, SocketcandSession
from conformance.wire.frame import Frame


class RecordedWire:
    def __init__(self) -> None:
        self.done: list[object] = []

    def open(self, bitrate: int) -> None:
        self.done.append(bitrate)

    def close(self) -> None:
        self.done.append("closed")

    def send(self, frame: Frame) -> None:
        self.done.append(frame)


@pytest.fixture
def wire() -> RecordedWire:
    return RecordedWire()


@pytest.fixture
def session(wire: RecordedWire) -> SocketcandSession:
    return SocketcandSession(wire, 250_000)


def test_a_client_opens_the_bus_in_raw_mode(session: SocketcandSession, wire: RecordedWire) -> None:
    assert session.feed(b"< open can0 >") == b"< ok >"
    assert wire.done == []
    assert session.feed(b"< rawm") == b""
    assert session.feed(b"ode >< echo >") == b"< ok >< echo >"
    assert wire.done == [250_000]


def test_frames_are_sent(session: SocketcandSession, wire: RecordedWire) -> None:
    session.feed(b"< open can0 >< rawmode >")
    assert session.feed(b"< send 123 2 11 a >< send 00000123 1 FF >< send 0 0  >") == b""
    assert wire.done[1:] == [
        Frame(0x123, b"\x11\x0a"),
        Frame(0x123, b"\xff", extended=True),
        Frame(0),
    ]


@pytest.mark.parametrize(
    "text",
    [
        *(b"send 123 2 11", b"send 123 1 111", b"send 800 0", b"send x 0", b"send 1 1 -1"),
        *(b"bcmmode", b"open can0", b"statistics 100", b"", b"\xff"),
    ],
)
def test_what_is_wrong_is_told(session: SocketcandSession, wire: RecordedWire, text: bytes) -> None:
    session.feed(b"< open can0 >< rawmode >")
    assert session.feed(b"< " + text + b" >").startswith(b"< error ")
    assert wire.done == [250_000]


def test_nothing_is_sent_or_told_before_raw_mode(
    session: SocketcandSession, wire: RecordedWire
) -> None:
    assert session.feed(b"< rawmode >").startswith(b"< error ")
    session.feed(b"< open can0 >")
    assert session.feed(b"< send 123 0 >").startswith(b"< error ")
    assert session.deliver(0, Frame(0x123)) == b""
    assert wire.done == []


def test_frames_are_told_with_their_time(session: SocketcandSession) -> None:
    session.feed(b"< open can0 >< rawmode >")
    frames = Frame(0x123, b"\x11\x0a"), Frame(0x123, b"", extended=True)
    told = [session.deliver(1_000_002_500, frame) for frame in frames]
    assert told == [b"< frame 123 1.000002 110A >", b"< frame 00000123 1.000002  >"]


def test_remote_frames_cannot_be_told(session: SocketcandSession) -> None:
    session.feed(b"< open can0 >< rawmode >")
    assert session.deliver(0, Frame(0x181, remote=True)) == b""


def test_endless_commands_take_no_memory(session: SocketcandSession) -> None:
    assert session.feed(b"<" * (MOST + 1)) == b"< error command too long >"
    assert session.feed(b"< echo >") == b"< echo >"
