"""Mutations of nested tables, as TOML and JSON hold them, and their text."""

import datetime

import tomli_w

ABSURD = (
    True, False, 0, 1, -1, 2, 2**31, 2**63 - 1, -(2**63), 10**30, 0.0, -0.0, 0.5, 1e-300, 1e300, float("inf"),
    float("-inf"), float("nan"), "", " ", "all", "nan", "1/0", "x" * 5000, "\x1b[31mred", "a\nb", "\x00", "../../etc",
    "/dev/zero", "é" * 40, "1 mm", "5 kg", "1e400 m", "-3 rpm", [], [[]], [1, 2], [0.1] * 500, ["a"] * 300, [1, "a"],
    {}, {"a": 1}, {"": ""}, {"min": 0, "max": 1}, {"min": 1, "max": 0}, {"min": 0.0, "max": 1e12, "step": 1e-12},
    {"\x1b[2J": 1}, {"a": {"b": {"c": {}}}}, datetime.date(2024, 1, 2), datetime.time(1, 2),
)  # fmt: skip


def places(tree, path=()):
    """Yield the path of every value in a tree of tables and lists."""
    pairs = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in pairs:
        yield (*path, key)
        yield from places(value, (*path, key))


def mutated(tree, random, words=()):
    """Change a tree in one to three places, and return what was done.

    Parameters
    ----------
    tree
        Tables and lists; it is changed.
    random
        Generator.
    words
        Texts that may stand in the place of another: names, conditions, units.
    """
    done = []
    for _ in range(int(random.choice([1, 1, 1, 2, 3]))):
        paths = list(places(tree))
        if not paths:
            break
        path = paths[int(random.integers(len(paths)))]
        holder = tree
        for key in path[:-1]:
            holder = holder[key]
        kind = ("absurd", "absurd", "scaled", "lost", "renamed", "other", "word", "wrapped")[int(random.integers(8))]
        done.append(f"{kind} {'.'.join(map(str, path))[:100]}")
        _change(holder, path[-1], kind, tree, paths, random, words)
    return done


def _change(holder, key, kind, tree, paths, random, words):
    value = holder[key]
    match kind:
        case "lost":
            del holder[key]
        case "renamed" if isinstance(holder, dict):
            names = [*holder, *words, f"{key}s", "x", "\x1b[1m", "é", ""]
            holder[names[int(random.integers(len(names)))]] = holder.pop(key)
        case "scaled" if isinstance(value, int | float):
            factor = (0, -1, 1e-3, 1e3, 1e9, 1e-9, 1.0000001)[int(random.integers(7))]
            holder[key] = int(value * factor) if isinstance(value, int) and random.random() < 0.7 else value * factor
        case "other":
            other = tree
            for step in paths[int(random.integers(len(paths)))]:
                other = other[step]
            holder[key] = other if not isinstance(other, dict | list) else copied(other)
        case "word" if words:
            holder[key] = words[int(random.integers(len(words)))]
        case "wrapped":
            holder[key] = [value] if random.random() < 0.5 else {"value": value}
        case _:
            absurd = ABSURD[int(random.integers(len(ABSURD)))]
            holder[key] = copied(absurd) if isinstance(absurd, dict | list) else absurd


def copied(tree):
    """Return tables and lists of their own."""
    if isinstance(tree, dict):
        return {key: copied(value) for key, value in tree.items()}
    return [copied(value) for value in tree] if isinstance(tree, list) else tree


def toml_bytes(tree):
    """Return a tree as TOML."""
    return tomli_w.dumps(tree).encode("utf-8", "surrogatepass")
