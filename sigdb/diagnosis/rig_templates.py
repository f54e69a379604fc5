"""Templates for a recording: of a described rig and its ensemble, of tooth counts alone, of a database or a model."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

from sigdb.core import InputError, Note, SigdbError, __version__, json_text
from sigdb.database import changed_parts, model_form
from sigdb.database import open as open_database
from sigdb.diagnosis.change.templates import Templates
from sigdb.diagnosis.notes import rig_speed_notes
from sigdb.diagnosis.stored_reference import SimulatedTemplates
from sigdb.dynamics import ensemble
from sigdb.transmission import Transmission

if TYPE_CHECKING:
    from sigdb.recognition import TemplateBank

MEMBERS = 8
"""Rigs of an ensemble."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """Source of templates.

    Attributes
    ----------
    rig
        The rig; None with a tooth count alone, for which there are no templates.
    described
        Whether the rig is described, or only its tooth counts are known.
    bank
        Templates of a database or a model; None where they are simulated.
    notes
        Notes on the source.
    """

    rig: Transmission | None
    described: bool
    bank: "TemplateBank | None" = None
    notes: tuple[Note, ...] = ()

    @property
    def samples_per_tooth(self) -> int | None:
        """Samples in a tooth pass of stored templates; None where any will do."""
        if self.bank is None:
            return None
        point = self.bank.points[0]
        return point.samples // point.teeth

    def speed_notes(self, speed_rpm: float) -> tuple[Note, ...]:
        """Return the note on a recording whose speed, at the rig's drive, is far from that of a described rig."""
        if self.rig is None or not self.described or self.bank is not None:
            return ()
        return tuple(rig_speed_notes(self.rig.operating.speed_rpm, speed_rpm))

    def templates(
        self,
        *,
        gear: str,
        sensor: str | None,
        channel: str,
        speed_rpm: float,
        torque: float,
        samples_per_tooth: int,
        stored: Sequence[SimulatedTemplates] = (),
    ) -> SimulatedTemplates:
        """Return the templates at the operating point of a recording, with what was assumed for them.

        Parameters
        ----------
        gear
            Averaged gear.
        sensor
            The rig's sensor; by default that of the channel's name, or the last, which is the farthest from the shaft.
        channel
            Channel of the recording.
        speed_rpm, torque
            Speed and torque of the rig's operating point, rpm and N m.
        samples_per_tooth
            Samples of the average in a tooth pass.
        stored
            Templates of stored references, which are taken where they are of this rig at nearly this point.
        """
        rig = required_rig(self.rig)
        if self.bank is not None:
            teeth = rig.gears[gear].teeth
            of_speed, of_torque = self.bank.stored_point(speed_rpm, torque, teeth)
            templates = Templates.stored(self.bank, speed_rpm=speed_rpm, torque=torque, teeth=teeth)
            stated = f"The stored templates at {of_speed:.5g} rpm and {of_torque:.5g} N m stand for this machine"
            others = templates.member.max(initial=0)
            drawn = f", or those of one of {others} machines with the nuisances that their recipe states"
            return SimulatedTemplates(
                templates=templates,
                assumed=(f"{stated}{drawn if others else ''}.",),
                machine="",
                speed_rpm=speed_rpm,
                torque=torque,
            )
        named = _sensor(rig, sensor, channel)
        at = rig.replace({"operating.speed_rpm": speed_rpm, "operating.torque": torque})
        machine = _machine(rig, gear, named, samples_per_tooth, described=self.described)
        for each in stored:
            if each.holds_for(machine, speed_rpm=speed_rpm, torque=torque):
                return each
        rigs, sentence = _rigs(at, described=self.described)
        try:
            templates = Templates.simulated(
                rigs,
                gear=gear,
                sensor=named,
                samples_per_tooth=samples_per_tooth,
                described=self.described,
            )
        except SigdbError as error:
            raise InputError(
                f"rig {at.name} has no templates at {speed_rpm:.5g} rpm and {torque:.5g} N m: {error}; check the "
                "sampling rate, the tacho and the torque"
            ) from error
        if not len(templates.spectra):
            raise InputError(
                f"rig {at.name} has no templates at {speed_rpm:.5g} rpm and {torque:.5g} N m, where the teeth of its "
                f"gears part; its operating point is {rig.operating.speed_rpm:.5g} rpm and "
                f"{rig.operating.torque:.5g} N m: check the sampling rate, the tacho and the torque"
            )
        place = f"The sensor sits where the rig's sensor {named} does, behind any smooth path."
        return SimulatedTemplates(
            templates=templates, assumed=(sentence, place), machine=machine, speed_rpm=speed_rpm, torque=torque
        )


