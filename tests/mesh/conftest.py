"""A surface, a body, and helpers that write files and read errors."""

from supple.mesh import shapes

BALL = shapes.sphere_surface(0.3, 0.2).transformed(translation=(1.0, 2.0, 3.0))
BODY = shapes.box((1.0, 0.1, 1 / 3), (3, 1, 2))
SQUARE = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"


def write(path, content):
    """Write text or bytes."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def the_only_line(error):
    text = str(error.value)
    assert "\n" not in text
    assert len(text) < 400
    assert text.isprintable()
    return text
