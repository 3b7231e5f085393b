"""The text of the folder "Measures": a step that did not converge is a red line, and names are shown as they are."""

from dataclasses import replace

from supple.app.viewer.controls.measures import measures_text


def test_a_step_that_did_not_converge_is_a_red_line(fake):
    snapshot = fake.latest()
    assert "span" not in measures_text(snapshot)
    message = "12 tets of body '<b>x</b>' inverted at t = 1.2 s; take substeps=60"
    bad = replace(snapshot, measures=replace(snapshot.measures, status="inverted", message=message))
    line = measures_text(bad).splitlines()[-1]
    assert line.startswith('<span style="color: #d92b2b">inverted: 12 tets of body ')
    assert "<b>" not in line
    assert "substeps=60" in line
