"""The sections of an EDS that describe file and device (CiA 306-1): FileInfo, DeviceInfo, Comments."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from typing import Final

from conformance.spec.bit_rates import bits_per_second
from conformance.spec.eds.kinds import IDENTITY_OBJECT
from conformance.spec.eds.model import BITRATES
from conformance.spec.model import DeviceSpec

_RPDOS: Final = range(0x1400, 0x1600)
_MOST_COLUMNS: Final = 200
_DUMMIES: Final = range(1, 8)


def device_info(spec: DeviceSpec, file_name: str, created: datetime) -> Iterator[str]:
    """Return the lines before the objects.

    Args:
        spec: The device spec.
        file_name: Of the EDS.
        created: Date and time to put into it.
    """
    day, hour = created.strftime("%m-%d-%Y"), created.strftime("%I:%M%p")
    yield "[FileInfo]"
    yield f"FileName={_line(file_name)}"
    yield "FileVersion=1"
    yield "FileRevision=0"
    yield "EDSVersion=4.0"
    yield f"Description={_line(spec.manual.name)}"
    yield from (f"{what}Time={hour}" for what in ("Creation", "Modification"))
    yield from (f"{what}Date={day}" for what in ("Creation", "Modification"))
    yield from (f"{what}By=canopen-conformance" for what in ("Created", "Modified"))
    yield ""
    yield "[DeviceInfo]"
    yield f"VendorName={_line(spec.device.vendor)}"
    yield f"VendorNumber={_identity(spec, 1)}"
    yield f"ProductName={_line(spec.device.name)}"
    yield f"ProductNumber={_identity(spec, 2)}"
    yield f"RevisionNumber={_identity(spec, 3)}"
    rates = _bitrates(spec)
    yield from (f"BaudRate_{rate // 1000}={int(rate in rates)}" for rate in BITRATES)
    yield "SimpleBootUpMaster=0"
    yield "SimpleBootUpSlave=1"
    yield f"Granularity={_granularity(spec)}"
    yield "DynamicChannelsSupported=0"
    yield "GroupMessaging=0"
    yield f"NrOfRXPDO={sum(index in _RPDOS for index in spec.indices())}"
    yield f"NrOfTXPDO={spec.services.tpdo.count if spec.services.tpdo else 0}"
    yield f"LSS_Supported={int(spec.services.lss is not None)}"
    yield ""
    yield "[DummyUsage]"
    yield from (f"Dummy{number:04X}=0" for number in _DUMMIES)
    yield ""
    comments = [
        f"Written from the device spec {spec.name}, variant {spec.variant}",
        f"Factory settings: node-ID {spec.node_id}, {spec.bitrate // 1000} kbit/s",
    ]
    yield "[Comments]"
    yield f"Lines={len(comments)}"
    yield from (f"Line{number}={_line(text)}" for number, text in enumerate(comments, 1))
    yield ""


def _identity(spec: DeviceSpec, sub: int) -> str:
    entry = spec.entry(IDENTITY_OBJECT, sub)
    return f"0x{entry.default:X}" if entry is not None and isinstance(entry.default, int) else "0"


def _granularity(spec: DeviceSpec) -> int:
    """Return 8 where the mapping can be changed, 0 where it cannot."""
    tpdo = spec.services.tpdo
    first = None if tpdo is None else spec.entry(tpdo.mapping, 1)
    return 8 if first is not None and first.writable else 0


def _bitrates(spec: DeviceSpec) -> set[int]:
    """Return the bit rates in bit/s that the object for the bit rate takes, and the factory's."""
    service = spec.services.bitrate
    entries = () if service is None else spec.subs(service.object)
    return {
        spec.bitrate,
        *(bits_per_second(it, value) for it in entries for value in it.values or ()),
    }


def _line(text: str) -> str:
    return " ".join(text.split())[:_MOST_COLUMNS]
