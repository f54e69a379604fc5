"""Diagnosis of recordings with healthy recordings, and a rig, its tooth counts, a model or a database."""

from collections.abc import Sequence
from os import PathLike
from typing import Unpack

from sigdb.diagnosis.diagnosis import Diagnosis
from sigdb.diagnosis.machine.machine_recordings import AnyRecording, DiagnosisOptions, MachineRecordings
from sigdb.transmission import Transmission


def diagnose(
    recording: AnyRecording | Sequence[AnyRecording],
    rig: Transmission | str | PathLike[str] | None = None,
    *,
    healthy: AnyRecording | Sequence[AnyRecording] = (),
    teeth: str | int | None = None,
    module: float | str | None = None,
    model: str | PathLike[str] | None = None,
    database: str | PathLike[str] | None = None,
    gear: str | None = None,
    sensor: str | None = None,
    torque: float | None = None,
    healthy_torque: Sequence[float] = (),
    load: float | None = None,
    healthy_load: Sequence[float] = (),
    save_reference: str | PathLike[str] | None = None,
    where: str | None = None,
    **options: Unpack[DiagnosisOptions],
) -> Diagnosis:
    """Diagnose a gear from a recording: whether a tooth stands out, which, how severely, and what would have been seen.

    The average of the recording is compared with that of healthy recordings of the same machine by the same channel. A
    tooth stands out where the difference between the mesh harmonics is a short pulse, or has the shape of simulated
    damage, more than healthy recordings show. Where none does, damage is added to the recording itself, and the same
    decision says how much of it would have been seen.

    Parameters
    ----------
    recording : Recording, RecordingBlocks, str or path-like, or sequence of these
        From :func:`sigdb.read_recording` or :func:`sigdb.recording.read_in_blocks`, or the path of a file. Several of
        the machine in one state, at one speed and load, are joined into one average and have one answer.
    rig : Transmission, str or path-like, optional
        The rig, with one mesh; or its name or file. Severity needs it.
    healthy : recording or sequence of recordings
        Healthy recordings, read and averaged like the other. Several, at other loads or speeds, give better limits.
        A file of ``save_reference`` stands for the recordings that it holds, and a database of recordings for its
        healthy ones. The database also gives gear, reading and averaging where they are left out.
    teeth : str or int, optional
        Instead of a rig, the tooth counts of the averaged gear and its mate, ``"32/80"``, or of that gear alone.
    module : float or str, optional
        Module of the pair of ``teeth``, m or with a unit; by default a usual range.
    model : str or path-like, optional
        Folder or name of a trained model whose templates are used. It needs the rig.
    database : str or path-like, optional
        A database of the rig whose templates are used. Without model and database the templates are simulated, at the
        recording's speed and torque.
    gear : str, optional
        Gear on the averaged shaft; the first mesh's driving gear if left out. Its mate is averaged as well, and the
        diagnosis is that of the mate where a tooth of the mate stands out more.
    sensor : str, optional
        Sensor of the rig. By default it is the sensor with the channel's name, otherwise the rig's last.
    torque : float, optional
        Torque in N m, as the rig's ``operating.torque``. By default it is the recording's, otherwise the rig's.
    healthy_torque : sequence of float, optional
        Torque of each healthy recording, N m; by default those that the recordings state.
    load, healthy_load : float and sequence of float, optional
        Instead of torques, the load of the recording and of each healthy recording in any one unit, such as per cent;
        by default those that the recordings state.
    save_reference : str or path-like, optional
        File for the averages of the healthy recordings, or of this one where there are none, and for the templates: a
        reference of the machine, which later calls take as ``healthy``.
    where : str, optional
        Condition that selects rows of a database of ``healthy``, such as ``"date < '2026-03-01'"``. Rows of unknown
        health that meet it count as healthy.
    **options
        Fields of :class:`sigdb.recording.AveragingSettings`: ``channel``, ``mesh_phase``, ``speed_rpm``,
        ``revolutions`` and others. For the path of a file also fields of :class:`sigdb.recording.RecordingSettings`:
        ``tacho``, ``sampling_rate``, ``units`` and others.

    Returns
    -------
    Diagnosis
        The answer with its evidence. It is ``cannot be judged`` where the gear is not to be seen in one of the
        recordings, or where no damage of the range would have been seen.

    Raises
    ------
    InputError
        If a file cannot be read, the rig has several meshes, or the recording does not fit it. Also if several
        recordings are of other channels, speeds or loads, or have no healthy recording.
    """
    machine = MachineRecordings.of(
        recording, rig, healthy=healthy, teeth=teeth, module=module, model=model, database=database, gear=gear,
        sensor=sensor, torque=torque, where=where, **options,
    )  # fmt: skip
    return machine.diagnosis(
        range(machine.count),
        sensor=sensor,
        torque=torque,
        healthy_torque=healthy_torque,
        load=load,
        healthy_load=healthy_load,
        save_reference=save_reference,
    )
