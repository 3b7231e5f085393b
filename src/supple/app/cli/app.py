"""The command `supple`: runs a subcommand, and reports every expected error as one line and an exit code."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from typing import TextIO

from cyclopts import App
from cyclopts.exceptions import CycloptsError

from supple import __version__
from supple.app.cli.console import ExitCode, ShellConsole, print_error, set_up_log
from supple.app.cli.interrupts import ended_as_by_ctrl_c
from supple.errors import SuppleError
from supple.results.progress import CompileBar

app = App(
    name="supple",
    help="Tetrahedral soft bodies: a surface mesh goes in, a simulation that can be trusted comes out.",
    help_epilogue="Exit codes: 0 done, 1 a check, a claim or a --strict run failed, 2 the input or an option cannot "
    "be used, 3 the solver could not continue.",
    version=__version__,
    console=ShellConsole(),
    suppress_keyboard_interrupt=False,
    exit_on_error=False,
    print_error=False,
    verbose=False,
    result_action="return_value",
)

# Import paths: a command's module is imported when the command is used.
COMMANDS = {
    "demo": "supple.app.cli.commands.demo:demo",
    "new": "supple.app.cli.commands.new:new",
    "run": "supple.app.cli.commands.run:run",
    "resume": "supple.app.cli.commands.resume:resume",
    "sweep": "supple.app.cli.commands.sweep:sweep",
    "view": "supple.app.cli.commands.view:view",
    "mesh": "supple.app.cli.commands.mesh:mesh",
    "export": "supple.app.cli.commands.export:export",
    "picture": "supple.app.cli.commands.picture:picture",
    "check": "supple.app.cli.commands.check:check",
    "plot": "supple.app.cli.commands.plot:plot",
    "fit": "supple.app.cli.commands.fit:fit",
    "check-gradient": "supple.app.cli.commands.fit:check_gradient",
    "table": "supple.app.cli.commands.table:table",
    "schema": "supple.app.cli.commands.schema:schema",
    "info": "supple.app.cli.commands.info:info",
    "warm": "supple.app.cli.commands.warm:warm",
}


def register(name: str, path: str) -> None:
    """Make a command known by its name; path : "module:function", imported when the command is used."""
    COMMANDS[name] = path
    app.command(path, name=name, sort_key=list(COMMANDS).index(name))


for _name, _path in COMMANDS.items():
    register(_name, _path)


def _flush(stream: TextIO | None) -> None:
    if stream is not None:  # None where the caller has closed it
        stream.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `supple` with the given arguments, or those of the process; returns the exit code."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    set_up_log(quiet=bool({"-q", "--quiet"}.intersection(given)))
    for text in given:
        if any("\ud800" <= character <= "\udfff" for character in text):  # Python's sign for a byte that is not UTF-8
            print_error(f"{text}: is not in UTF-8, and no scene file or recording could name it; rename it")
            return ExitCode.INPUT
    if not given or given[0] not in COMMANDS:
        for name in COMMANDS:
            _ = app[name]  # imports it, so that the list of commands shows their descriptions
    try:
        with ended_as_by_ctrl_c(), CompileBar():
            code = app(given)
        _flush(sys.stdout)
    except SuppleError as error:
        print_error(str(error))
        return ExitCode.INPUT
    except CycloptsError as error:
        command = f" {error.command_chain[0]}" if error.command_chain else ""
        print_error(f"{str(error).rstrip(' .')}; see supple{command} --help")
        return ExitCode.INPUT
    except KeyboardInterrupt:
        print_error("interrupted")
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        # Python flushes stdout once more when it exits; redirect that to nowhere.
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.BROKEN_PIPE
    except MemoryError as error:
        print_error(f"there is not enough memory for this: {error or 'make the meshes coarser'}")
        return ExitCode.INPUT
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print_error(f"{where}{error.strerror or error}")
        return ExitCode.INPUT
    return ExitCode.OK if code is None else int(code)
