"""Known recordings in parts: the files of a folder or a ZIP archive, in order, lost, twice or swapped."""

import zipfile

import numpy as np
from known_recordings import Expected

CHOICES = {
    "suffix": (".zip", ""), "parts": (3, 2, 11), "names": ("run{}", "run {:03d}", "{}", "part_{}_of_11", "b{}"),
    "times": ("absolute", "none", "from zero"),
    "spoilt": ("none", "lost", "twice", "swapped", "other rate", "other names"),
    "other": ("none", "readme", "hidden"), "unit": ("brackets", "none"),
}  # fmt: skip


def part_files(path, known, random, **how):
    """Write the parts as tables; where they state no times, an option states that they follow each other."""
    pieces = np.array_split(known.samples, how["parts"], axis=1)
    begins = np.cumsum([0, *(piece.shape[1] for piece in pieces)])[:-1] / known.rate
    files = {}
    for i, (piece, begin) in enumerate(zip(pieces, begins, strict=True)):
        rate = known.rate * 2 if how["spoilt"] == "other rate" and i == 1 else known.rate
        t = np.arange(piece.shape[1]) / rate + (begin if how["times"] == "absolute" else 0.0)
        names = [f"b{k}" for k in range(len(known.names))] if how["spoilt"] == "other names" and i == 1 else known.names
        files[how["names"].format(i + 1) + ".csv"] = _table(t, piece, names, known.units, how)
    names = list(files)
    match how["spoilt"]:
        case "lost" if how["parts"] > 2 and how["times"] == "absolute":
            del files[names[1]]
        case "twice":
            files[names[-1].replace(".csv", " copy.csv")] = files[names[0]]
        case "swapped" if how["times"] == "absolute":
            files[names[0]], files[names[1]] = files[names[1]], files[names[0]]
    others = {"none": {}, "readme": {"README.md": "Notes on the run"}, "hidden": {".DS_Store": "\x00\x01"}}
    _store(path, files | others[how["other"]], random)
    options = {} if how["times"] == "absolute" else {"parts": "contiguous"}
    if how["times"] == "none":
        options["sampling_rate"] = known.rate
    return Expected(
        names=known.names, units=known.units if how["unit"] == "brackets" else ("",) * len(known.units),
        samples=tuple(known.samples), rate=known.rate, options=options,
    )  # fmt: skip


def _table(t, samples, names, units, how):
    labels = [
        f"{name} [{unit}]" if how["unit"] == "brackets" else name for name, unit in zip(names, units, strict=True)
    ]
    columns = list(samples)
    if how["times"] != "none":
        labels, columns = ["time [s]", *labels], [t, *columns]
    rows = [",".join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([",".join(labels), *rows]) + "\n"


def _store(path, files, random):
    """Store the files in an order that is not that of their names."""
    names = [list(files)[int(i)] for i in random.permutation(len(files))]
    if path.suffix == ".zip":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name in names:
                archive.writestr(name, files[name])
    else:
        path.mkdir()
        for name in names:
            (path / name).write_text(files[name], encoding="utf-8")
