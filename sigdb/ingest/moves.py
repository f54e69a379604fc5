"""Moves of recordings: files at other places that have the SHA-256 of ingested ones that are gone from theirs."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sigdb.database import CheckedParquet, Store, read_receipts, sealed_json
from sigdb.ingest.facts.recording_files import FoundFiles
from sigdb.ingest.plan import MOVES_FILE, IngestPlan, read_moves
from sigdb.ingest.recorded_rows import sha256_of


def find_moves(store: Store, plans: Sequence[IngestPlan], files: FoundFiles) -> dict[str, str]:
    """Return the new path of each ingested recording that is gone from its place, by its path until now."""
    sizes: dict[int, list[Path]] = {}
    for path in files.new_paths:
        if path.is_file():  # not a link to nothing
            sizes.setdefault(path.stat().st_size, []).append(path)
    present = files.ingested_paths
    gone = {
        (part, each.name): each
        for plan in (plans if sizes else ())
        for part in plan.row_part_numbers
        for each in plan.recordings_of(part)
        if each.bytes in sizes and each.path not in present and not Path(each.path).exists()
    }
    if not gone:
        return {}
    by_digest: dict[str, list[str]] = {}
    parts = {part for part, _ in gone}
    for receipt in read_receipts(store, "rows", {plan.hash for plan in plans}):
        if receipt.part not in parts:
            continue
        rows = CheckedParquet(store, receipt.file("features")).read(columns=["recording", "sha256"])
        for name, digest in dict(zip(rows["recording"].to_pylist(), rows["sha256"].to_pylist(), strict=True)).items():
            if digest and (receipt.part, name) in gone:
                by_digest.setdefault(digest, []).append(gone[receipt.part, name].path)
    moves: dict[str, str] = {}
    for size in {each.bytes for each in gone.values()}:
        for path in sizes[size]:
            if old := by_digest.get(sha256_of(path) or ""):
                moves[old.pop(0)] = str(path)
    return moves


def follow_moves(store: Store, plans: Sequence[IngestPlan], moves: dict[str, str]) -> list[IngestPlan]:
    """Enter moves into a database, and return its plans with the new paths. The caller owns the place."""
    if not moves:
        return list(plans)
    before = read_moves(store)
    after = {first: moves.get(now, now) for first, now in before.items()}
    after |= {now: new for now, new in moves.items() if now not in before.values()}
    store.put(MOVES_FILE, sealed_json({"moves": {first: now for first, now in after.items() if first != now}}))
    return [replace(plan, recordings=tuple(each.at(moves) for each in plan.recordings)) for plan in plans]
