"""The content of an EDS or DCF file (CiA 306-1): what each object is said to be, and on which line."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from conformance.errors import Problem
from conformance.spec.document import Access
from conformance.spec.eds.ini import IniFile, IniLine, IniSection
from conformance.spec.eds.values import EdsValue, Number
from conformance.spec.model import Key, address
from conformance.wire.datatypes import DataType

BITRATES = (10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
MANDATORY = (0x1000, 0x1001, 0x1018)
MANUFACTURER = range(0x2000, 0x6000)
LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
VAR, ARRAY, RECORD, DOMAIN = 7, 8, 9, 2


def list_of(index: int) -> str:
    """Return the section that lists an object."""
    if index in MANDATORY:
        return LISTS[0]
    return LISTS[2] if index in MANUFACTURER else LISTS[1]


@dataclass(slots=True)
class EdsEntry:
    """One entry; None where the EDS says nothing, or nothing that can be understood.

    Args:
        index: 1000h..FFFFh.
        sub: 0..FFh.
        line: Of its section.
        low: Low limit.
        high: High limit.
        said: Attribute to the line that gives it, and nothing beyond it.
        left: Lines that no attribute holds.
    """

    index: int
    sub: int
    line: int
    name: str = ""
    type: DataType | None = None
    access: Access | None = None
    default: EdsValue | None = None
    low: Number | None = None
    high: Number | None = None
    mappable: bool | None = None
    unit: str | None = None
    said: dict[str, IniLine] = field(default_factory=dict)
    left: list[IniLine] = field(default_factory=list)

    @property
    def understood(self) -> bool:
        """Type and access are known."""
        return self.type is not None and self.access is not None

    def line_of(self, *attributes: str) -> int:
        """Return the line of the first of some attributes that the EDS gives, else the entry's."""
        found = (self.said[name].number for name in attributes if name in self.said)
        return next(found, self.line)


@dataclass(slots=True)
class EdsObject:
    """One object: an entry of sub-index 0, or a record or array with its entries.

    Args:
        left: Lines that neither the object nor its entries hold.
    """

    index: int
    line: int
    name: str
    in_record: bool
    entries: dict[int, EdsEntry] = field(default_factory=dict)
    left: list[IniLine] = field(default_factory=list)

    def address(self, sub: int) -> str:
        """Return the address of an entry as printed."""
        return address(self.index, sub if self.in_record else None)


@dataclass(slots=True)
class EdsFile:
    """An EDS or DCF file.

    Args:
        ini: The file itself.
        objects: By index, ascending.
        rest: Sections that describe no object.
    """

    ini: IniFile
    objects: dict[int, EdsObject] = field(default_factory=dict)
    rest: list[IniSection] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The file's name."""
        return self.ini.path.name

    @property
    def problems(self) -> list[Problem]:
        """What a tidy file would not have, by line."""
        return sorted(dict.fromkeys(self.ini.problems), key=lambda problem: problem.line)

    @property
    def sha256(self) -> str:
        """Hash of the file."""
        return hashlib.sha256(self.ini.text).hexdigest()

    @property
    def entries(self) -> Mapping[Key, EdsEntry]:
        """Every entry, ascending."""
        return {
            (index, sub): entry
            for index, item in self.objects.items()
            for sub, entry in item.entries.items()
        }

    def text(self, section: str, key: str) -> str:
        """Return a text of a section such as ``DeviceInfo``, empty when there is none."""
        found = self.ini.section(section)
        line = None if found is None else found.get(key)
        return "" if line is None else line.value
