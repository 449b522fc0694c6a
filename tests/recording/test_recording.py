"""A recording cannot be malformed, and a file of it is whole or absent."""

import os

import numpy as np
import pytest

from phasmid.errors import InvalidInput, OutputError, plain
from phasmid.recording import (
    CHANNELS,
    DamagedRecording,
    load_recording,
    new_recording,
    save_recording,
)
from phasmid.recording.channels import COORDINATES
from phasmid.recording.file import CHECKSUM
from phasmid.scenario.rerun import Replay
from recording.samples import ODD, everything, files_of_at_most


def full(samples=5, **attributes):
    return new_recording(np.arange(samples) * 0.1, everything(samples), attributes)


def test_coordinates_and_units_are_those_of_the_design():
    recording = full()
    for name, channel in CHANNELS.items():
        assert recording[name].attrs["units"] == channel.units
    assert recording["time"].attrs["units"] == "s"
    assert list(recording["leg"].values) == [1, 2, 3, 4, 5, 6]
    for dim, names in COORDINATES.items():
        assert tuple(recording[dim].values) == names


T, LEGS_6 = np.arange(3.0), {"joint_torque": np.zeros((3, 6, 3))}


@pytest.mark.parametrize(
    ("time", "channels", "attributes", "words"),
    [
        (T, {"joint_torq": T}, {}, 'has no channel "joint_torq"'),
        (T, {"joint_torque": np.zeros((3, 6))}, {}, "it must have 3 of time, any of leg, 3 of"),
        (T, {"body_orientation": np.zeros((3, 3))}, {}, "it must have 3 of time, 4 of quaternion"),
        (T, LEGS_6 | {"stance": np.ones((3, 4), bool)}, {}, "it must have 3 of time, 6 of leg"),
        (T, {"foot_normal_force": np.zeros((3, 0))}, {}, "at least one leg"),
        (T, {"stance": np.ones((3, 6))}, {}, "it must hold true or false"),
        (T, {"body_position": np.ones((3, 3)) * 1j}, {}, "it must hold real numbers"),
        ([0.0, 0.405, 0.4], {}, {}, "sample 2: time 0.4 s does not follow 0.405 s"),
        ([0.0, np.nan, 0.1], {}, {}, "sample 1: time is nan"),
        ([], {}, {}, "at least one sample"),
        ([0.0, 2.0**31], {}, {}, "sample 1: time is .* it must be within"),
        (T, {}, {"scenario": "a\0b"}, "not text that a file can hold"),
        (T, {}, {"scenario": "\ud800"}, "not text that a file can hold"),
        (T, {}, {"scenario": [1]}, "must be text or a number"),
    ],
)
def test_what_is_no_recording_is_refused(time, channels, attributes, words):
    with pytest.raises(InvalidInput, match=words):
        new_recording(np.array(time), channels, attributes)


def test_a_file_keeps_every_bit(tmp_path):
    arrays = everything(5)
    arrays["body_position"][:, 0] = ODD
    # Long texts exceed the 64 KiB that HDF5 allows to simple attributes.
    attributes = {"scenario": "é" * 80_000, "kind": "", "time_step": 1e-3, "seed": 7}
    recording = new_recording(np.arange(5) * 0.1, arrays, attributes)
    save_recording(recording, tmp_path / "a.nc")
    loaded = load_recording(tmp_path / "a.nc")
    assert loaded.identical(recording)
    for name in arrays:
        assert loaded[name].dtype == arrays[name].dtype
        assert loaded[name].values.tobytes() == arrays[name].tobytes()
    assert loaded["time"].values.tobytes() == recording["time"].values.tobytes()
    assert {name: type(value) for name, value in loaded.attrs.items()} == {
        "scenario": str,
        "kind": str,
        "time_step": float,
        "seed": int,
        "format": int,
    }


