"""The child process that draws a .gif, .mp4 or .png: `video_worker RECORDING OUTPUT FILM`, the last one as JSON."""

from __future__ import annotations

import errno
import json
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SuppleError
from supple.results.export.legend import legend
from supple.results.export.video import COLORS, Film
from supple.results.recording.reader import Recording, read_recording
from supple.results.view.bounds import View, box_corners
from supple.results.view.camera import direction_of, fitted, upright
from supple.results.view.fields import NOT_KNOWN_COLOR, Limits, Range, color_map, nodal_values
from supple.results.view.floor_shadow import floor_shadow
from supple.results.view.from_recording import evenly, model_of_recording, render_frame_of
from supple.results.view.joints import JOINT_COLOR, joint_segments, lines_of_joints
from supple.results.view.look import STITCH_COLOR, Color, Look, background, floor_disc, theme
from supple.results.view.model import Model, RenderFrame
from supple.results.view.normals import vertex_normals
from supple.results.view.occlusion import occlusion
from supple.results.view.surfaces import RigidSurface, SoftSurface, has_fields, surfaces_of

ANGLE = 30.0  # of the camera, upwards [degrees]
_MOST_FRAMES = {"gif": 600, "mp4": 20_000, "png": 1}
# Direction [share of the radius of the scene, across, up, ahead], color and strength of each light.
LIGHTS = (((2.0, 5.0, 3.0), "#fff3e2", 0.75), ((-4.0, 2.0, 2.0), "#dbe7ff", 0.4), ((0.5, 1.0, -4.0), "#ffffff", 0.25))
# Colors of a field must be found again in the legend: they have little shading.
_FIELD: Any = {"ambient": 0.62, "diffuse": 0.42, "specular": 0.0}
_SHADOW_CELLS, _FLOOR_CELLS = 256, 512
_SAMPLED = 24  # frames from which the ends of a color scale are found


