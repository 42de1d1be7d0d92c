"""A service that some variants offer, and the others do not; one that needs another."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from conformance.catalogue import build
from conformance.spec.load import SpecFile
from conformance.spec.statements import load_statements, statements_of

Edited: TypeAlias = Callable[..., str]
Loaded: TypeAlias = Callable[[str], SpecFile]

EMCY = (
    "    register_bits: {0: Any error}\n",
    "    register_bits: {0: Any error}\n    variants: [two]\n",
)
OBJECT = ("  0x1014: {name: COB-ID EMCY,", "  0x1014: {variants: [two], name: COB-ID EMCY,")


def test_a_service_is_that_of_its_variants_only(edited: Edited, loaded: Loaded) -> None:
    file = loaded(edited(EMCY, OBJECT))

    one, two = (file.resolve(variant).services for variant in file.variants)

    assert one.emcy_producer is None
    assert two.emcy_producer is not None
    assert one.tpdo is not None


def test_a_service_needs_its_objects_in_its_variants(complains: Callable[..., None]) -> None:
    complains(
        [
            EMCY,
            ("  0x1014: {name: COB-ID EMCY,", "  0x1014: {variants: [one], name: COB-ID EMCY,"),
            ("    object: 0x1014\n", "    object: 0x1014  #1\n"),
        ],
        "L1: services.emcy_producer.object: expected a documented object, got 1014h",
    )


def test_a_service_names_variants_of_the_file(complains: Callable[..., None]) -> None:
    complains(
        (EMCY[0], f"{EMCY[0]}    variants: [three]  #1\n"),
        "L1: services.emcy_producer.variants: expected a variant of this file (one, two), got 'three'",
    )


def test_another_reading_has_the_service_in_its_variants(edited: Edited, loaded: Loaded) -> None:
    change = "objects/0x2000/default: 2"
    also = f"{change}, services/emcy_producer/variants: [one, two]"
    file = loaded(edited(EMCY, (change, also)))

    spec = file.resolve("one")

    assert [other.emcy_producer is None for other, _ in spec.services_readings] == [True, False]


def test_the_catalogue_misses_no_statement_on_a_service_that_is_not_there(
    edited: Edited, loaded: Loaded
) -> None:
    file = loaded(edited(EMCY, OBJECT))
    statements_of(file.yaml.path).write_text(
        f"format: 1\ndevice: {file.name}\nstatements:\n"
        "  - {id: S-001, source: '1', says: It is red., because: a bus shows no colour}\n",
        encoding="utf-8",
    )
    statements = load_statements(file)

    unstated = {v: set(build(file, v, statements)["unstated"]) for v in file.variants}

    assert "services/emcy_producer/codes" in unstated["two"]
    assert not [path for path in unstated["one"] if path.startswith("services/emcy")]


def test_a_node_id_waits_for_no_store_that_is_not_there(complains: Callable[..., None]) -> None:
    store = """\
  store:
    object: 0x1010
    signature: save
    groups: {1: [[0x1000, 0x9FFF]]}
    source: "2"
"""
    sentence = "expected a moment without a store, as there is no such service"
    complains(
        (store, '  node_id: {object: 0x2000, effective: after-store-and-reset, source: "2"}  #1\n'),
        f"L1: services.node_id.effective: {sentence}, got after-store-and-reset",
    )
