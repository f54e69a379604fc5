"""Pictures of the pages, drawn at build time into the ignored folder ``generated``."""

from pathlib import Path

from sphinx.application import Sphinx

import sigdb
from sigdb.report import ReportSettings, save_figure, signature_figure

RIG, SENSOR = "nasa-spiral-bevel-identified", "pinion-vertical"
CASES = {
    "healthy": ("No damage, no noise", None),
    "damaged": ("Tooth 6 with half of its stiffness lost, no noise", sigdb.Damage(tooth=6, stiffness_loss=0.5)),
}


def draw(folder: Path) -> None:
    """Draw the signature of every case, clean, on the rig that shows the paper's pictures."""
    rig = sigdb.load_transmission(RIG)
    for name, (title, damage) in CASES.items():
        response = sigdb.simulate(rig, damage)
        figure = signature_figure(
            response.signal(SENSOR),
            teeth=rig.gears[response.gear].teeth,
            sensor=SENSOR,
            unit=response.units[SENSOR],
            title=title,
            damaged=(damage.tooth,) if damage else (),
        )
        save_figure(figure, folder / f"{name}.png", ReportSettings(dots_per_inch=110))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", lambda app: draw(Path(app.srcdir) / "generated"))
    return {"parallel_read_safe": True}
