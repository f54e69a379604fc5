"""Unit: the page of a rig as text, with parts that lack a number."""

from sigdb.report import Terminal, modes_text, rig_text
from sigdb.transmission import coupled_modes, describe_rig, load_transmission


def test_a_gear_without_a_mesh_has_a_dash_for_its_radius():
    facts = describe_rig(load_transmission("nasa-spiral-bevel"))
    facts["gears"][0] |= {"pitch_radius": None, "pitch_angle_deg": None}
    head, pinion, gear = rig_text(facts).split("Gears (at the mean pitch radius)\n")[1].splitlines()[:3]
    assert (len(pinion), pinion.split()[:6]) == (len(head), ["pinion", "pinion-shaft", "0", "12", "-", "-"])
    assert gear.split()[4:6] == ["76.88", "71.565"]


def test_the_page_fits_a_terminal_and_keeps_its_numbers():
    facts = describe_rig(load_transmission("nasa-spiral-bevel"))
    text = rig_text(facts, terminal=Terminal(width=60))
    tables = [line for line in text.splitlines() if line.startswith("  ")]
    assert max(map(len, tables)) <= 60
    # Dotted paths are longer than a column, and folded.
    assert {word for word in rig_text(facts).split() if not ("." in word and word[0].isalpha())} <= set(text.split())


def test_modes_are_numbered_from_the_lowest():
    modes = coupled_modes(load_transmission("nasa-spiral-bevel"))
    lines = modes_text(modes, count=2).splitlines()
    assert [line.split()[:2] for line in lines[1:]] == [[str(i + 1), f"{modes.frequency_hz[i]:.1f}"] for i in range(2)]
