"""What any XML file can do to a reader, tried on every reader of XML."""

import pytest

from plumbob.reference.formats import mjcf, urdf

GOOD = {
    urdf: """<?xml version="1.0" encoding="utf-8"?>
<robot name="arm">
  <!-- a comment with <tags> and & in it -->
  <link name="base"/>
  <link name="upper"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
  <link name="hand"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="finger" type="prismatic">
    <parent link="upper"/><child link="hand"/>
    <limit upper="2"/>
    <mimic joint="shoulder" multiplier="0.5" offset="1"/>
  </joint>
</robot>""",
    mjcf: """<?xml version="1.0"?>
<mujoco model="arm">
  <compiler angle="radian" eulerseq="ZYX"/>
  <default><joint axis="0 1 0"/><default class="loose"><joint range="-1 2"/></default></default>
  <worldbody>
    <body name="upper" pos="0 0 0.5" euler="0.1 0.2 0.3" childclass="loose">
      <joint name="shoulder" pos="0 0 0.1"/>
      <frame pos="1 0 0"><body name="hand"><joint type="ball" class="main"/></body></frame>
    </body>
    <body name="cup"><freejoint/></body>
  </worldbody>
</mujoco>""",
}
BILLION_LAUGHS = '<!DOCTYPE lolz [<!ENTITY a "ha">{}]>'.format(
    "".join(f'<!ENTITY {y} "{f"&{x};" * 10}">' for x, y in zip("abcdefgh", "bcdefghi", strict=True))
)
HOSTILE = {
    "empty": ("", "well-formed XML, got no element found"),
    "cut short": ("<{root}><body>", "well-formed XML, got no element found"),
    "an attribute twice": ('<{root} a="1" a="2"/>', "well-formed XML, got duplicate attribute"),
    "a NUL": ("<{root}>\0</{root}>", "well-formed XML"),
    "half a surrogate": ("<{root}>\ud800<{root}>", "well-formed XML"),
    "entities without end": (BILLION_LAUGHS + '<{root} a="&i;"/>', "no document type"),
    "a file's content": (
        '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><{root} a="b">&x;</{root}>',
        "no document type",
    ),
    "a million elements in each other": ("<{root}>" + "<body>" * 10**6, "at most 500"),
    "a million elements in a row": ("<{root}>" + "<link/>" * 10**6, "at most 100,000 elements"),
    "a name without end": (
        '<{root}><link name="{0}"/><worldbody><body name="{0}"/></worldbody></{root}>'.replace(
            "{0}", "a" * 10**6
        ),
        "expected at most 2,000 characters in 'name'",
    ),
    "a name with line ends": (
        '<{root}><joint name="a&#10;b"/><worldbody><joint name="a&#10;b"/></worldbody></{root}>',
        r"name='a\nb'>: expected",
    ),
    "another root": ("<other/>", "<other>: expected a <"),
}


@pytest.fixture(params=[urdf, mjcf], ids=["urdf", "mjcf"])
def reader(request):
    return request.param


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_hostile_gets_one_sentence(reader, name, refusal):
    text, message = HOSTILE[name]
    root = {urdf: "robot", mjcf: "mujoco"}[reader]
    assert message in refusal(reader.parse, text.replace("{root}", root))


def test_a_file_cut_anywhere_is_refused(reader, refusal):
    assert reader.parse(GOOD[reader]).articulation.joint_count > 2
    for end in range(0, len(GOOD[reader]) - 1, 17):
        assert "well-formed XML" in refusal(reader.parse, GOOD[reader][:end])


@pytest.mark.filterwarnings("ignore::plumbob.reference.formats.FormatWarning")
def test_a_file_with_a_piece_missing_is_a_model_or_refused(reader, refusal):
    text = GOOD[reader]
    for begin in range(0, len(text), 7):
        try:
            reader.parse(text[:begin] + text[begin + 23 :])
        except ValueError:
            refusal(reader.parse, text[:begin] + text[begin + 23 :])


def test_every_number_is_checked(reader, refusal):
    text = GOOD[reader]
    for number in ("0.5", "0.1", "-1 2" if reader is mjcf else '"-1"'):
        at = text.index(number)
        for value in ("nan", "1e999", "1_0", "1;", "0x1p3", "--1", "1e76"):
            wrong = number.replace(number.strip('"').split()[0], value)
            message = refusal(reader.parse, text[:at] + wrong + text[at + len(number) :])
            assert "number" in message or "lower <= upper" in message or "range" in message


def test_errors_name_the_file_the_line_and_the_element(reader, refusal, tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(GOOD[reader].replace('pos="0 0 0.5"', 'pos="up"').replace("0 1 0", "0 1"))
    line = {urdf: 10, mjcf: 6}[reader]
    message = refusal(reader.read, path)
    assert f"arm.xml, line {line}: <" in message


def test_a_file_and_its_text_give_the_same_model(reader, tmp_path):
    path = tmp_path / "arm.xml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD[reader].replace("\n", "\r\n").encode())
    a, b = reader.read(path), reader.parse(GOOD[reader])
    assert a.joints == b.joints
    assert a.articulation.names == b.articulation.names
    assert (a.articulation.frames == b.articulation.frames).all()
    assert (a.articulation.skeleton.offsets == b.articulation.skeleton.offsets).all()


ENCODINGS = {
    "ISO-8859-1": "ISO-8859-1",
    "Latin1": "latin1",
    "iso-8859-2": "iso-8859-2",
    "windows-1252": "windows-1252",
    "UTF-16": "utf-16",  # with a byte order mark
    "utf-16": "utf-8",  # which some programs declare for UTF-8
    "US-ASCII": "utf-8",
}


@pytest.mark.parametrize("reader", GOOD)
@pytest.mark.parametrize("name", ENCODINGS)
def test_a_file_in_the_encoding_that_it_declares_is_read(reader, name, tmp_path):
    """Names have the same letters, and poses are the same as those of the text."""
    text = GOOD[reader].partition("?>")[2].replace("upper", "Füße")
    path = tmp_path / "a.xml"
    path.write_bytes(f'<?xml version="1.0" encoding="{name}"?>{text}'.encode(ENCODINGS[name]))
    robot, expected = reader.read(path), reader.parse(text)
    assert "Füße" in robot.articulation.names
    assert robot.articulation.names == expected.articulation.names
    assert robot.home.tolist() == expected.home.tolist()


@pytest.mark.parametrize("encoding", ["utf-7", "unicode_escape", "hex", "iso-8859-12", "gb2312"])
def test_other_encodings_than_utf_8_are_refused(encoding, refusal, tmp_path):
    path = tmp_path / "a.xml"
    path.write_bytes(
        f'<?xml version="1.0" encoding="{encoding}"?><robot name="\xfc"/>'.encode("l1")
    )
    assert "expected UTF-8, got byte 0xfc at offset" in refusal(urdf.read, path)
