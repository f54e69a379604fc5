"""Unit: a receipt that was edited and sealed again, or copied under another number, is an error with its remedy."""

import shutil

import pytest

import sigdb
from sigdb.core import CorruptionError
from sigdb.database.store.seal import sealed_json, unsealed
from sigdb.sweep import repair, verify

RECEIPT = "receipts/rows-00000.json"


def edited(folder, change):
    path = folder / RECEIPT
    content = unsealed(path.read_bytes(), name=str(path))
    change(content)
    path.write_bytes(sealed_json(content))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda content: content.update(files=[]), "its files are not features/part-00000.parquet and signals"),
        (lambda content: content.update(files=content["files"][:1]), "its files are not"),
        (lambda content: content.update(files=content["files"][::-1]), "its files are not"),
        (lambda content: content["files"][0].update(path="../elsewhere"), "its files are not"),
        (lambda content: content["files"][0].update(blocks="no base64!"), "checksums of the blocks of features"),
        (lambda content: content["files"][1].update(blocks=""), "checksums of the blocks of signals"),
        (lambda content: content["files"][1].update(blocks="AAAAAAA="), "checksums of the blocks of signals"),
        (lambda content: content["files"][0].update(bytes=-1), "checksums of the blocks of features"),
        (lambda content: content.update(files=None), "is not a receipt; "),
        (lambda content: content.update(files=[1, 2]), "is not a receipt; "),
        (lambda content: content.update(rows="many"), "is not a receipt; "),
        (lambda content: content.update(rows=0), "it has 0 rows"),
        (lambda content: content.pop("plan"), "is not a receipt; "),
    ],
)
def test_a_receipt_that_was_sealed_again_is_not_taken(copy, change, says):
    edited(copy, change)
    with pytest.raises(CorruptionError, match=says) as error:
        sigdb.open(copy)
    assert str(error.value).endswith(f"make it again with: sigdb verify {copy} --repair")
    (finding,) = verify(copy)
    assert (finding.kind, finding.file, finding.key) == ("damage", RECEIPT, ("rows", 0))


def test_a_copy_of_a_receipt_under_a_new_number_is_foreign_and_does_no_harm(copy):
    shutil.copy(copy / RECEIPT, copy / "receipts" / "rows-00007.json")
    database = sigdb.open(copy)
    assert len(database) == database.manifest.rows
    (finding,) = verify(copy)
    assert (finding.kind, finding.file) == ("foreign", "receipts/rows-00007.json")
    assert repair(copy, jobs=1).left == (finding,)


def test_a_copy_of_a_receipt_in_the_place_of_another_is_damage(parts_copy):
    shutil.copy(parts_copy / RECEIPT, parts_copy / "receipts" / "rows-00001.json")
    with pytest.raises(CorruptionError, match=r"rows-00001\.json is a copy of receipts/rows-00000\.json; move it away"):
        sigdb.open(parts_copy)
