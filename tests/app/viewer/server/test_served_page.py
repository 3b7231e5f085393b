"""The page that browsers get is that of viser's client with our title, style and script."""

import gzip
from types import SimpleNamespace

import pytest

from supple.app.viewer.server.page import served_page
from supple.app.viewer.server.page.served_page import ServedPage
from supple.errors import OutputError


def answer(encoding="identity", kind="text/html; charset=utf-8", status=200):
    headers = {"Content-Type": kind, "Content-Encoding": encoding, "Content-Length": "3"}
    return SimpleNamespace(status_code=status, headers=headers, body=b"old")


def test_the_page_is_replaced_plain_and_packed():
    page = ServedPage("<a> & b")
    plain, packed = answer(), answer("gzip")
    page.replace(plain)
    page.replace(packed)
    text = plain.body.decode()
    assert "<title>&lt;a&gt; &amp; b · Supple</title>" in text
    assert "suppleChanges(code)" in text
    assert "#supple-layer" in text
    assert gzip.decompress(packed.body) == plain.body
    assert [int(each.headers["Content-Length"]) for each in (plain, packed)] == [len(plain.body), len(packed.body)]


def test_other_answers_are_not_changed():
    for other in (answer(kind="image/png"), answer(status=403)):
        ServedPage("x").replace(other)
        assert (other.body, other.headers["Content-Length"]) == (b"old", "3")


def test_another_client_of_viser_is_an_error(monkeypatch):
    monkeypatch.setattr(served_page, "_client", lambda: "<title>Viser</title><script>run(code)</script>")
    with pytest.raises(OutputError, match=r"install viser 1\.1\.1"):
        ServedPage("x")
