"""Faults as data: files that say what a defect stands for, and changes given on the command line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from conformance.errors import Problem, SpecError
from conformance.resources import find
from conformance.simulator.faults import Faults
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import YamlFile, read_yaml, shown

FOLDER = "fixtures/faults"
OPTION = "--fault"
CHANGEABLE = ("objects/", "services/", "behaviours/")
"""How a path in a device spec begins that a fault may change."""


class FaultFile(BaseModel):
    """A fault file: what it stands for, the requirements that see it, and the knobs it turns."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    format: Literal[1]
    what: Annotated[str, Field(min_length=1)]
    seen_by: list[Annotated[str, Field(min_length=1)]] = []
    inject: Faults


def read_fault(name_or_path: str) -> FaultFile:
    """Return a fault file.

    Raises:
        SpecError: The file is missing or wrong.
    """
    return _read(read_yaml(find(FOLDER, name_or_path, OPTION)))


def load_faults(faults: Sequence[str]) -> Faults:
    """Return several faults together.

    Args:
        faults: Names or paths of fault files; ``PATH=VALUE`` changes a figure of the device's spec.

    Raises:
        SpecError: A fault is missing or wrong, or two turn one knob to different values.
    """
    combined: dict[str, Any] = {}
    changes: dict[str, Any] = {}
    turned_by: dict[str, str] = {}
    for fault in faults:
        for knob, value, place in _turned(fault):
            known = changes if knob.startswith(CHANGEABLE) else combined
            if known.setdefault(knob, value) != value:
                text = f"expected {known[knob]!r} as in {turned_by[knob]}, got {value!r}"
                raise SpecError(
                    place.problem(("inject", knob), text) if place else f"{knob}: {text}"
                )
            turned_by.setdefault(knob, place.path.name if place else fault)
    return Faults(**combined, changes=changes)


def _turned(fault: str) -> Iterator[tuple[str, Any, YamlFile | None]]:
    """Return the knobs a fault turns, the paths it changes, and the file that says so."""
    path, equals, text = fault.partition("=")
    if equals and path.startswith(CHANGEABLE):
        yield path, _value(fault, text), None
        return
    yaml = read_yaml(find(FOLDER, fault, OPTION))
    faults = _read(yaml).inject
    for knob in faults.model_fields_set - {"changes"}:
        yield knob, getattr(faults, knob), yaml
    for path, value in faults.changes.items():
        yield path, value, yaml


def _value(fault: str, text: str) -> Any:
    try:
        return YAML(typ="safe", pure=True).load(text)
    except YAMLError:
        raise SpecError(f"{OPTION}: expected PATH=VALUE, got {shown(fault)}") from None


def _read(yaml: YamlFile) -> FaultFile:
    file, problems = validate(FaultFile, yaml)
    problems = [*yaml.problems, *problems, *_paths(yaml, file)]
    if file is None or problems:
        raise SpecError(*problems)
    return file


def _paths(yaml: YamlFile, file: FaultFile | None) -> Iterator[Problem]:
    for path in file.inject.changes if file else ():
        if not path.startswith(CHANGEABLE):
            text = f"expected a path such as objects/0x1017/default, got {path!r}"
            yield yaml.problem(("inject", "changes", path), text)
