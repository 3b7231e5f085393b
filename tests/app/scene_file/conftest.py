"""A scene file in a folder of its own."""

import pytest

from supple.app.scene_file.loader import load_run


@pytest.fixture
def load(tmp_path):
    def loader(text, function=load_run):
        path = tmp_path / "scene.yaml"
        path.write_text(text, encoding="utf-8")
        return function(path)

    return loader
