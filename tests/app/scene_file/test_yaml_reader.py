"""YAML 1.2, and the line of each value."""

import math

import pytest

import supple as sp
from supple.app.scene_file.yaml_files import MAX_BYTES, key_text, read_yaml


@pytest.fixture
def read(tmp_path):
    def reader(text):
        path = tmp_path / "file.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_yaml(path)

    return reader


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e5", 1e5),
        ("-1.5E-3", -1.5e-3),
        ("1.", 1.0),
        (".5", 0.5),
        ("+7", 7),
        ("010", 10),
        ("0x10", 16),
        ("0o17", 15),
        ("no", "no"),
        ("on", "on"),
        ("1:30", "1:30"),
        ("2024-01-01", "2024-01-01"),
        ("1_000", "1_000"),
        ("e5", "e5"),
        (".", "."),
        ("'1e5'", "1e5"),
        ("true", True),
        ("False", False),
        ("~", None),
        ("", None),
        ("-.inf", -math.inf),
        ("!!float 3", 3.0),
    ],
)
def test_scalars_follow_yaml_1_2(read, text, value):
    got = read(f"x: {text}\n").data["x"]
    assert got == value
    assert type(got) is type(value)


def test_nan_is_a_number(read):
    assert math.isnan(read("x: .nan\n").data["x"])


def test_aliases_and_byte_order_marks(read):
    document = read(b"\xef\xbb\xbfjelly: &j {youngs: 1e4}\nbodies: [{material: *j}]\n")
    assert document.data["bodies"][0]["material"] == {"youngs": 1e4}
    assert document.line(["bodies", 0, "material"]) == 2


def test_every_value_has_a_line(read):
    document = read("a:\n  b:\n    - 1\n    -\n      c: 2\nd: 3\n")
    assert document.line([]) == 1
    assert document.line(["a", "b"]) == 2
    assert document.line(["a", "b", 0]) == 3
    assert document.line(["a", "b", 1, "c"]) == 5
    assert document.line(["a", "nothing", "here"]) == 1
    assert document.line(["d"]) == 6
    assert str(document.error(["a", "b", 1, "c"], "is odd")).endswith("file.yaml:5: a.b[1].c: is odd")
    assert key_text(("bodies", 0, "material", "youngs")) == "bodies[0].material.youngs"


BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join(['*' + before] * 10)}]\n" for before, name in zip("abcdefg", "bcdefgh", strict=True)
)

BAD = [
    ("a: 1\na: 2\n", 2, "the key `a` is also on line 1"),
    ("a: {b: 1, c: 2, b: 3}\n", 1, "the key `b`"),
    ("a:\n\t- 1\n", 2, "indent with spaces"),
    ("a: [1, 2\n", 2, "not valid YAML"),
    ("a: 'open\n", 2, "not valid YAML"),
    ("a: b: c\n", 1, "a `:` is not allowed here"),
    ("a: *nothing\n", 1, "undefined alias"),
    ("a: &a [*a]\n", 1, "an alias is inside the value that it refers to"),
    ("a: !!python/object/apply:os.system ['true']\n", 1, "tag .* is not allowed"),
    ("a: !!python/name:os.system\n", 1, "tag .* is not allowed"),
    ("a: !mine 1\n", 1, "the tag !mine is not allowed"),
    ("a: !!set {b}\n", 1, "the tag !!set is not allowed"),
    ("a: !!int abc\n", 1, "the tag !!int is not allowed"),
    ("1: a\n", 1, "the key 1 is not a text"),
    ("[1, 2]: a\n", 1, "the key is not a text"),
    ("a: 1\n---\nb: 2\n", 2, "a second document"),
    ("a: 1\x07\n", 1, "character 0x7 is not allowed"),
    (b"a: \xff\xfe\n", 1, "not UTF-8"),
    (b"a: 1\nb: caf\xe9\n", 2, "byte 0xe9"),
    ("a: " + "9" * 5000 + "\n", 1, "5000 digits"),
    (BOMB, None, "more than 1000000 values"),
    ("a: " + "[" * 80 + "]" * 80 + "\n", 1, "nested too deeply"),
    ("a: " + "[" * 100_000, None, "nested too deeply"),
    ("", None, "empty"),
    ("# only a comment\n", None, "empty"),
    (b"\x00\x01\x02\x03", 1, "character 0x0"),
]


@pytest.mark.parametrize(("text", "line", "words"), BAD, ids=range(len(BAD)))
def test_bad_yaml_is_an_error_of_one_line_with_its_place(read, tmp_path, text, line, words):
    with pytest.raises(sp.SceneError, match=words) as caught:
        read(text)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / 'file.yaml'}:")
    assert "\n" not in message
    assert message.isprintable()
    if line is not None:
        assert message.startswith(f"{tmp_path / 'file.yaml'}:{line}: ")


def test_unreadable_files(tmp_path):
    with pytest.raises(sp.SceneError, match="the file does not exist"):
        read_yaml(tmp_path / "absent.yaml")
    with pytest.raises(sp.SceneError, match="this is a folder"):
        read_yaml(tmp_path)
    with pytest.raises(sp.SceneError, match="cannot be read"):
        read_yaml("a\0b.yaml")
    large = tmp_path / "large.yaml"
    with large.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(sp.SceneError, match="larger than 8 MiB"):
        read_yaml(large)
