"""A log of a run: what was appended can be read, wherever it was cut, whatever was damaged."""

import re
import struct
import warnings
from contextlib import ExitStack, suppress
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phasmid.errors import InvalidInput, OutputError, PhasmidError
from phasmid.recording import (
    CHANNELS,
    DamagedRecording,
    RecordingLog,
    load_recording,
    new_recording,
)
from recording.samples import ODD, everything, files_of_at_most

CUT = {"ending": "CUT", "ending_reason": "The run was cut off."}
DONE = {"ending": "COMPLETED", "ending_reason": "The run came to its end."}


def write(path, samples=20, frame=5, *, finish=True, channels=None, **attributes):
    time = np.arange(samples) * 0.5
    channels = channels or everything(samples)
    with RecordingLog(path, channels, CUT | attributes, time=time) as log:
        for start in range(0, samples, frame):
            part = slice(start, start + frame)
            log.append(time[part], {name: array[part] for name, array in channels.items()})
        if finish:
            log.finish(DONE)
    return new_recording(time, channels, attributes | (DONE if finish else CUT))


def test_a_log_keeps_every_bit_and_says_how_it_ended(tmp_path):
    channels = everything(20)
    channels["body_position"][:5, 0] = ODD
    written = write(tmp_path / "walk.mcap", channels=channels, scenario="é", time_step=0.5, seed=7)
    read = load_recording(tmp_path / "walk.mcap")
    assert read.identical(written)
    for name in channels:
        assert read[name].values.tobytes() == channels[name].tobytes()
    assert [p.name for p in tmp_path.iterdir()] == ["walk.mcap"]


def chunks(content):
    """Return the places at which chunks begin: opcode 6, then the length in eight bytes."""
    place, found = 8, []
    while place < len(content) - 8:
        if content[place] == 6:
            found.append(place)
        place += 9 + int.from_bytes(content[place + 1 : place + 9], "little")
    return found


@pytest.mark.parametrize(
    ("damage", "count", "said"),
    [
        # Chunks: attributes, 20 samples, attributes; the cut is in sample 15.
        (lambda content, place: content[: place + 100], 15, "cut off"),
        (lambda content, place: flipped(content, place + 1000), 15, "damaged"),
        (lambda content, place: content, 20, "cut off"),
    ],
)
def test_a_log_is_read_up_to_its_last_whole_sample(tmp_path, damage, count, said):
    path = tmp_path / "walk.mcap"
    written = write(path, finish=count < 20)
    content = damage(path.read_bytes(), chunks(path.read_bytes())[16])
    path.write_bytes(content)
    with pytest.warns(DamagedRecording) as caught:
        read = load_recording(path)
    said = f"walk.mcap is {said}: {count} of 20 samples were read; the original is untouched."
    assert str(caught[0].message) == said
    assert caught[0].message.wrong == ("damaged" in said)
    assert read.drop_attrs().identical(written.isel(time=slice(0, count)).drop_attrs())
    assert read.attrs["ending"] == "CUT"
    assert read.attrs["ending_reason"] == f"The run was cut off: {said}"
    assert path.read_bytes() == content


def test_zeros_over_a_sample_and_its_checksum_do_not_pass_for_a_sample(tmp_path):
    path = tmp_path / "walk.mcap"
    write(path)
    content, places = path.read_bytes(), chunks(path.read_bytes())
    # A chunk is a byte of kind, its length, two times, the size of its data, and their checksum.
    checksum, end = places[16] + 33, places[17]
    for zeros in (0, 100):
        damaged = bytearray(content)
        damaged[checksum : checksum + 4] = bytes(4)
        damaged[end - zeros : end] = bytes(zeros)
        path.write_bytes(damaged)
        with pytest.warns(DamagedRecording, match="15 of 20 samples were read"):
            assert load_recording(path).sizes["time"] == 15


def flipped(content, place):
    return content[:place] + bytes([content[place] ^ 1 << place % 8]) + content[place + 1 :]


def test_no_flipped_bit_changes_a_number_unnoticed(tmp_path):
    # CRC-32 finds every single wrong bit of a chunk; sequence numbers find a chunk that is skipped.
    path = tmp_path / "walk.mcap"
    position = {"body_position": np.arange(12.0).reshape(4, 3)}
    whole = write(path, 4, 2, channels=position)
    content = path.read_bytes()
    for place in range(0, len(content), 5):
        path.write_bytes(flipped(content, place))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                read = load_recording(path)
            except InvalidInput:
                continue
        if caught:
            assert [w.category for w in caught] == [DamagedRecording]
            count = read.sizes["time"]
            assert np.array_equal(read.body_position, whole.body_position[:count])
        else:
            assert read.identical(whole)


