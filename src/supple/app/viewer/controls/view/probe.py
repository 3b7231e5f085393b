"""The value of the field at a place of a body that a visitor has chosen."""

from __future__ import annotations

from typing import Any

from supple.app.viewer.protocol.quantities import written
from supple.results.view.stage import Stage


class Probe:
    """A label at the tet on which a visitor has clicked with Shift, which moves with it.

    Parameters
    ----------
    server : of viser; stage : draws the bodies
    """

    def __init__(self, server: Any, stage: Stage) -> None:
        self._server, self._stage = server, stage
        self._tet: int | None = None
        self._label: Any = None
        stage.prepare_bodies(self._add_handlers)

    def refresh(self) -> None:
        """Update the label; it goes where no field is drawn, or the tet is gone."""
        stage, tet = self._stage, self._tet
        value = None if tet is None else stage.value_at(tet)
        if tet is None or value is None or stage.field is None:
            if self._label is not None:
                self._label.remove()
            self._label = self._tet = None
            return
        body = next(body.name for body in stage.model.bodies if body.tets.start <= tet < body.tets.stop)
        text = f"{written(value, stage.field.unit)} · {body}"
        place = tuple(stage.moment.finite_positions[stage.model.tets[tet]].mean(axis=0))
        if self._label is None:
            self._label = self._server.scene.add_label("/probe", text, position=place)
        else:
            self._label.text, self._label.position = text, place

    def _add_handlers(self, handles: list[Any]) -> None:
        for handle in handles:
            handle.on_click(modifier="shift")(self._clicked)

    async def _clicked(self, event: Any) -> None:
        self._tet = self._stage.tet_on_ray(event.ray_origin, event.ray_direction)
        self.refresh()
