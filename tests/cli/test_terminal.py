"""Unit: what a terminal shows, and what a pipe gets instead: whole lines without colours."""

import os
import pty
import struct
import subprocess
import sys
import termios
from fcntl import ioctl

MODES = (sys.executable, "-m", "sigdb", "modes", "nasa-spiral-bevel", "--count", "3")


def shown(command, *, columns, **environment):
    """What a command writes to a terminal of a width."""
    ours, theirs = pty.openpty()
    ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    names = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "NO_COLOR", "FORCE_COLOR")}
    with subprocess.Popen(command, stdout=theirs, env=names | {"TERM": "xterm"} | environment) as process:
        os.close(theirs)
        parts = []
        try:
            while part := os.read(ours, 65536):
                parts.append(part)
        except OSError:  # Linux: the other end is closed
            pass
        os.close(ours)
    assert process.returncode == 0
    return b"".join(parts).decode().replace("\r\n", "\n")


def test_a_terminal_gets_bold_headings_in_its_width():
    text = shown(MODES, columns=60)
    rule = next(line for line in text.splitlines() if "─" in line)
    head, body = text.split(rule)
    assert "\x1b[1m" in head
    assert set(rule) == {"─"}
    assert max(map(len, (rule, *body.splitlines()))) <= 60
    assert len(body.strip().splitlines()) > 3  # the last column is folded


def test_no_colour_is_shown_to_who_wants_none():
    assert "\x1b" not in shown(MODES, columns=200, NO_COLOR="1")


def test_a_pipe_gets_whole_lines_whatever_the_environment_says():
    environment = os.environ | {"COLUMNS": "20", "FORCE_COLOR": "1"}
    lines = subprocess.run(MODES, capture_output=True, text=True, check=True, env=environment).stdout.splitlines()
    assert len(lines) == 4
    assert "\x1b" not in "".join(lines)
    assert lines[1].endswith("gear-shaft torsion 14%")
