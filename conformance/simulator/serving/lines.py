"""Where others reach simulated devices: a pseudo-terminal, TCP connections, a python-can bus."""

from __future__ import annotations

import os
import queue
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final, Protocol, TypeAlias

import can

from conformance.errors import BenchError
from conformance.messages import to_frame, to_message
from conformance.simulator.bus import Client, SimulatedBus
from conformance.simulator.serving.loop import Loop
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame

CHUNK: Final = 65536
"""Octets that are read at once."""
MOST_WAITING: Final = 1 << 20
"""Octets that may wait for who does not read them; what comes then is lost, as in an adapter."""

_POLL_S: Final = 0.2


Address: TypeAlias = tuple[str, int]
"""Host and port; port 0 for any that is free."""


Write: TypeAlias = Callable[[bytes], None]
Speak: TypeAlias = Callable[[Write], tuple[Callable[[bytes], bytes], bytes, Callable[[], None]]]
"""Given what puts octets on a connection: what takes octets, what is said first, and what ends it."""


class Speaker(Protocol):
    """The sans-IO side of a line: octets in, octets out."""

    def feed(self, data: bytes) -> bytes:
        """Take octets and return what goes back."""

    def deliver(self, time_ns: int, frame: Frame) -> bytes:
        """Return a frame from the bus as it goes on the line."""


class BusWire:
    """The CAN side of an adapter at a simulated bus.

    Args:
        loop: It lets the bus live.
        bus: The bus.
        write: Puts octets on the line.
        since_s: Time of the bus' beginning that the line's timestamps count from, in seconds.
    """

    def __init__(self, loop: Loop, bus: SimulatedBus, write: Write, since_s: float = 0.0) -> None:
        self._loop = loop
        self._bus = bus
        self._write = write
        self._since_ns = round(since_s * 1e9)
        self._client: Client | None = None
        self.speaker: Speaker | None = None

    def open(self, bitrate: int) -> None:
        """Connect to the bus at a bit rate in bit/s."""
        with self._loop.present():
            self._client = self._bus.connect(self._hear, bitrate)

    def close(self) -> None:
        """Disconnect."""
        if self._client is not None:
            self._bus.disconnect(self._client)
            self._client = None

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        if self._client is not None:
            with self._loop.present():
                self._bus.send(self._client, frame)

    def _hear(self, end_ns: int, frame: Frame, own: bool) -> None:
        if not own and self.speaker is not None:
            self._write(self.speaker.deliver(self._since_ns + end_ns, frame))


class PtyLine:
    """The adapter's end of a serial line: a pseudo-terminal and a link to its other end.

    Args:
        loop: It tells when there is something to read.
        link: Where the other end is found.

    Raises:
        BenchError: There are no pseudo-terminals here, or the link cannot be made.
    """

    def __init__(self, loop: Loop, link: Path) -> None:
        try:
            import tty  # noqa: PLC0415 - not on Windows
        except ImportError as error:
            raise BenchError("--slcan-pty: there are no pseudo-terminals on this system") from error
        self._loop = loop
        self._link = link
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        self.speaker: Speaker | None = None
        try:
            if link.is_symlink():
                link.unlink()
            link.symlink_to(os.ttyname(self._far))
        except OSError as error:
            self._shut()
            raise BenchError(f"--slcan-pty: cannot make {link}: {error.strerror}") from error
        loop.watch(self._near, self._read)

    def write(self, data: bytes) -> None:
        """Put octets on the line; what finds no place is lost."""
        with suppress(BlockingIOError):
            if data:
                os.write(self._near, data)

    def close(self) -> None:
        """End the line and take the link away."""
        self._loop.forget(self._near)
        self._shut()
        self._link.unlink(missing_ok=True)

    def _shut(self) -> None:
        os.close(self._near)
        os.close(self._far)

    def _read(self) -> None:
        data = os.read(self._near, CHUNK)
        if self.speaker is not None:
            self.write(self.speaker.feed(data))


