"""XML is read with limits: what is damaged, endless or cunning gets one sentence."""

import pytest

from phasmid.errors import InvalidInput
from phasmid.formats import xml
from phasmid.formats.urdf_in import read_urdf
from phasmid.formats.xml import read_xml


def refused(text):
    raw = text.encode() if isinstance(text, str) else text
    with pytest.raises(InvalidInput) as error:
        read_xml(raw, "robot.urdf")
    return error.value.what


def test_entities_are_not_accepted():
    bomb = (
        '<?xml version="1.0"?>\n<!DOCTYPE r [\n<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>\n<r>&b;</r>'
    )
    said = "robot.urdf line 2: entity definitions are not accepted."
    assert refused(bomb) == said
    outside = '<?xml version="1.0"?>\n<!DOCTYPE r SYSTEM "file:///etc/passwd">\n<r/>'
    assert refused(outside) == said
    assert refused("<r>&a;</r>") == "robot.urdf line 1: not well formed (undefined entity)."


def test_the_file_ends_inside_an_element():
    lines = ["<robot>", '<link name="tibia_3">', *["<!-- -->"] * 115, "<inertial><mass"]
    said = 'robot.urdf line 118: the file ends inside <link name="tibia_3">.'
    assert refused("\n".join(lines)) == said
    assert refused("<robot>\n<a>") == "robot.urdf line 2: the file ends inside <a>."
    # In the middle of a tag, an attribute or a comment.
    for cut in ("<robot>\n<a", '<robot>\n<a b="', "<robot>\n<!-- a"):
        assert refused(cut) == "robot.urdf line 2: the file ends inside <robot>."


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (" \n", "robot.urdf is empty."),
        ("solid cube", "robot.urdf line 1: this is no XML."),
        ("<a>\n<b>\n</a>", "robot.urdf line 3: not well formed (mismatched tag)."),
        ('<r>\n<a x="1" x="2"/></r>', "robot.urdf line 2: not well formed (duplicate attribute)."),
        (
            b'<?xml version="1.0" encoding="klingon"?><a/>',
            "robot.urdf: its encoding cannot be read (unknown encoding: klingon).",
        ),
        ("<r>\n<a x=1/></r>", "robot.urdf line 2: not well formed (invalid token)."),
    ],
)
def test_what_is_not_well_formed_is_named_with_its_line(text, said):
    assert refused(text) == said


def test_depth_and_count_have_their_limits():
    deep = "<a>" * xml.DEEPEST + "</a>" * xml.DEEPEST
    assert len(list(read_xml(deep.encode(), "r").walk())) == xml.DEEPEST
    for text, said in (
        ("<a>" * 100_000, f"elements lie more than {xml.DEEPEST} deep"),
        ("<a>" + "<b/>" * xml.MOST_ELEMENTS + "</a>", f"more than {xml.MOST_ELEMENTS} elements"),
    ):
        assert refused(text) == f"robot.urdf line 1: {said}; such files are refused."


def test_only_files_of_a_size_are_read(tmp_path):
    (tmp_path / "robot.urdf").write_bytes(b" " * (xml.LARGEST_FILE + 1))
    for name, said in (
        ("robot.urdf", "such files are refused"),
        ("", "is a folder"),
        ("none.urdf", "does not exist"),
        ("a" * 300, "cannot read"),
    ):
        with pytest.raises(InvalidInput, match=said):
            read_urdf(tmp_path / name)
