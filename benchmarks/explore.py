"""The explorer in a real browser: how soon it is there, and how soon a changed setting is painted.

A server is started as a person starts it. The page is opened in Chromium, and each setting goes through 60 values, one
after the other. A time runs from the change of the slider to the end of the first frame that shows it. The peer is the
same case by `sigdb.simulate` and `sigdb.signature.wigner_ville` in Python, without a page, in the same run.

    python benchmarks/explore.py [--rig nasa-spiral-bevel] [--json FILE] [--pictures FOLDER]

Chromium must be installed, and the package playwright.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment
from playwright.sync_api import Browser, Page, sync_playwright

import sigdb
from sigdb.signature import wigner_ville

CHANGES = 60
"""Values of each setting."""
AIMS_MS = {"speed_rpm": 300.0, "teeth": 300.0}
AIM_MS = 50.0
"""Aim of the 95th percentile from slider to paint: of these settings, and of all others."""
READY_S, PAINT_S = 3.0, 0.5
"""Aims of the server and of the first paint."""
PICTURES = {
    "explorer.png": ("", 1280, 800, "light"),
    "explorer-dark.png": ("&tooth=9&stiffness_loss=0.4&phase_shift_deg=3&snr_db=0", 1280, 800, "dark"),
}


def chromium() -> str:
    """Return the path of the system's Chromium."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    raise SystemExit("Chromium is not installed; on Debian: apt-get install chromium")


def change_all(page: Page, name: str) -> list[float]:
    """Move one slider through its range; return the milliseconds until each value is painted."""
    times: list[float] = page.evaluate(
        """async ([name, changes]) => {
            const slider = document.getElementById("slider-" + name), times = [];
            const low = Number(slider.min), high = Number(slider.max), step = Number(slider.step);
            for (let i = 0; i < changes; i++) {
                const before = slider.value;
                slider.value = low + Math.round((high - low) * ((i * 0.381966) % 1) / step) * step;
                if (slider.value === before) continue;
                delete document.body.dataset.painted;
                slider.dispatchEvent(new Event("input"));
                while (!document.body.dataset.painted) await new Promise((done) => setTimeout(done, 2));
                times.push(JSON.parse(document.body.dataset.painted).milliseconds);
            }
            return times;
        }""",
        [name, CHANGES],
    )
    return times


def measured(browser: Browser, address: str, seconds: float) -> dict[str, Any]:
    """Return the times of a page."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    started = time.perf_counter()
    page.goto(address)
    page.wait_for_selector("body[data-painted]")
    first = time.perf_counter() - started
    page.check("#noise")
    names = page.evaluate("[...document.querySelectorAll('#controls input[type=range]')].map((s) => s.id.slice(7))")
    result = {"ready_s": seconds, "first_paint_s": first, "settings": {}}
    for name in names:
        page.fill("#number-tooth", "6")
        times = change_all(page, name)
        simulation = json.loads(page.get_attribute("body", "data-painted") or "{}")["simulation"]
        result["settings"][name] = {
            "median_ms": float(np.median(times)),
            "p95_ms": float(np.percentile(times, 95)),
            "aim_ms": AIMS_MS.get(name, AIM_MS),
            "last_simulation_and_signature_ms": simulation,
        }
        page.reload()
        page.wait_for_selector("body[data-painted]")
    page.close()
    return result


def by_python(rig: str) -> float:
    """Return the milliseconds of one case by `sigdb.simulate` and `wigner_ville`."""
    loaded = sigdb.load_transmission(rig)
    times = []
    for loss in np.linspace(0.1, 0.4, 8):
        started = time.perf_counter()
        response = sigdb.simulate(loaded, sigdb.Damage(tooth=6, stiffness_loss=float(loss)))
        x = next(iter(response.signals.values()))
        wigner_ville(x - x.mean())
        times.append(1e3 * (time.perf_counter() - started))
    return float(np.median(times))


def take_pictures(browser: Browser, address: str, folder: Path) -> None:
    """Write screenshots of the page into a folder."""
    for name, (view, width, height, scheme) in PICTURES.items():
        page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)  # type: ignore[arg-type]
        page.goto(address + view)
        page.wait_for_selector("body[data-painted]")
        page.wait_for_selector("#drawing svg")
        page.evaluate("document.getElementById('timing').hidden = true")
        page.screenshot(path=folder / name)
        page.close()


def main() -> None:
    """Measure, print and store."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rig", default="nasa-spiral-bevel")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--pictures", type=Path, help="Only write screenshots into this folder.")
    given = parser.parse_args()
    command = [sys.executable, "-u", "-m", "sigdb", "explore", "--no-browser"]
    command += [] if given.pictures else [given.rig]
    started = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
        assert server.stdout is not None
        line = server.stdout.readline()
        seconds = time.perf_counter() - started
        match = re.match(r"http://127\.0\.0\.1:\d+/#token=\S+", line)
        if match is None:
            raise SystemExit(f"the explorer did not start: {line}")
        address = match.group()
        browser = playwright.chromium.launch(executable_path=chromium(), args=["--no-sandbox"])
        if given.pictures:
            take_pictures(browser, address, given.pictures)
        else:
            result = measured(browser, address, seconds)
        browser.close()
        server.terminate()
    if given.pictures:
        return
    python = by_python(given.rig)
    result |= {"python_ms": python, "environment": environment()}
    print(f"server ready after {result['ready_s']:.2f} s (aim {READY_S}), painted after {result['first_paint_s']:.2f} s"
          f" (aim {PAINT_S}); one case in Python, rig prepared anew: {python:.0f} ms")  # fmt: skip
    for name, row in result["settings"].items():
        ratio = python / row["median_ms"]
        print(f"{name:18} median {row['median_ms']:6.0f} ms, 95 % below {row['p95_ms']:6.0f} ms"
              f" (aim {row['aim_ms']:.0f}), {ratio:.1f} times as fast as Python alone")  # fmt: skip
    if given.json is not None:
        given.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
