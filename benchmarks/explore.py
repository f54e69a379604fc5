"""The explorer in a real browser: how soon it is there, and how soon a changed setting is painted.

A server is started as a person starts it. The page is opened in a window of Chromium that has come to rest, and each
setting goes through 60 values, one after the other. A time runs from the change of the slider to the end of the first
frame that shows it. The peer is the same case by `sigdb.simulate` and `sigdb.signature.wigner_ville` in Python, without
a page, in the same run.

    python benchmarks/explore.py [--rig nasa-spiral-bevel] [--json docs/guide/explorer.json] [--pictures FOLDER]

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
from measuring import environment, print_table
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
REST_MS = 3000
"""Time that a new window of the browser gets to load what it shows itself."""
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


def change_all(page: Page, name: str) -> tuple[list[float], list[float]]:
    """Move one slider through its range; return the milliseconds until each value is painted, and to compute it."""
    times: tuple[list[float], list[float]] = page.evaluate(
        """async ([name, changes]) => {
            const slider = document.getElementById("slider-" + name), painted = [], computed = [];
            const low = Number(slider.min), high = Number(slider.max), step = Number(slider.step);
            for (let i = 0; i < changes; i++) {
                const before = slider.value;
                slider.value = low + Math.round((high - low) * ((i * 0.381966) % 1) / step) * step;
                if (slider.value === before) continue;
                delete document.body.dataset.painted;
                slider.dispatchEvent(new Event("input"));
                while (!document.body.dataset.painted) await new Promise((done) => setTimeout(done, 2));
                const { milliseconds, simulation } = JSON.parse(document.body.dataset.painted);
                painted.push(milliseconds);
                computed.push(simulation);
            }
            return [painted, computed];
        }""",
        [name, CHANGES],
    )
    return times


def measured(browser: Browser, address: str, ready: float) -> dict[str, list[dict[str, Any]]]:
    """Return the times of a page, as tables."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.wait_for_timeout(REST_MS)
    started = time.perf_counter()
    page.goto(address)
    page.wait_for_selector("body[data-painted]", state="attached")
    first = time.perf_counter() - started
    page.check("#noise")
    names = page.evaluate("[...document.querySelectorAll('#controls input[type=range]')].map((s) => s.id.slice(7))")
    rows = []
    for name in names:
        page.fill("#number-tooth", "6")
        page.wait_for_timeout(REST_MS / 2)
        painted, computed = change_all(page, name)
        p95, aim = float(np.percentile(painted, 95)), AIMS_MS.get(name, AIM_MS)
        rows.append(
            {"setting": name, "median_ms": float(np.median(painted)), "p95_ms": p95, "aim_ms": aim,
             "within_aim": p95 <= aim, "median_to_compute_ms": float(np.median(computed))}
        )  # fmt: skip
        page.reload()
        page.wait_for_selector("body[data-painted]", state="attached")
    page.close()
    start = [
        {"step": step, "s": seconds, "aim_s": aim, "within_aim": seconds <= aim}
        for step, seconds, aim in (("server ready", ready, READY_S), ("first paint of the page", first, PAINT_S))
    ]
    return {"start": start, "settings": rows}


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
        page.wait_for_selector("body[data-painted]", state="attached")
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
            tables = measured(browser, address, seconds)
        browser.close()
        server.terminate()
    if given.pictures:
        return
    for title, rows in tables.items():
        print_table(title, rows)
    python = by_python(given.rig)
    print(f"one case by Python alone, the rig prepared anew: {python:.0f} ms")
    if given.json is not None:
        document = {"machine": environment("numpy", "scipy"), "python_ms": python, "tables": tables}
        given.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
