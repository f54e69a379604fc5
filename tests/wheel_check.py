"""Check a built wheel: only ``sigdb`` at top level, and it works in a clean environment away from the checkout.

Usage: python tests/wheel_check.py DIST ENVIRONMENT
"""

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
"""


def main(dist: Path, environment: Path) -> None:
    (wheel,) = dist.glob("sigdb-*.whl")
    top = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
    expected = {"sigdb", wheel.name.split("-py3")[0] + ".dist-info"}
    assert top == expected, f"top level of {wheel.name}: {sorted(top)}"
    venv.create(environment, clear=True, with_pip=True)
    python = environment / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", wheel], check=True)
    subprocess.run([python, "-W", "error", "-c", TRY], check=True, cwd=environment)
    subprocess.run([environment / "bin" / "sigdb", "modes", "nasa-spiral-bevel", "--count", "3"], check=True)
    print(f"{wheel.name}: only sigdb, and it works away from the checkout")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]).resolve())
