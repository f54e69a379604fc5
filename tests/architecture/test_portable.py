"""Architecture: the package uses no module, function or option that only POSIX systems have."""

import ast
from pathlib import Path

import pytest

import sigdb

ROOT = Path(sigdb.__file__).parent
MODULES = {"crypt", "curses", "fcntl", "grp", "nis", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}
"""Modules of the standard library that are not available on Windows."""

OF_OS = {
    *("chown", "chroot", "ctermid", "fchmod", "fchown", "fdatasync", "fork", "forkpty", "getegid", "geteuid", "getgid"),
    *("getgroups", "getloadavg", "getpgid", "getpgrp", "getpriority", "getuid", "killpg", "lchown", "lockf", "mkfifo"),
    *("mknod", "nice", "openpty", "posix_fadvise", "posix_fallocate", "posix_spawn", "pread", "preadv", "pwrite"),
    *(
        "pwritev",
        "register_at_fork",
        "sched_getaffinity",
        "sched_setaffinity",
        "sendfile",
        "setgid",
        "setpgid",
        "setsid",
    ),
    *("setuid", "statvfs", "sync", "sysconf", "uname", "wait", "wait3", "wait4", "waitid", "O_DIRECTORY", "O_NOFOLLOW"),
    *("O_CLOEXEC", "O_DSYNC", "O_NONBLOCK", "O_SYNC", "O_TMPFILE"),
}
OF_SIGNAL = {
    *("SIGALRM", "SIGCHLD", "SIGCONT", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGPROF", "SIGQUIT", "SIGSTOP", "SIGTSTP"),
    *("SIGUSR1", "SIGUSR2", "SIGVTALRM", "alarm", "getitimer", "pause", "pthread_kill", "pthread_sigmask", "setitimer"),
    *("siginterrupt", "sigpending", "sigwait", "sigwaitinfo", "sigtimedwait"),
}
OF_TIME = {"tzset", "clock_gettime", "clock_getres", "pthread_getcpuclockid"}
NAMES = {"os": OF_OS, "signal": OF_SIGNAL, "time": OF_TIME, "socket": {"AF_UNIX", "socketpair"}}
"""Names of modules that are not available on Windows."""

OPTIONS = {"preexec_fn", "start_new_session", "process_group", "pass_fds", "prot"}
"""Options of ``subprocess.Popen`` and of ``mmap`` that are not available on Windows."""


def _faults(source):
    """Lines and names that need a POSIX system."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names if alias.name.split(".")[0] in MODULES)
        elif isinstance(node, ast.ImportFrom):
            only = NAMES.get(node.module or "", set())
            yield from (
                (node.lineno, alias.name) for alias in node.names if alias.name in only or node.module in MODULES
            )
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in NAMES.get(node.value.id, set()):
                yield node.lineno, f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Call):
            yield from ((node.lineno, word.arg) for word in node.keywords if word.arg in OPTIONS)
            if isinstance(node.func, ast.Attribute) and node.func.attr == "get_context":
                yield from (
                    (node.lineno, "fork") for given in node.args if ast.unparse(given) in ("'fork'", "'forkserver'")
                )


def test_the_package_needs_no_posix_system():
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in sorted(ROOT.rglob("*.py"))
        for line, name in _faults(path.read_text(encoding="utf-8"))
    ]
    assert found == []


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("import fcntl", "fcntl"),
        ("from resource import getrusage", "getrusage"),
        ("from signal import SIGKILL", "SIGKILL"),
        ("import os\nos.killpg(1, 9)", "os.killpg"),
        ("mmap(0, 1, prot=1)", "prot"),
        ("multiprocessing.get_context('fork')", "fork"),
    ],
)
def test_such_a_name_is_found(source, name):
    assert [found for _, found in _faults(source)] == [name]
