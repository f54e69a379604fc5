"""Check a built wheel: only ``sigdb`` at top level, with its stubs and templates; it works away from the checkout.

Usage: python tests/checks/wheel.py DIST ENVIRONMENT
"""

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

TRY = """
import sigdb
from sigdb.transmission import built_in_transmissions
assert "site-packages" in sigdb.__file__, sigdb.__file__
assert "nasa-spiral-bevel" in built_in_transmissions()
response = sigdb.simulate(sigdb.load_transmission("nasa-spiral-bevel"), sigdb.Damage(tooth=6, stiffness_loss=0.25))
assert response.min_compression > 0
assert sigdb.load_model("nasa-location").target == "location"
from sigdb.report.page import page
assert "<h1>a &amp; b</h1>" in page("base.html", title="a & b")
"""


def main(dist: Path, environment: Path) -> None:
    (wheel,) = dist.glob("gear_signatures-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    top = {name.split("/")[0] for name in names}
    expected = {"sigdb", wheel.name.split("-py3")[0] + ".dist-info"}
    assert top == expected, f"top level of {wheel.name}: {sorted(top)}"
    source = Path(__file__).parents[2] / "sigdb"
    beside_code = {
        path.relative_to(source.parent).as_posix()
        for pattern in ("*.pyi", "py.typed", "templates/*")
        for path in source.rglob(pattern)
        if path.is_file()
    }
    assert len(beside_code) > 10, f"not the source: {source}"
    assert beside_code <= names, f"not in {wheel.name}: {sorted(beside_code - names)}"
    venv.create(environment, clear=True, with_pip=True)
    programs = environment / ("Scripts" if os.name == "nt" else "bin")
    python = programs / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--no-compile", wheel], check=True)
    subprocess.run([python, "-W", "error", "-c", TRY], check=True, cwd=environment)
    subprocess.run([programs / "sigdb", "modes", "nasa-spiral-bevel", "--count", "3"], check=True)
    print(f"{wheel.name}: only sigdb, and it works away from the checkout")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]).resolve())