def test_ros_tools_read_a_log(tmp_path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    path = tmp_path / "walk.mcap"
    written = write(path, 3, 3)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        samples = list(reader.iter_decoded_messages(topics=["/recording"]))
    assert [m.message.log_time for m in samples] == [0, 500_000_000, 1_000_000_000]
    for row, message in enumerate(samples):
        for name in CHANNELS:
            values = getattr(message.decoded_message, name)
            assert np.array_equal(np.ravel(values), written[name].values[row].ravel()), name


def test_a_log_appears_with_its_first_samples_and_not_before(tmp_path):
    path, arrays = tmp_path / "walk.mcap", everything(2)
    time = np.arange(2.0)
    with RecordingLog(path, arrays, CUT, time=time) as log:
        assert not path.exists()
        log.append(time, arrays)
        assert path.exists()
        # What was appended is there for all, without an orderly end.
        with pytest.warns(DamagedRecording):
            assert load_recording(path).sizes["time"] == 2
    (tmp_path / "walk.mcap").unlink()
    with pytest.raises(KeyboardInterrupt), RecordingLog(path, arrays, CUT, time=time):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_an_older_log_is_replaced_only_by_force(tmp_path):
    path, arrays = tmp_path / "walk.mcap", everything(2)
    write(path)
    before = path.read_bytes()
    with pytest.raises(InvalidInput, match=r"walk\.mcap exists; .*\n  try  phasmid report "):
        RecordingLog(path, arrays, CUT, time=np.arange(2.0))
    assert path.read_bytes() == before
    with RecordingLog(path, arrays, CUT, time=np.arange(2.0), force=True) as log:
        assert path.read_bytes() == before
        log.append(np.arange(2.0), arrays)
        log.finish(DONE)
    assert load_recording(path).sizes["time"] == 2


def fill_until_full(path, time, arrays):
    """Append ten frames of six samples, with room for seven and a half."""
    with RecordingLog(path, arrays, CUT, time=time) as log, ExitStack() as stack:
        for start in range(0, 60, 6):
            part = slice(start, start + 6)
            log.append(time[part], {name: a[part] for name, a in arrays.items()})
            if start == 36:
                stack.enter_context(files_of_at_most(path.stat().st_size + 1000))


def test_a_full_disk_keeps_what_was_saved_and_says_how_much(tmp_path):
    path = tmp_path / "walk.mcap"
    with pytest.raises(OutputError, match="file too large; 41 s of 59 s were saved and") as caught:
        fill_until_full(path, np.arange(60.0), everything(60))
    assert caught.value.exit_status == 1
    with pytest.warns(DamagedRecording, match="is cut off: 4[2-7] of 60 samples"):
        assert load_recording(path).sizes["time"] >= 42


def test_a_disk_without_room_is_found_before_the_run(tmp_path, monkeypatch):
    # Time and a position: 32 bytes a sample, 3.2 GB for 10^8 of them.
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=10**9))
    time = np.broadcast_to(0.0, 10**8)
    with pytest.raises(OutputError, match=r"a\.mcap needs about 3\.2 GB; 1 GB are free on its"):
        RecordingLog(tmp_path / "a.mcap", {"body_position": np.zeros((1, 3))}, CUT, time=time)


POSITION = "float64 time  # s\nfloat64[3] body_position  # m"


def write_foreign(path, definition=POSITION, attributes=b'{"format": 1}', compression=None):
    """A log of two messages by another writer: attributes, and a sample of four numbers."""
    from mcap.writer import CompressionType, Writer

    text, cdr = attributes + b"\0", b"\0\1\0\0"
    with path.open("wb") as file:
        none, zstd = CompressionType.NONE, CompressionType.ZSTD
        writer = Writer(file, compression=zstd if compression else none)
        writer.start("ros2")
        for topic, schema, data in (
            ("/recording/attributes", "string data", struct.pack("<I", len(text)) + text),
            ("/recording", definition, bytes(32)),
        ):
            kind = writer.register_schema(topic[1:], "ros2msg", schema.encode())
            writer.add_message(writer.register_channel(topic, "cdr", kind), 0, cdr + data, 0, 0)
        writer.finish()


def defined(channel):
    return {"definition": f"float64 time  # s\n{channel}"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        *(
            ({"attributes": text}, "holds no whole sample")
            for text in (b"", b"[]", b"3", b"[" * 100_000, b'{"a": 1' + b"0" * 5000 + b"}")
        ),
        ({"attributes": b'{"format": 9}'}, "uses format 9; this version reads up to 1."),
        ({"attributes": b'{"format": 1, "a": [1]}'}, "must be text or a number"),
        ({"attributes": b'{"format": 1, "a": 1%s}' % (b"0" * 30)}, "must be text or a number"),
        ({"attributes": b'{"planned_samples": "many"}'}, "is not a recording that can be read"),
        (defined("float64[3] pressure  # Pa"), 'its channel "pressure" is unknown.'),
        (defined("float64[3] body_position  # mm"), "its channels have other units."),
        (defined("bool[3] body_position  # m"), "its channels have other units."),
        (defined("float64[4] body_position  # m"), "holds no whole sample"),
        (defined("float64[3000000000] joint_torque  # N·m"), "holds no whole sample"),
        (defined("float64[0] joint_torque  # N·m"), "holds no whole sample"),
        # It cannot fill the memory.
        ({"compression": True}, "it is compressed"),
    ],
)
@pytest.mark.filterwarnings("ignore::phasmid.recording.DamagedRecording")
def test_a_log_of_another_form_is_refused(tmp_path, changes, words):
    write_foreign(tmp_path / "a.mcap")
    assert load_recording(tmp_path / "a.mcap").sizes["time"] == 1
    write_foreign(tmp_path / "a.mcap", **changes)
    with pytest.raises(InvalidInput, match=re.escape(words)):
        load_recording(tmp_path / "a.mcap")


@given(st.data())
def test_damaged_logs_are_refused_or_read_and_nothing_else(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("log") / "a.mcap"
    write(path, 6, 2, channels={"body_position": np.zeros((6, 3)), "stance": np.ones((6, 4), bool)})
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(0, 8))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(content)))
    extra = data.draw(st.binary(max_size=60))
    path.write_bytes(content[:cut] + extra)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamagedRecording)
        with suppress(PhasmidError):
            assert 0 < load_recording(path).sizes["time"] <= 6
