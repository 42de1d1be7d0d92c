"""What must hold in a spec file whatever the variant: names of variants, ids, sources."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.spec.document import Ambiguity, EntryDoc, RecordDoc, SpecDocument
from conformance.spec.fields import of_variant, shape
from conformance.spec.resolve import Report
from conformance.spec.yaml_reader import Path_, shown


def lint_objects(indices: Iterable[int], document: SpecDocument, report: Report) -> None:
    """Report variants, affected objects and sources that some objects name and nobody has."""
    for index in indices:
        doc = document.objects[index]
        path = ("objects", index)
        if not isinstance(doc, RecordDoc):
            _lint_entry(doc, path, document, report)
            continue
        _lint_names(doc.variants or (), (*path, "variants"), document, report)
        for sub, entry in doc.subs.items():
            _lint_entry(entry, (*path, "subs", sub), document, report)


def _lint_entry(doc: EntryDoc, path: Path_, document: SpecDocument, report: Report) -> None:
    _lint_names(doc.variants or (), (*path, "variants"), document, report)
    for attribute in ("default", "ranges", "values", "follows"):
        value = getattr(doc, attribute)
        if shape(value) == "by_variant":
            for name in value:
                _lint_names((name,), (*path, attribute, name), document, report)
    for index in doc.affects:
        if index not in document.objects:
            report((*path, "affects"), f"expected a documented object, got {index:04X}h")
    for attribute in doc.sources:
        if attribute not in EntryDoc.model_fields:
            text = f"expected the name of an attribute, got {shown(attribute)}"
            report((*path, "sources", attribute), text)


def _lint_names(names: Iterable[str], path: Path_, document: SpecDocument, report: Report) -> None:
    for name in names:
        if name not in document.variants:
            known = ", ".join(document.variants)
            report(path, f"expected a variant of this file ({known}), got {shown(name)}")


def lint_causes(document: SpecDocument, report: Report) -> None:
    """Report limits of errors that are upside down, or those of a variant that nobody has."""
    emcy = document.services.emcy_producer
    for number, cause in enumerate(emcy.causes if emcy is not None else ()):
        path = ("services", "emcy_producer", "causes", number, "limits")
        by_variant = cause.limits if isinstance(cause.limits, dict) else {}
        _lint_names(by_variant, path, document, report)
        for name in document.variants:
            limits = of_variant(cause.limits, name)
            if limits is not None and limits[0] > limits[1]:
                place = (*path, name) if by_variant else path
                got = f"{limits[0]} to {limits[1]}"
                report(place, f"expected lowest and highest angle, got {got}")


def lint_service_variants(document: SpecDocument, report: Report) -> None:
    """Report variants that some services name and the file does not have."""
    for name, service in document.services:
        path = ("services", name, "variants")
        _lint_names(getattr(service, "variants", None) or (), path, document, report)


def lint_ambiguities(ambiguities: list[Ambiguity], report: Report) -> None:
    """Report ids used twice, and judged readings that are not listed."""
    seen: set[str] = set()
    for number, ambiguity in enumerate(ambiguities):
        path = ("ambiguities", number)
        if ambiguity.id in seen:
            report((*path, "id"), f"expected each id once, got {ambiguity.id} again")
        seen.add(ambiguity.id)
        most = len(ambiguity.readings)
        if isinstance(ambiguity.judged_by, int) and not 1 <= ambiguity.judged_by <= most:
            wanted = "'either' or 1" if most == 1 else f"'either' or 1 to {most}"
            report((*path, "judged_by"), f"expected {wanted}, got {ambiguity.judged_by}")
