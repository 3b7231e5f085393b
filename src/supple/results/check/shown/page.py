"""A report as a page of HTML in one file, with the picture in it."""

from __future__ import annotations

import base64
import html
import tempfile
from pathlib import Path

from supple.results.check.report import CheckReport
from supple.results.check.shown.picture import draw
from supple.runtime.replacing import whole_file

_STYLE = """body{font:16px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:62rem;padding:0 1rem;color:#222}
table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:.3rem .6rem;border-bottom:1px solid #ddd;
vertical-align:top}.pass{color:#2a7d36}.fail{color:#b3121d;font-weight:600}.skipped{color:#777}img{max-width:100%}
h1{font-size:1.3rem}td.n{text-align:right;white-space:nowrap}"""


def write_page(report: CheckReport, output: Path) -> Path:
    """Write the page.

    Raises
    ------
    OutputError : where it cannot be written.
    """
    verdict = "pass" if report.ok else "fail"
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content='width=device-width'>",
        f"<title>supple check: {html.escape(str(report.path))}</title><style>{_STYLE}</style>",
        f"<h1 class={verdict}>{html.escape(report.verdict)}</h1>",
    ]
    if report.place is not None:
        with tempfile.TemporaryDirectory() as folder:
            picture = draw(report.place, Path(folder) / "place.png").read_bytes()
        text = html.escape(report.place.title, quote=True)
        parts.append(f'<img alt="{text}" src="data:image/png;base64,{base64.b64encode(picture).decode()}">')
    parts.append("<table><tr><th>check<th>verdict<th>found<th>frame<th>time [s]</tr>")
    for result in report.results:
        frame = "" if result.frame is None else str(result.frame)
        time = "" if result.time is None else f"{result.time:.6g}"
        parts.append(
            f"<tr><td>{result.name}<td class={result.verdict}>{result.verdict}<td>{html.escape(result.message)}"
            f"<td class=n>{frame}<td class=n>{time}</tr>"
        )
    parts.append("</table>")
    parts += [f"<p>{html.escape(note)}.</p>" for note in report.notes]
    with whole_file(output) as fresh:
        fresh.write_text("\n".join(parts) + "</html>\n", encoding="utf-8", newline="\n")
    return output