def test_a_full_disk_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.nc"
    save_recording(full(samples=5), path)
    before, told = path.read_bytes(), r"cannot write .*a\.nc: file too large"
    with files_of_at_most(len(before)), pytest.raises(OutputError, match=told) as caught:
        save_recording(full(samples=2000), path)
    assert caught.value.exit_status == 1
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_no_file_of_a_recording_is_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    with pytest.raises(OutputError, match="no such file or directory"):
        save_recording(full(), tmp_path / "absent" / "a.nc")
    with h5py.File(tmp_path / "other.nc", "w") as file:
        file["pressure"] = np.arange(3.0)
    (tmp_path / "text.nc").write_text("time,coxa\n0,1\n")
    save_recording(full().assign_attrs(format=3), tmp_path / "newer.nc")
    save_recording(full(), tmp_path / "unit.nc")
    with h5py.File(tmp_path / "unit.nc", "r+") as file:
        file["joint_position"].attrs["units"] = "deg"
    refused = {
        "absent.nc": "does not exist",
        ".": r"is a folder without a recording\.nc",
        "other.nc": "is not a",
        "text.nc": "is not a recording that can be read",
        "newer.nc": "uses format 3; this version reads up to 1",
        "unit.nc": '"joint_position" is in deg; it must be in rad',
    }
    if hasattr(os, "mkfifo"):
        for name in ("pipe.nc", "pipe.mcap"):
            os.mkfifo(tmp_path / name)
            refused[name] = "is not a file"
    for name, words in refused.items():
        with pytest.raises(InvalidInput, match=words):
            load_recording(tmp_path / name)


def test_a_file_that_claims_more_than_it_holds_is_refused_unread(tmp_path, monkeypatch):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "bomb.nc"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = 1
        # Chunks that were never written are in no file, whatever else makes it large.
        file.create_dataset("time", (2_500_000,), "f8", chunks=True, compression="gzip")[:1] = 1.0
        file["other"] = np.zeros(2000)

    def read(*_):
        raise AssertionError("an array was read")

    monkeypatch.setattr(h5py.Dataset, "__getitem__", read)
    with pytest.raises(InvalidInput, match="is damaged: it claims"):
        load_recording(path)


def test_a_file_cannot_draw_numbers_from_other_files(tmp_path):
    h5py = pytest.importorskip("h5py")
    save_recording(full(), tmp_path / "a.nc")
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(24 * 5))
    for name in ("link.nc", "raw.nc"):
        with h5py.File(tmp_path / name, "w") as file:
            file.attrs["format"] = 1
            file["time"] = np.arange(5.0)
            if name == "link.nc":
                file["body_position"] = h5py.ExternalLink("a.nc", "/body_position")
            else:
                outside = [(str(secret), 0, 120)]
                file.create_dataset("body_position", (5, 3), "f8", external=outside)
        with pytest.raises(InvalidInput, match="body_position is not an array of its own"):
            load_recording(tmp_path / name)


def test_every_flipped_bit_is_refused_before_a_reader_can_stumble_over_it(tmp_path):
    # CRC-32 finds any single bit.
    path, recording = tmp_path / "a.nc", full(samples=3, scenario="text", robot="mass = 1")
    save_recording(recording, path)
    whole = path.read_bytes()
    line = len(whole) - len(CHECKSUM % 0)
    for place in (*range(48, line, 101), *range(line, len(whole))):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        path.write_bytes(damaged)
        with pytest.raises(InvalidInput, match="is damaged: it fails its checksum"):
            load_recording(path)
    # Zeros over the checksum do not pass for a file without one.
    for size in (16, len(CHECKSUM % 0), 512, 2048):
        path.write_bytes(whole[:-size] + bytes(size))
        with pytest.raises(InvalidInput, match="is damaged: it fails its checksum"):
            load_recording(path)


def test_time_has_a_checksum_that_any_reader_of_hdf5_heeds(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.nc"
    save_recording(full(), path)
    with h5py.File(path) as file:
        assert all(file[name].fletcher32 for name in ("time", *full().data_vars))
        where = file["time"].id.get_chunk_info(0)
    whole = path.read_bytes()[: -len(CHECKSUM % 0)]
    for place in range(where.byte_offset, where.byte_offset + where.size):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << place % 8
        path.write_bytes(damaged)
        with pytest.raises(InvalidInput, match="is not a recording that can be read"):
            load_recording(path)


def test_a_text_from_a_file_cannot_drive_a_terminal():
    # A title set by ESC ] 0 ; ... BEL, a line overwritten by CR, an escape of C1, a lone surrogate.
    hostile = "a\x1b]0;owned\x07 \rb\x9b2J\udc80 é"
    said = "a\N{REPLACEMENT CHARACTER}]0;owned\N{REPLACEMENT CHARACTER}  b"
    said += "\N{REPLACEMENT CHARACTER}2J\N{REPLACEMENT CHARACTER} é"
    assert plain(hostile) == said
    assert str(InvalidInput(hostile)) == said
    assert str(DamagedRecording(hostile, wrong=False)) == said
    assert said in str(Replay(1, 1, None, {"machine": (hostile, "here")}))
