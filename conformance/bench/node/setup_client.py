"""Python-canopen's SDO client on the link, for the steps that prepare a check.

It decides no verdict: whatever keeps a step from succeeding ends the check as inconclusive.
"""

from __future__ import annotations

from functools import cached_property

import canopen
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from conformance.bench.node.channel import SdoChannel
from conformance.errors import NodeTimeout, SetupRefused
from conformance.spec.model import address
from conformance.wire.abort import describe


class _ChannelNetwork(canopen.Network):
    """Sends requests through the channel; receiving is the client's own pump."""

    def __init__(self, channel: SdoChannel) -> None:
        super().__init__()
        self._channel = channel

    def send_message(self, _can_id: int, data: bytes, _remote: bool = False) -> None:
        self._channel.send(bytes(data))


class PumpedSdoClient(SdoClient):
    """An SDO client that waits for a response by pumping the link: no thread, no retry."""

    MAX_RETRIES = 1

    def __init__(self, channel: SdoChannel) -> None:
        super().__init__(  # type: ignore[no-untyped-call]  # canopen is partly untyped
            channel.request_id,
            channel.response_id,
            ObjectDictionary(),  # type: ignore[no-untyped-call]  # canopen is partly untyped
        )
        self.network = _ChannelNetwork(channel)
        self._channel = channel

    def read_response(self) -> bytes:
        """Return the next response of the node."""
        received = self._channel.receive()
        if received is None:
            self._channel.unanswered += 1
            raise SdoCommunicationError("no SDO response")
        data = received.frame.data.ljust(8, b"\0")
        if data[0] == 0x80:
            raise SdoAbortedError(int.from_bytes(data[4:8], "little"))
        return data


class SetupClient:
    """Downloads for set-up.

    Args:
        channel: The node's SDO server.
    """

    def __init__(self, channel: SdoChannel) -> None:
        self._channel = channel

    @cached_property
    def _client(self) -> PumpedSdoClient:
        return PumpedSdoClient(self._channel)

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write to the node.

        Raises:
            SetupRefused: The node aborted the transfer.
            NodeTimeout: It did not answer, or not with an answer to this request.
        """
        try:
            self._client.download(index, sub, data)
        except SdoAbortedError as error:
            raise SetupRefused(
                f"node {self._channel.node_id} aborted download {address(index, sub)}: "
                f"{describe(error.code)} (value {data.hex(' ').upper()})"
            ) from error
        except SdoCommunicationError as error:
            raise NodeTimeout(
                f"node {self._channel.node_id}: no usable SDO response to download {address(index, sub)} "
                f"within {self._channel.timeout_s:g} s ({error})"
            ) from error
