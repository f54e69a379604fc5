"""Damages of files: of any bytes, and of the lines of a text. What they do to the numbers is not known."""

import gzip


def bytes_changed(data, random):
    data = bytearray(data)
    for _ in range(int(random.integers(1, 9))):
        data[int(random.integers(len(data)))] = int(random.integers(256))
    return data


def bit_flipped(data, random):
    data = bytearray(data)
    data[int(random.integers(len(data)))] ^= 1 << int(random.integers(8))
    return data


def header_changed(data, random):
    """Mostly lengths, kinds and counts are there."""
    data = bytearray(data)
    for _ in range(int(random.integers(1, 5))):
        at = int(random.integers(min(len(data), 600)))
        data[at] = int(random.choice([0, 1, 0x7F, 0x80, 0xFF, int(random.integers(256))]))
    return data


def word_changed(data, random):
    """A length or a count of four or eight bytes is made huge, negative or zero."""
    data = bytearray(data)
    at = int(random.integers(max(1, len(data) - 8)))
    words = [b"\xff" * 4, b"\xff\xff\xff\x7f", b"\0" * 4, b"\xff" * 8, b"\0\0\0\x80", b"\xff" * 7 + b"\x7f",
             b"\0\0\0\x40", b"\x40\0\0\0", b"\0" * 6 + b"\xf0\x7f", b"\0" * 6 + b"\xf8\x7f"]  # fmt: skip
    word = words[int(random.integers(len(words)))]
    at = min(at, 400) if random.random() < 0.5 else at
    data[at : at + len(word)] = word
    return data


def cut(data, random):
    return data[: int(random.integers(len(data)))]


def part_again(data, random):
    first, last = sorted(int(i) for i in random.integers(len(data), size=2))
    return data[:last] + data[first:]


def part_lost(data, random):
    first, last = sorted(int(i) for i in random.integers(len(data), size=2))
    return data[:first] + data[last:]


def parts_swapped(data, random):
    a, b, c = sorted(int(i) for i in random.integers(len(data), size=3))
    return data[:a] + data[b:c] + data[a:b] + data[c:]


def garbage_after(data, random):
    at = int(random.integers(min(len(data), 200)))
    return data[:at] + random.bytes(int(random.integers(1, 3000)))


def twice(data, random):
    return data + data


def as_text(data, random):
    """As a mail program does to a binary file: line ends and non-ASCII bytes change."""
    return data.replace(b"\n", b"\r\n").replace(b"\xff", b"?")


def packed(data, random):
    return gzip.compress(data)


BYTES = (
    bytes_changed, bit_flipped, header_changed, header_changed, word_changed, word_changed, cut, part_again, part_lost,
    parts_swapped, garbage_after, twice, as_text, packed,
)  # fmt: skip

FIELDS = (
    "1e999", "-1e999", "1e-999", "9" * 70, "0x1F", "1_000", "1.000.000,5", "1,000,000.5", "inf", "-inf", "nan", "∞",
    "١٢٣", "--", "=1/0", "#DIV/0!", "\x1b[31m1\x1b[0m", "1e308", "1d5", "5.", ".5", "+", "1e", "true", "-0", "\x00",
    "\u2028", "1 2", "'1", '"', '""', '"1', "0.1.2", "12:61:99", "2024-13-45", "1e5000", "\ufeff", "x" * 3000, "",
    "1;2", "1,2", "\t",
)  # fmt: skip


def field_replaced(text, random):
    """Fields of a table become something else."""
    lines = text.split("\n")
    for _ in range(int(random.integers(1, 4))):
        i = int(random.integers(len(lines)))
        sign = next((sign for sign in ";\t, " if sign in lines[i]), ",")
        fields = lines[i].split(sign)
        fields[int(random.integers(len(fields)))] = FIELDS[int(random.integers(len(FIELDS)))]
        lines[i] = sign.join(fields)
    return "\n".join(lines)


def lines_swapped(text, random):
    lines = text.split("\n")
    i, j = (int(k) for k in random.integers(len(lines), size=2))
    lines[i], lines[j] = lines[j], lines[i]
    return "\n".join(lines)


def lines_lost(text, random):
    lines = text.split("\n")
    i, j = sorted(int(k) for k in random.integers(len(lines), size=2))
    return "\n".join(lines[:i] + lines[j:])


def lines_again(text, random):
    lines = text.split("\n")
    i, j = sorted(int(k) for k in random.integers(len(lines), size=2))
    return "\n".join(lines[:j] + lines[i:])


def lines_shuffled(text, random):
    lines = text.split("\n")
    return "\n".join(lines[int(i)] for i in random.permutation(len(lines)))


def sign_replaced(text, random):
    """One sign becomes another everywhere, or in a part."""
    signs = ",;.\t :-/\"'#%\n\reE+0"
    old, new = (signs[int(i)] for i in random.integers(len(signs), size=2))
    count = -1 if random.random() < 0.5 else int(random.integers(1, 50))
    return text.replace(old, new, count)


def columns_lost(text, random):
    at = int(random.integers(0, 4))
    lines = text.split("\n")
    sign = next((sign for sign in ";\t," if sign in lines[-2 if len(lines) > 1 else 0]), ",")
    return "\n".join(sign.join(field for i, field in enumerate(line.split(sign)) if i != at) for line in lines)


def lines_turned(text, random):
    """Rows become columns."""
    lines = [line.split(",") for line in text.split("\n") if line]
    width = min(len(line) for line in lines) if lines else 0
    return "\n".join(",".join(line[i] for line in lines) for i in range(width))


def one_line(text, random):
    return text.replace("\n", "," if random.random() < 0.5 else " ")


def many_columns(text, random):
    return "\n".join((line + ",") * int(random.choice([40, 600])) for line in text.split("\n")[:40])


def long_header(text, random):
    return "#" * 70_000 + "\n" + text


def control_signs(text, random):
    at = int(random.integers(len(text)))
    return text[:at] + "".join(chr(int(i)) for i in random.integers(1, 32, size=5)) + text[at:]


TEXT = (
    field_replaced, field_replaced, field_replaced, lines_swapped, lines_lost, lines_again, lines_shuffled,
    sign_replaced, sign_replaced, columns_lost, lines_turned, one_line, many_columns, long_header, control_signs,
)  # fmt: skip


def damaged(data, random, *, text):
    """The bytes of a file after one or two damages, and their names."""
    names = []
    for _ in range(1 if random.random() < 0.7 else 2):
        if not data:
            break
        kinds = TEXT if text and random.random() < 0.7 else BYTES
        damage = kinds[int(random.integers(len(kinds)))]
        names.append(damage.__name__)
        if damage in TEXT:
            data = damage(data.decode("utf-8", "replace"), random).encode("utf-8", "replace")
        else:
            data = bytes(damage(data, random))
    return data, " ".join(names)