class Pictures(ABC):
    """What the pictures of a recording show, and from where; how they are drawn is of a renderer.

    Parameters
    ----------
    render_frames : those that will be drawn, at least one
    """

    def __init__(self, model: Model, render_frames: list[RenderFrame], film: Film) -> None:
        self._film, self._view, self._distance = film, model.view, 0.0
        self._image: NDArray[np.uint8] | None = None
        self._drawn_from: list[NDArray[np.float64]] = []
        self._bodies = len(model.bodies)
        self._field = COLORS.get(film.color)
        self._limits = self._ends(render_frames)
        self._legend = None
        if self._field is not None and self._limits is not None:
            self._legend = legend(self._field, self._limits, film.size, theme(film.dark))
        # What a renderer keeps of each surface and of each set of lines (its `points` are set), and where they are.
        self._meshes: list[tuple[Any, SoftSurface | RigidSurface]] = []
        self._lines: list[tuple[Any, Callable[[RenderFrame], NDArray[np.float64]]]] = []

    def _surfaces(self, model: Model) -> Iterator[tuple[bool, SoftSurface | RigidSurface]]:
        """Each surface that is drawn but for floors, and whether its backs cannot be seen."""
        for number, flat in enumerate(surfaces_of(model, skins=self._film.surface == "skin", dark=self._film.dark)):
            if flat.is_floor:
                continue
            surface = flat.creased(model)
            if self._field is not None and number < len(model.bodies) and not has_fields(surface):
                surface = replace(surface, color=NOT_KNOWN_COLOR)  # it has no such values
            yield flat.hides_its_backs(model), surface

    def _ends(self, render_frames: list[RenderFrame]) -> tuple[float, float] | None:
        """Of the color scale, for the whole film."""
        if self._field is None:
            return None
        chosen = [render_frames[i] for i in evenly(len(render_frames), _SAMPLED)]
        return Limits(self._field, Range(fixed=self._film.range)).follow(
            np.concatenate([self._field.values(render_frame) for render_frame in chosen])
        )

    def picture(self, render_frame: RenderFrame, share: float) -> NDArray[np.uint8]:
        """(height, width, 3) of a frame, at a share of the film's length."""
        points = [surface.at(render_frame) for _, surface in self._meshes]
        nodal = None if self._field is None else nodal_values(render_frame, self._field.values(render_frame))
        camera = self._aim(np.concatenate(points[: self._bodies]), share)
        lines = [segments(render_frame).reshape(-1, 3) for _, segments in self._lines]
        inputs = [*points, *lines, camera, np.zeros(0) if nodal is None else nodal]
        # Where everything rests, the picture stays.
        if self._image is None or not all(map(np.array_equal, inputs, self._drawn_from)):
            for (mesh, _), x in zip(self._lines, lines, strict=True):
                mesh.points = x.astype(np.float32)
            self._drawn_from, self._image = inputs, self._with_legend(self._drawn(points, nodal))
        return self._image

    def _with_legend(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if self._legend is None:
            return image
        colors, opaque = self._legend
        return np.round(image * (1.0 - opaque) + colors * opaque).astype(np.uint8)

    def _aim(self, points: NDArray[np.float64], share: float) -> NDArray[np.float64]:
        """Place the camera; what determines its place."""
        center, away, distance = placed(self._film, self._view, points, share)
        # The largest so far, so that the size of the picture does not vary.
        self._distance = max(self._distance, distance)
        self._look(center + self._distance * away, center, upright(self._view.up, away))
        return np.array([*center, *away, self._distance])

    @abstractmethod
    def _look(self, eye: NDArray[np.float64], target: NDArray[np.float64], up: NDArray[np.float64]) -> None:
        """Place the camera at a point (3,), towards another one [m]."""

    @abstractmethod
    def _drawn(self, points: list[NDArray[np.float64]], nodal: NDArray[np.float64] | None) -> NDArray[np.uint8]:
        """(height, width, 3) with these points of the surfaces and values of vertices, without the legend."""


class Studio(Pictures):
    """A scene of VTK with all surfaces of a recording, and its camera."""

    def __init__(self, model: Model, render_frames: list[RenderFrame], film: Film) -> None:
        import pyvista

        super().__init__(model, render_frames, film)
        self._plotter = plotter = pyvista.Plotter(off_screen=True, window_size=list(film.size), lighting="none")
        shown = theme(film.dark)
        plotter.set_background(_share(shown.bottom), top=_share(shown.top))  # pyright: ignore[reportArgumentType]
        plotter.enable_anti_aliasing("msaa", multi_samples=4)
        self._add_lights(pyvista)
        self._shaded, ends = film.shadows, self._limits
        for closed, surface in self._surfaces(model):
            mesh = pyvista.PolyData.from_regular_faces(surface.at(render_frames[0]), surface.triangles)
            look: dict[str, Any] = _phong(surface.look) | {"color": _share(surface.color)}
            if self._field is not None and ends is not None and has_fields(surface):
                mesh.point_data["field"] = np.zeros(mesh.n_points)
                colors = {"cmap": color_map(self._field), "clim": ends, "show_scalar_bar": False}
                look = _FIELD | {"scalars": "field"} | colors
            elif self._shaded:
                mesh.point_data["color"] = np.tile(np.array(surface.color, dtype=np.uint8), (mesh.n_points, 1))
                look = _phong(surface.look) | {"scalars": "color", "rgb": True}
            inner = surface.container
            opacity = 1.0 if inner else surface.opacity
            # Sides that cannot be seen are not drawn: a third of the time of a renderer on a processor.
            hidden = "front" if inner else "back" if closed else None
            actor = plotter.add_mesh(mesh, opacity=opacity, culling=hidden, **look)
            actor.prop.interpolation = "phong"  # uses the normals that are set for each frame
            self._meshes.append((mesh, surface))
        self._lines = [
            (self._add_lines(pyvista, segments(render_frames[0]), color), segments)
            for segments, color in (connections(model) if film.connections else [])
        ]
        floor = floor_shadow(model, _SHADOW_CELLS)
        self._shadow = floor if film.shadows else None
        if floor is not None:
            self._add_picture(pyvista, floor.disc, floor_disc(film.dark, _FLOOR_CELLS))
        self._floor: Any = None if floor is None else self._add_picture(pyvista, floor.corners, floor.picture([]))
        plotter.show(auto_close=False, interactive=False)  # pyvista renders nothing before

    def _add_lights(self, pyvista: Any) -> None:
        center, radius, axes = self._view.center, self._view.radius, axes_of(self._view)
        for direction, color, strength in LIGHTS:
            place = center + radius * np.array(direction) @ axes
            self._plotter.add_light(
                pyvista.Light(position=tuple(place), focal_point=tuple(center), color=color, intensity=strength)
            )

    def _add_picture(self, pyvista: Any, corners: NDArray[np.float64], image: NDArray[np.uint8]) -> Any:
        mesh = pyvista.PolyData(corners, np.array([4, 0, 1, 2, 3]))
        mesh.active_texture_coordinates = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
        return self._plotter.add_mesh(mesh, texture=_texture(image), lighting=False)

    def _add_lines(self, pyvista: Any, segments: NDArray[np.float64], color: Color) -> Any:
        ends = np.column_stack([np.full(len(segments), 2), np.arange(2 * len(segments)).reshape(-1, 2)])
        mesh = pyvista.PolyData(segments.reshape(-1, 3), lines=ends.ravel())
        width = max(1.0, self._film.size[1] / 240.0)
        self._plotter.add_mesh(mesh, color=_share(color), line_width=width, lighting=False)
        return mesh

    def _drawn(self, points: list[NDArray[np.float64]], nodal: NDArray[np.float64] | None) -> NDArray[np.uint8]:
        """(height, width, 3) with these points of the surfaces and values of vertices."""
        normals = []
        for (mesh, surface), x in zip(self._meshes, points, strict=True):
            mesh.points = x.astype(np.float32)
            normals.append(vertex_normals(x, surface.triangles))
            mesh.point_data["Normals"] = normals[-1].astype(np.float32)
            mesh.GetPointData().SetActiveNormals("Normals")
            if nodal is not None and "field" in mesh.point_data and isinstance(surface, SoftSurface):
                mesh.point_data["field"] = surface.of(np.repeat(nodal[:, None], 3, axis=1))[:, 0]
        if self._shaded:
            self._shade(points, normals)
        if self._shadow is not None:
            drawn = zip(points, (surface for _, surface in self._meshes), strict=True)
            cast = [(x, surface.triangles) for x, surface in drawn if surface.casts_shadow]
            self._floor.texture = _texture(self._shadow.picture(cast))
        self._plotter.reset_camera_clipping_range()
        self._plotter.render()
        return np.ascontiguousarray(self._plotter.image[..., :3])  # `screenshot` would render it once more

    def _shade(self, points: list[NDArray[np.float64]], normals: list[NDArray[np.float64]]) -> None:
        """Darken what little light reaches."""
        surfaces = [surface for _, surface in self._meshes]
        facing = [-n if surface.container else n for n, surface in zip(normals, surfaces, strict=True)]
        drawn = [(x, surface.triangles, n) for x, surface, n in zip(points, surfaces, facing, strict=True)]
        layers = [surface.layers for surface in surfaces]
        for (mesh, surface), dark in zip(self._meshes, occlusion(drawn, self._bodies, layers), strict=True):
            if "color" in mesh.point_data:
                light = (1.0 - dark)[:, None] * np.array(surface.color)
                mesh.point_data["color"] = light.astype(np.uint8)

    def _look(self, eye: NDArray[np.float64], target: NDArray[np.float64], up: NDArray[np.float64]) -> None:
        camera = self._plotter.camera
        camera.position, camera.focal_point, camera.up = tuple(eye), tuple(target), tuple(up)
        camera.view_angle = ANGLE


def axes_of(view: View) -> NDArray[np.float64]:
    """(3, 3) rows: across, up, and ahead to the camera of the usual view. Lights do not move with the camera."""
    ahead = direction_of("corner", view)
    ahead -= float(ahead @ view.up) * view.up
    ahead /= np.linalg.norm(ahead)
    return np.stack([np.cross(view.up, ahead), view.up, ahead])


def connections(model: Model) -> list[tuple[Callable[[RenderFrame], NDArray[np.float64]], Color]]:
    """The lines (k, 2, 3) of stitches and of joints at a frame [m], and their colors."""
    found: list[tuple[Callable[[RenderFrame], NDArray[np.float64]], Color]] = []
    if len(model.stitches):
        found.append((lambda render_frame: render_frame.stitch_segments, STITCH_COLOR))
    if model.joints:
        lines = lines_of_joints(model)
        found.append((lambda render_frame: joint_segments(render_frame, lines), JOINT_COLOR))
    return found


_Vector = NDArray[np.float64]


def placed(film: Film, view: View, points: _Vector, share: float) -> tuple[_Vector, _Vector, float]:
    """Where the camera is, at a share of the film's length: as given, or so that the whole motion fills the picture.

    Returns
    -------
    The point (3,) at which it looks [m], the unit vector (3,) to the camera, and its distance [m]. Of a camera that
    follows, the bodies at points (k, 3) fill the picture.
    """
    u, target = view.up, np.array(film.target)
    away = direction_of(film.view, view) if film.eye is None else np.array(film.eye) - target
    distance = float(np.linalg.norm(away))
    away = away / distance
    if film.camera == "orbit":
        angle = 2.0 * np.pi * share
        away = np.cos(angle) * away + np.sin(angle) * np.cross(u, away) + (1 - np.cos(angle)) * (u @ away) * u
    if film.eye is not None:
        return target, away, distance
    visible = view.outline
    if film.camera == "follow":
        visible = box_corners(points.min(axis=0), points.max(axis=0))
    slope = float(np.tan(np.radians(0.5 * ANGLE)))
    slopes = (slope * film.size[0] / film.size[1], slope)
    center, distance = fitted(visible, away, u, slopes, centered=film.camera == "fit")
    return center, away, max(distance, view.radius * 1e-3)


def _share(color: Color) -> list[float]:
    return [channel / 255.0 for channel in color]


def _phong(look: Look) -> dict[str, Any]:
    return {"ambient": look.ambient, "diffuse": look.diffuse, "specular": look.specular, "specular_power": look.power}


def _texture(image: NDArray[np.uint8]) -> Any:
    import pyvista

    texture = pyvista.Texture(np.ascontiguousarray(image[::-1]))  # its first row is the upper one
    texture.interpolate = True
    return texture


Renderer = Callable[[Model, list[RenderFrame], Film], Pictures]


def write(source: Path, output: Path, film: Film, renderer: Renderer) -> None:
    """Draw a recording to a file: .gif, .mp4, or .png of one instant."""
    kind = output.suffix[1:].lower()
    with read_recording(source) as recording:
        numbers, rate = _chosen(recording, film, kind)
        model = model_of_recording(recording)
        render_frames = [render_frame_of(model, recording[k]) for k in numbers]
        studio = renderer(model, render_frames, film)
        images = (
            studio.picture(render_frame, k / max(1, len(render_frames) - 1))
            for k, render_frame in enumerate(render_frames)
        )
        if kind == "png":
            from PIL import Image

            Image.fromarray(next(images)).save(output, format="PNG")
        elif kind == "gif":
            _write_gif(images, output, rate, film)
        else:
            _write_mp4(images, output, rate, film.size)


def _chosen(recording: Recording, film: Film, kind: str) -> tuple[list[int], float]:
    """The frames that are drawn, and how many of them a second."""
    times = recording.times
    if kind == "png":
        wanted = times[-1] if film.time is None else film.time
        return [int(np.argmin(np.abs(times - wanted)))], 1.0
    duration = film.slow * max(float(times[-1] - times[0]), recording.dt)
    count = min(_MOST_FRAMES[kind], max(2, round(duration * film.rate) + 1))
    places = np.linspace(times[0], times[-1], count)
    nearest = np.searchsorted(0.5 * (times[1:] + times[:-1]), places)
    return [int(k) for k in nearest], max((count - 1) / duration, 1.0)


# Thresholds of ordered dithering, from -6 to 6.
_PATTERN = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]], dtype=np.int16) * 12 // 15 - 6