def required_rig(rig: Transmission | None) -> Transmission:
    """Return the rig of a source, without which there are no templates."""
    if rig is None:
        raise InputError("a tooth count alone has no templates; give both counts, such as 32/80, or a rig")
    return rig


def _machine(rig: Transmission, gear: str, sensor: str, samples_per_tooth: int, *, described: bool) -> str:
    """Return the hash of what templates depend on, apart from speed and torque."""
    model = rig.model_dump(mode="json", exclude_none=True, exclude={"operating": {"speed_rpm", "torque"}})
    text = json_text([model, gear, sensor, samples_per_tooth, described, __version__])
    return hashlib.sha256(text.encode()).hexdigest()


def _rigs(rig: Transmission, *, described: bool) -> tuple[list[Transmission], str]:
    """Return the rig and members of its ensemble, and a sentence on them."""
    if not rig.assumptions.free:
        return [rig], f"All numbers of rig {rig.name} hold."
    members = list(ensemble(rig, MEMBERS - described, rng=0))
    if not described:
        return members, (
            f"One of {len(members)} rigs of these tooth counts resembles this machine: sizes, bearings and inertias "
            "were drawn from usual ranges."
        )
    return [
        rig,
        *members,
    ], f"Rig {rig.name}, or one of {len(members)} rigs from the ranges of its assumed numbers, holds."


def stored_bank(
    rig: Transmission,
    *,
    model: str | PathLike[str] | None,
    database: str | PathLike[str] | None,
    sensor: str | None,
) -> tuple["TemplateBank | None", tuple[Note, ...]]:
    """Return the templates of a model or a database, and notes; None without both."""
    if model is None and database is None:
        return None, ()
    from sigdb.recognition import TemplateBank, load_model  # imports all of scikit-learn

    if model is not None and database is not None:
        raise InputError("model and database are given together; templates are taken from one of them")
    if database is not None:
        opened = open_database(str(database))
        changed = changed_parts(model_form(opened.manifest.resolved), _description(rig))
        return TemplateBank.of(opened, sensor=sensor), _rig_notes("database", changed)
    loaded = load_model(str(model))
    templates = loaded.estimators.get("templates")
    bank = None if templates is None else templates.template_bank
    if bank is None:
        raise InputError(f"{model} holds no templates; train it on a database of a rig with one mesh")
    return bank, _rig_notes("model", changed_parts(loaded.form, _description(rig)))


def _description(rig: Transmission) -> Mapping[str, Any]:
    """Return a rig as the description of a database has it."""
    return {"rig": rig.model_dump(mode="json", exclude_none=True)}


def _rig_notes(source: str, changed: list[str]) -> tuple[Note, ...]:
    """Return a note on the parts in which the rig of the templates differs from the rig of the recording."""
    parts = ", ".join(changed)
    text = f"The {source} is of a rig that differs in {parts}."
    return (Note(code="other-rig", text=text, values={"source": source, "parts": parts}),) if changed else ()


def averaged_gear_of(rig: Transmission, requested: str | None) -> str:
    """Return the averaged gear; templates of its teeth must be turns of each other."""
    if requested is not None and requested not in rig.gears:
        raise InputError(f"gear = {requested!r} is not a gear of {rig.name}; it has {', '.join(rig.gears)}")
    gear = requested or (next(iter(rig.meshes.values())).driving if rig.meshes else None)
    if gear is None or not rig.turns_exactly(gear):
        raise InputError(
            f"rig {rig.name} has {len(rig.meshes)} meshes; a recording is compared with templates of a rig with one: "
            "describe the gear pair of interest as a rig of its own"
        )
    return gear


def _sensor(rig: Transmission, requested: str | None, channel: str) -> str:
    """Return the requested sensor of the rig, the sensor with the channel's name, or the last."""
    if requested is not None and requested not in rig.sensors:
        raise InputError(f"sensor = {requested!r} is not a sensor of {rig.name}; it has {', '.join(rig.sensors)}")
    return requested or (channel if channel in rig.sensors else list(rig.sensors)[-1])
