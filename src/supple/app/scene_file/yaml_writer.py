"""Writing data as a scene file that `read_yaml` reads back unchanged."""

from __future__ import annotations

from typing import Any

import yaml

from supple.app.scene_file.yaml_reader import SceneLoader


class _Dumper(yaml.SafeDumper):
    """PyYAML's writer by the rules of YAML 1.2: the text `1e5` gets quotes, because it would be read as a number."""

    yaml_implicit_resolvers = SceneLoader.yaml_implicit_resolvers

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, value: str) -> yaml.Node:
    # Between other quotes, PyYAML writes these line breaks of Unicode as they are, and reads them as spaces.
    style = '"' if any(character in value for character in "\x85\u2028\u2029") else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)


_Dumper.add_representer(str, _text)


def yaml_text(data: Any) -> str:
    """Plain data (None, true, false, numbers, texts, lists, mappings) as YAML, with keys in their order."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