class TcpServer:
    """A server on one address; each connection has its own speaker.

    Args:
        loop: It tells when there is something to read.
        address: Where it listens.
        option: The option that named the address.
        speak: Makes the speaker of a connection.

    Raises:
        BenchError: The address cannot be listened on.
    """

    def __init__(
        self,
        loop: Loop,
        address: Address,
        option: str,
        speak: Speak,
    ) -> None:
        self._loop = loop
        self._speak = speak
        self._connections: list[_Connection] = []
        try:
            self._socket = socket.create_server(address)
        except OSError as error:
            host, port = address
            raise BenchError(
                f"{option}: cannot listen on {host}:{port}: {error.strerror}"
            ) from error
        self._socket.setblocking(False)
        loop.watch(self._socket, self._accept)

    @property
    def port(self) -> int:
        """The port it listens on."""
        return int(self._socket.getsockname()[1])

    def close(self) -> None:
        """End all connections and listen no more."""
        for connection in tuple(self._connections):
            connection.close()
        self._loop.forget(self._socket)
        self._socket.close()

    def _accept(self) -> None:
        try:
            made, _ = self._socket.accept()
        except OSError:
            return  # it is gone already
        connection = _Connection(self._loop, made, self._connections.remove)
        self._connections.append(connection)
        connection.feed, hello, connection.end = self._speak(connection.write)
        connection.write(hello)


class _Connection:
    """One TCP connection."""

    def __init__(
        self, loop: Loop, made: socket.socket, closed: Callable[[_Connection], None]
    ) -> None:
        self.feed: Callable[[bytes], bytes] = lambda _: b""
        self.end: Callable[[], None] = lambda: None
        self._loop = loop
        self._closed = closed
        self._socket = made
        made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MOST_WAITING)
        made.setblocking(False)
        self._open = True
        loop.watch(made, self._read)

    def write(self, data: bytes) -> None:
        if not data or not self._open:
            return
        try:
            sent = self._socket.send(data)
        except BlockingIOError:
            return  # lost, as a whole
        except OSError:
            self.close()
            return
        if sent < len(data):
            self.close()  # half a frame is worse than none

    def close(self) -> None:
        if self._open:
            self._open = False
            self._loop.forget(self._socket)
            self._socket.close()
            self._closed(self)
            self.end()

    def _read(self) -> None:
        try:
            data = self._socket.recv(CHUNK)
        except OSError:
            data = b""
        if data:
            self.write(self.feed(data))
        else:
            self.close()


class LibraryLine:
    """A python-can bus whose frames come into a loop.

    Args:
        loop: It is woken by frames.
        bus: The bus; closed with the line.
        hear: Takes each frame received.
    """

    def __init__(self, loop: Loop, bus: can.BusABC, hear: Callable[[Frame], None]) -> None:
        self._loop = loop
        self._bus = bus
        self._hear = hear
        self._waker, self._woken = socket.socketpair()
        self._received: queue.SimpleQueue[can.Message | None] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._source = _fileno(bus)
        if self._source is None:
            self._source = self._woken.fileno()
            self._thread = threading.Thread(target=self._listen, daemon=True)
            self._thread.start()
        loop.watch(self._source, self._ready)

    def send(self, frame: Frame) -> None:
        """Send a frame; an adapter that cannot loses it."""
        with suppress(can.CanError):
            self._bus.send(to_message(frame))

    def close(self) -> None:
        """Close the bus."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        self._loop.forget(self._source or 0)
        self._bus.shutdown()
        self._waker.close()
        self._woken.close()

    def _listen(self) -> None:
        """Receive for the loop, where its selector cannot watch the bus itself."""
        while not self._closing.is_set():
            try:
                message = self._bus.recv(_POLL_S)
            except (can.CanError, OSError):
                message = None
                self._closing.set()
            if message is not None or self._closing.is_set():
                self._received.put(message)
                self._waker.send(b"\0")

    def _ready(self) -> None:
        message: can.Message | None
        if self._thread is None:
            try:
                message = self._bus.recv(0)
            except (can.CanError, OSError) as error:
                raise BenchError(f"the adapter stopped receiving: {error}") from error
        else:
            self._woken.recv(1)
            message = self._received.get()
            if message is None:
                raise BenchError("the adapter stopped receiving")
        if message is None or message.is_error_frame or message.is_fd:
            return
        with suppress(WireError):
            self._hear(to_frame(message))


def _fileno(bus: can.BusABC) -> int | None:
    try:
        number = bus.fileno()
    except NotImplementedError:
        return None
    return number if number >= 0 else None
