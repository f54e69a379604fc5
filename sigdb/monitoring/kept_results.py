"""Results of a history that hold as long as the same looks are healthy, kept in the user's cache."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa

from sigdb.core import InputError
from sigdb.monitoring.kept_table import keep_table, kept_place, kept_table, list_column
from sigdb.monitoring.look_results import LookResults
from sigdb.monitoring.looks import Look

T = TypeVar("T")


@dataclass(kw_only=True, eq=False)
class KeptResults:
    """Results against the same healthy looks.

    Attributes
    ----------
    keys, results
        Keys of looks, and their numbers; None without one.
    others
        Other results by name, each with a text that says what it was computed from.
    changed
        Whether something was added.
    place
        Their file; None where they are not kept.
    """

    keys: list[str] = field(default_factory=list)
    results: LookResults | None = None
    others: dict[str, list[Any]] = field(default_factory=dict)
    changed: bool = False
    place: Path | None = None
    _of_others: list["KeptResults"] = field(default_factory=list)

    @classmethod
    def read(cls, place: Path) -> "KeptResults":
        """Return the results in a file; none where it does not exist or is not whole."""
        table, others = kept_table(place)
        if table is None:
            return cls(place=place)
        columns = {name: table[name].combine_chunks() for name in table.column_names if name != "key"}
        maps = columns.pop("tooth_map").flatten().to_numpy().reshape(table.num_rows, -1)
        numbers = {name: column.to_numpy() for name, column in columns.items()}
        results = LookResults(**numbers, tooth_map=maps)
        return cls(keys=table["key"].to_pylist(), results=results, others=others, place=place)

    def write(self) -> None:
        """Write what was added, also against other healthy looks, to the files."""
        if self.place is not None and self.results is not None and self.changed:
            arrays = dict(vars(self.results))
            arrays["tooth_map"] = list_column(arrays["tooth_map"])
            keep_table(self.place, pa.table({"key": self.keys, **arrays}), self.others)
        for each in self._of_others:
            each.write()

    def against(self, healthy: Sequence[Look]) -> "KeptResults":
        """Return the results against other healthy looks."""
        keys = [look.key for look in healthy]
        results = KeptResults() if self.place is None else KeptResults.read(kept_place("looks", self.place.name, keys))
        self._of_others.append(results)
        return results

    def of(
        self, looks: Sequence[Look], compute: Callable[[Look], LookResults]
    ) -> tuple[list[int], LookResults | None, dict[int, InputError]]:
        """Return the numbers of the looks that can be compared, their results, and why the others cannot."""
        before = set(self.keys)
        added: list[LookResults] = []
        errors: dict[int, InputError] = {}
        for number, look in enumerate(looks):
            if look.key in before:
                continue
            try:
                added.append(compute(look))
                self.keys.append(look.key)
            except InputError as error:
                errors[number] = error
        if added:
            self.results = LookResults.joined([*([] if self.results is None else [self.results]), *added])
            self.changed = True
        if self.results is None:
            return [], None, errors
        used = [number for number in range(len(looks)) if number not in errors]
        at = {key: row for row, key in enumerate(self.keys)}
        return used, self.results.take([at[looks[number].key] for number in used]), errors

    def once(self, name: str, source: str, compute: Callable[[], T]) -> T:
        """Return a result, computed unless it was kept and was computed from the same."""
        kept = self.others.get(name)
        if kept is None or kept[0] != source:
            self.others[name] = kept = [source, compute()]
            self.changed = True
        result: T = kept[1]
        return result
