"""From an EDS to the text of a starting spec: what the EDS says, for a person to complete."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, datetime
from pathlib import Path
from typing import Any, Final

from conformance.errors import Problem, SpecError
from conformance.spec.eds.draft import VARIANT, Draft, draft_objects
from conformance.spec.eds.mend import mend
from conformance.spec.eds.model import BITRATES, EdsFile
from conformance.spec.eds.reader import read_eds
from conformance.spec.eds.services import device_figure
from conformance.spec.eds.yaml_text import comment, is_frame, yaml_text
from conformance.spec.yaml_reader import MOST_BYTES

_DEVICE_INFO: Final = "DeviceInfo"
_DATES: Final = ("%m-%d-%Y", "%Y-%m-%d", "%d-%b-%Y")
_COMMISSIONING: Final = ("DeviceComissioning", "DeviceCommissioning")
"""CiA 306 spells the section with one m."""
_USUAL: Final = (125_000, 250_000, 500_000, 1_000_000, 50_000, 20_000, 10_000, 800_000)
_PROFILE: Final = 0xFFFF
_LAST_NODE_ID: Final = 127


@dataclass(frozen=True, slots=True)
class Imported:
    """A starting spec.

    Args:
        eds: What it was made from.
        text: YAML.
        problems: What is odd about the EDS or was left out, by line.
    """

    eds: EdsFile
    text: str
    problems: tuple[Problem, ...]


def import_eds(path: Path) -> Imported:
    """Return a starting spec made from an EDS or DCF file.

    Raises:
        SpecError: The file cannot be read or describes no object.
    """
    eds = read_eds(path)
    draft = Draft(eds)
    draft.data = _head(draft)
    draft_objects(draft)
    mend(draft)
    body = yaml_text(draft.data, draft.comments).rstrip()
    text = "\n".join((*_title(eds), body, *_rest(eds))).rstrip() + "\n"
    size = len(text.encode())
    if size > MOST_BYTES:
        wanted = f"expected an EDS whose spec has at most {MOST_BYTES // 10**6} MB"
        raise SpecError(Problem(path, 0, "", f"{wanted}, got {size / 10**6:.1f} MB"))
    problems = sorted(
        dict.fromkeys((*eds.problems, *draft.problems)), key=lambda problem: problem.line
    )
    return Imported(eds, text, tuple(problems))


def _head(draft: Draft) -> dict[str, Any]:
    eds = draft.eds
    device: dict[str, Any] = {
        "vendor": eds.text(_DEVICE_INFO, "VendorName") or "Unknown",
        "name": eds.text(_DEVICE_INFO, "ProductName") or eds.ini.path.stem,
    }
    kind = eds.entries.get((0x1000, 0))
    if kind is not None and isinstance(kind.default, int) and kind.default & _PROFILE:
        device["profile"] = kind.default & _PROFILE
    manual: dict[str, Any] = {"title": f"EDS {eds.name}"}
    version = (eds.text("FileInfo", "FileVersion"), eds.text("FileInfo", "FileRevision"))
    if any(version):
        manual["revision"] = ".".join(part for part in version if part)
    issued = _date(eds)
    if issued is not None:
        manual["date"] = issued.isoformat()
    return {
        "format": 1,
        "device": device,
        "manual": manual,
        "factory": _factory(draft),
        "variants": {VARIANT: {"title": device["name"], "source": _DEVICE_INFO}},
    }


def _date(eds: EdsFile) -> date | None:
    texts = (eds.text("FileInfo", key) for key in ("ModificationDate", "CreationDate"))
    for text in texts:
        for form in _DATES:
            try:
                return datetime.strptime(text, form).date()  # noqa: DTZ007 - a day, no time
            except ValueError:
                continue
    return None


def _factory(draft: Draft) -> dict[str, Any]:
    eds = draft.eds
    section = next((name for name in _COMMISSIONING if eds.ini.section(name)), _DEVICE_INFO)
    node_id = device_figure(eds, "NodeID", section)
    bitrate = 1000 * (device_figure(eds, "Baudrate", section) or 0)
    rates = [rate for rate in _USUAL if device_figure(eds, f"BaudRate_{rate // 1000}")]
    guessed = []
    if node_id is None or not 1 <= node_id <= _LAST_NODE_ID:
        node_id = 1
        guessed.append("node-ID")
    if bitrate not in BITRATES:
        bitrate = rates[0] if rates else _USUAL[0]
        guessed += ["bit rate"] if len(rates) != 1 else []
    if guessed:
        text = f"the EDS does not say with which {' and '.join(guessed)} the device is delivered"
        draft.comments["factory",].append(text)
    return {"node_id": node_id, "bitrate": bitrate, "source": section}


def _title(eds: EdsFile) -> list[str]:
    lines = (
        f"{eds.name}, imported.",
        "",
        "An EDS says less than a manual. Services are those that the objects let expect, kinds are",
        "deduced from index and access; ranges within limits, enumerations, units, what is stored",
        "and ambiguities are for you to enter. `source` is the line in the EDS. A comment that begins",
        "with a line number is what the EDS says there and a spec has no place for.",
    )
    return [comment(line) for line in lines]


def _rest(eds: EdsFile) -> list[str]:
    """Return what describes no object, as comments."""
    result = [""]
    for item in eds.objects.values():
        if not item.entries:
            result += [comment(f"line {item.line}: [{item.index:04X}] {item.name}")]
            result += [comment(f"line {line.number}: {line}") for line in item.left]
    for section in eds.rest:
        lines = [line for line in section.lines if line.value and not is_frame(line.value)]
        if lines:
            result += [comment(f"line {section.line}: [{section.name}]")] if section.name else []
            result += [comment(f"line {line.number}: {line}") for line in lines]
    return result
