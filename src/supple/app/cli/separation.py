"""`--separate`: bodies that intersect at the start are moved apart, and the moves are printed."""

from __future__ import annotations

from dataclasses import replace

from supple.app.scene_file.loader import Run


def moved_apart(described: Run) -> Run:
    """The run with its bodies moved apart; prints each move, also with --quiet.

    Raises
    ------
    SceneError : where small translations do not separate the bodies.
    """
    from rich.markup import escape

    from supple.app.cli.console import shell_console
    from supple.contact.start.separation import separate

    console = shell_console()
    separation = separate(described.scene, initial_positions=described.initial_positions)
    moves = [
        "moved body {!r} by ({:.6g}, {:.6g}, {:.6g}) m".format(move.body, *(move.shift + 0.0))
        for move in separation.moves
    ]
    for line in moves or ["nothing was moved: no surfaces intersect"]:
        console.print(escape(line))
    text = described.text
    if moves and text is not None:
        text = text.rstrip("\n") + "\n" + "".join(f"# supple run --separate {line}\n" for line in moves)
    return replace(described, scene=separation.scene, initial_positions=separation.initial_positions, text=text)
