"""The command line: help, versions, exit codes, pipes and errors of the operating system."""

import json
import os
import subprocess
import sys

import pytest
from jsonschema import Draft202012Validator

import supple as sp
from supple.app.cli import app as shell
from supple.app.cli.app import COMMANDS, main
from supple.app.cli.console import ExitCode


def test_version(capsys):
    assert main(["--version"]) == ExitCode.OK
    assert capsys.readouterr().out.strip() == sp.__version__


def test_help_lists_every_command(capsys):
    assert main(["--help"]) == ExitCode.OK
    out = capsys.readouterr().out
    for command in COMMANDS:
        line = next(line for line in out.splitlines() if line.strip("│ ").split(" ")[0] == command)
        assert len(line.strip("│ ").split()) > 2


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_a_help_text(command, capsys):
    assert main([command, "--help"]) == ExitCode.OK
    out = capsys.readouterr().out
    assert f"supple {command}" in out
    assert len(out.splitlines()) > 5


def test_no_arguments_show_the_help(capsys):
    assert main([]) == ExitCode.OK
    assert "run" in capsys.readouterr().out


def test_info_without_a_file_prints_versions(capsys):
    assert main(["info"]) == ExitCode.OK
    out = capsys.readouterr().out
    for word in ("supple", "python", "platform", "threads", "numba"):
        assert word in out


def test_schema_is_printed_or_written_to_a_file(tmp_path, capsys):
    assert main(["schema"]) == ExitCode.OK
    schema = json.loads(capsys.readouterr().out)
    Draft202012Validator.check_schema(schema)
    assert main(["schema", "-o", str(tmp_path / "new" / "scene.json")]) == ExitCode.OK
    assert json.loads((tmp_path / "new" / "scene.json").read_text(encoding="utf-8")) == schema


def test_the_schema_of_studies_is_printed_too(capsys):
    assert main(["schema", "study"]) == ExitCode.OK
    schema = json.loads(capsys.readouterr().out)
    Draft202012Validator.check_schema(schema)
    assert "supple_study" in schema["properties"]


def test_a_misspelt_command_gets_a_suggestion(capsys):
    assert main(["shema"]) == ExitCode.INPUT
    assert "schema" in capsys.readouterr().err


EXPECTED = [
    (PermissionError(13, "Permission denied", "out/x"), ExitCode.INPUT, "supple: out/x: Permission denied\n"),
    (OSError(28, "No space left on device"), ExitCode.INPUT, "supple: No space left on device\n"),
    (MemoryError("Unable to allocate 9 TiB"), ExitCode.INPUT, "not enough memory for this: Unable to allocate 9 TiB"),
    (KeyboardInterrupt(), ExitCode.INTERRUPTED, "supple: interrupted\n"),
    (sp.MeshError("two\nlines \x1b[31m"), ExitCode.INPUT, "supple: two lines \\x1b[31m\n"),
    (BrokenPipeError(), ExitCode.BROKEN_PIPE, ""),
]


@pytest.mark.parametrize(("error", "code", "message"), EXPECTED, ids=lambda value: type(value).__name__)
def test_an_error_of_the_system_is_one_line(error, code, message, monkeypatch, capsys):
    def fail(*arguments):
        raise error

    monkeypatch.setattr(shell, "app", fail)
    assert main(["run"]) == code
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == (1 if message else 0)


def test_unexpected_errors_are_not_caught(monkeypatch):
    def fail(*arguments):
        raise ZeroDivisionError

    monkeypatch.setattr(shell, "app", fail)
    with pytest.raises(ZeroDivisionError):
        main(["run"])


def supple(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "supple", *arguments], capture_output=True, text=True, timeout=120, **options
    )


def test_the_installed_command():
    done = supple("--version")
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, sp.__version__, "")
    done = supple("info", "absent.stl")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("supple: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(("arguments", "code"), [(["--version"], ExitCode.OK), (["shema"], ExitCode.INPUT)])
def test_closed_outputs_are_no_error(monkeypatch, arguments, code):
    """`supple ... >&- 2>&-`: Python sets both to None then."""
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", None)
    assert main(arguments) == code


@pytest.mark.skipif(os.name != "posix", reason="pipes end otherwise elsewhere")
@pytest.mark.parametrize("arguments", [["schema"]])
def test_a_closed_pipe_is_no_error(arguments):
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "supple", *arguments], stdout=writing, stderr=subprocess.PIPE, text=True, timeout=120
    )
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")