def palette_of(image: Any, dark: bool) -> Any:
    """A palette for a picture: 64 colors of the background, which fades, and 192 of what is before it."""
    from PIL import Image

    own = image.quantize(192, method=Image.Quantize.MAXCOVERAGE, kmeans=4).getpalette()[: 3 * 192]
    made = Image.new("P", (1, 1))
    made.putpalette(own + background(dark, 64)[:, 0].ravel().tolist())
    return made


def _write_gif(images: Iterator[NDArray[np.uint8]], output: Path, rate: float, film: Film) -> None:
    """One palette for all pages, from a page of several render_frames: one for each page would flicker."""
    from PIL import Image

    pages = [Image.fromarray(image) for image in images]
    page_columns, page_rows = pages[0].size
    sheet = np.concatenate([np.asarray(pages[i]) for i in evenly(len(pages), 6)])
    palette = palette_of(Image.fromarray(sheet), film.dark)
    # A pattern that stands still hides the steps between colors; errors that spread would flicker.
    pattern = np.tile(_PATTERN, (page_rows // 4 + 1, page_columns // 4 + 1))[:page_rows, :page_columns, None]
    drawn = []
    for page in pages:
        dithered = np.clip(np.asarray(page).astype(np.int16) + pattern, 0, 255).astype(np.uint8)
        drawn.append(Image.fromarray(dithered).quantize(palette=palette, dither=Image.Dither.NONE))
    # GIF has a time unit of a hundredth of a second.
    duration = max(20, round(100.0 / rate) * 10)
    drawn[0].save(output, format="GIF", save_all=True, append_images=drawn[1:], duration=duration, loop=0)


def _write_mp4(images: Iterator[NDArray[np.uint8]], output: Path, rate: float, size: tuple[int, int]) -> None:
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(output),
        size,
        fps=rate,  # pyright: ignore[reportArgumentType]
        codec="libx264",
        quality=7,
        output_params=["-f", "mp4", "-movflags", "+faststart", "-preset", "veryfast"],
    )
    writer.send(None)
    sent = 0
    for sent, image in enumerate(images, start=1):
        try:
            writer.send(image)
        except OSError:  # its text is the whole command of ffmpeg
            raise OSError(errno.EIO, f"ffmpeg ended at frame {sent}; can the file be made there?") from None
    writer.close()
    # The writer does not report whether ffmpeg could write all frames.
    try:
        written = imageio_ffmpeg.count_frames_and_secs(str(output))[0]
    except RuntimeError:
        written = 0
    if written != sent:
        raise OSError(errno.EIO, f"ffmpeg wrote {written} of {sent} frames; is there room?")


def main(arguments: list[str], renderer: Renderer = Studio) -> int:
    source, output, film = arguments
    try:
        write(Path(source), Path(output), Film(**json.loads(film)), renderer)
        return 0
    except SuppleError as error:
        reason = str(error)
    except OSError as error:
        reason = f"cannot be written: {error.strerror or error}; choose another place or make room there"
    print(f"video: {' '.join(reason.split())}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
