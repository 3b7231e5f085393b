"""The child process that draws a .gif, .mp4 or .png: `video_worker RECORDING OUTPUT FILM`, the last one as JSON."""

from __future__ import annotations

import errno
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SuppleError
from supple.results.export.video import COLORS, Film
from supple.results.recording.reader import Recording, read_recording
from supple.results.view.camera import eye_of
from supple.results.view.fields import Field, Limits, Range
from supple.results.view.floor_shadow import FloorShadow, floor_shadow
from supple.results.view.from_recording import evenly, model_of_recording, moment_of_frame
from supple.results.view.model import Model, Moment
from supple.results.view.surfaces import RigidSurface, SoftSurface, surfaces_of, vertex_normals

_ANGLE = 30.0  # of the camera, upwards [degrees]
_MOST_FRAMES = {"gif": 600, "mp4": 20_000, "png": 1}
_BACKGROUND, _HORIZON = "#e3e8ef", "#fbfcfd"
# Direction [share of the radius of the scene, across, up, ahead], color and strength of each light.
_LIGHTS = (((2.0, 5.0, 3.0), "#fff3e2", 0.75), ((-4.0, 2.0, 2.0), "#dbe7ff", 0.4), ((0.5, 1.0, -4.0), "#ffffff", 0.25))
_BODY: Any = {"ambient": 0.28, "diffuse": 0.8, "specular": 0.25, "specular_power": 30}
_OBSTACLE: Any = {"ambient": 0.7, "diffuse": 0.55, "specular": 0.0}
_SHADOW_CELLS = 256
_MARGIN = 1.12  # of the distance of the camera: room beside the bodies
_SAMPLED = 24  # moments from which the ends of a color scale are found


class Studio:
    """A scene of VTK with all surfaces of a recording, and its camera."""

    def __init__(self, model: Model, moments: list[Moment], film: Film) -> None:
        import pyvista

        self._film, self._view, self._distance = film, model.view, 0.0
        self._plotter = plotter = pyvista.Plotter(off_screen=True, window_size=list(film.size), lighting="none")
        plotter.set_background(_BACKGROUND, top=_HORIZON)  # pyright: ignore[reportArgumentType]
        plotter.enable_anti_aliasing("msaa", multi_samples=4)
        self._add_lights(pyvista)
        self._field = COLORS.get(film.color)
        self._meshes: list[tuple[Any, SoftSurface | RigidSurface]] = []
        ends = self._ends(moments)
        for number, flat in enumerate(surfaces_of(model)):
            surface = flat.creased(model)
            mesh = pyvista.PolyData.from_regular_faces(surface.at(moments[0]), surface.triangles)
            look: dict[str, Any] = {"color": [c / 255.0 for c in surface.color]}
            if self._field is not None and ends is not None and isinstance(surface, SoftSurface):
                mesh.point_data["field"] = np.zeros(mesh.n_points)
                look = _scale(self._field, ends, film.size[0])
            room = surface.room
            opacity = 1.0 if room else surface.opacity
            actor = plotter.add_mesh(
                mesh, opacity=opacity, culling="front" if room else None, **look,
                **(_BODY if number < len(model.bodies) else _OBSTACLE),
            )  # fmt: skip
            actor.prop.interpolation = "phong"  # uses the normals that are set for each frame
            self._meshes.append((mesh, surface))
        self._bodies = len(model.bodies)
        self._shadow = floor_shadow(model, _SHADOW_CELLS) if film.shadows else None
        self._floor: Any = None if self._shadow is None else self._add_floor(pyvista, self._shadow)
        plotter.show(auto_close=False, interactive=False)  # pyvista renders nothing before

    def _add_lights(self, pyvista: Any) -> None:
        center, radius, up = self._view.center, self._view.radius, self._view.up
        ahead = self._view.eye(_ANGLE) - center
        ahead -= float(ahead @ up) * up
        ahead /= np.linalg.norm(ahead)
        axes = np.stack([np.cross(up, ahead), up, ahead])
        for direction, color, strength in _LIGHTS:
            place = center + radius * np.array(direction) @ axes
            self._plotter.add_light(
                pyvista.Light(position=tuple(place), focal_point=tuple(center), color=color, intensity=strength)
            )

    def _ends(self, moments: list[Moment]) -> tuple[float, float] | None:
        """Of the color scale, for the whole film."""
        if self._field is None:
            return None
        chosen = [moments[i] for i in evenly(len(moments), _SAMPLED)]
        return Limits(self._field, Range()).follow(np.concatenate([self._field.values(moment) for moment in chosen]))

    def _add_floor(self, pyvista: Any, shadow: FloorShadow) -> Any:
        mesh = pyvista.PolyData(shadow.corners, np.array([4, 0, 1, 2, 3]))
        mesh.active_texture_coordinates = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
        return self._plotter.add_mesh(mesh, texture=_texture(shadow.picture([])), lighting=False)

    def picture(self, moment: Moment, share: float) -> NDArray[np.uint8]:
        """(height, width, 3) of a moment, at a share of the film's length."""
        points = []
        nodal = _nodal(moment, self._field.values(moment)) if self._field is not None else None
        for mesh, surface in self._meshes:
            x = surface.at(moment)
            points.append(x)
            mesh.points = x.astype(np.float32)
            mesh.point_data["Normals"] = vertex_normals(x, surface.triangles).astype(np.float32)
            mesh.GetPointData().SetActiveNormals("Normals")
            if nodal is not None and "field" in mesh.point_data and isinstance(surface, SoftSurface):
                mesh.point_data["field"] = surface.of(nodal)[:, 0]
        if self._shadow is not None:
            drawn = zip(points, (surface for _, surface in self._meshes), strict=True)
            cast = [(x, surface.triangles) for x, surface in drawn if surface.casts_shadow]
            self._floor.texture = _texture(self._shadow.picture(cast))
        self._aim(np.concatenate(points[: self._bodies]), share)
        self._plotter.render()
        return np.ascontiguousarray(self._plotter.image[..., :3])  # `screenshot` would render it once more

    def _aim(self, points: NDArray[np.float64], share: float) -> None:
        """Place the camera so that the whole motion, or the bodies at points (k, 3), fill the picture."""
        view, film, u = self._view, self._film, self._view.up
        away = eye_of(film.view, view) - view.center
        away /= np.linalg.norm(away)
        if film.camera == "orbit":
            angle = 2.0 * np.pi * share
            away = np.cos(angle) * away + np.sin(angle) * np.cross(u, away) + (1 - np.cos(angle)) * (u @ away) * u
        low, high = view.low, view.high
        if film.camera == "follow":
            low, high = points.min(axis=0), points.max(axis=0)
        center = 0.5 * (low + high)
        right = np.cross(u, away) / np.linalg.norm(np.cross(u, away))
        axes = np.stack([right, np.cross(away, right), away])
        corners = np.stack(np.meshgrid(*np.stack([low, high], axis=1) - center[:, None]), axis=-1).reshape(-1, 3)
        across, above, along = (corners @ axes.T).T
        slope = np.tan(np.radians(0.5 * _ANGLE))
        needed = np.maximum(np.abs(across) * film.size[1] / film.size[0], np.abs(above)) / slope + along
        # The largest until now, so that the picture does not breathe.
        self._distance = max(self._distance, _MARGIN * float(needed.max()), view.radius * 1e-3)
        camera = self._plotter.camera
        camera.position, camera.focal_point = tuple(center + self._distance * away), tuple(center)
        camera.up, camera.view_angle = tuple(u), _ANGLE
        self._plotter.reset_camera_clipping_range()


def _scale(field: Field, ends: tuple[float, float], width: int) -> dict[str, Any]:
    """Colors by a field, and their legend in a picture of this width [pixels]."""
    title = f"{field.name} [{field.unit}]" if field.unit else field.name
    bar = {"title": title, "color": "#30343a", "vertical": True, "fmt": "%.3g", "title_font_size": max(9, width // 72)}
    bar |= {"position_x": 0.86, "position_y": 0.2, "width": 0.06, "height": 0.6}
    colors = "coolwarm" if field.center is not None else "viridis"
    return {"scalars": "field", "cmap": colors, "clim": ends, "scalar_bar_args": bar}


def _nodal(moment: Moment, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (n, 3), thrice the mean of the tets around each vertex; middle nodes have that of their neighbours."""
    model = moment.model
    known = np.asarray(np.isfinite(values))
    corners, own = model.tets[known].ravel(), np.repeat(values[known], 4)
    n = len(moment.positions)
    total, count = np.bincount(corners, own, minlength=n), np.bincount(corners, minlength=n)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    for body in model.bodies:  # a middle node is beside corners in the quarters of a side, but for the inner one
        triangles = body.triangles + body.vertices.start
        unknown = np.asarray(np.isnan(mean[triangles]))
        mixed = np.any(unknown, axis=1) & ~np.all(unknown, axis=1)
        around = np.repeat(np.nanmean(mean[triangles[mixed]], axis=1), unknown[mixed].sum(axis=1))
        rows = triangles[mixed][unknown[mixed]]
        times = np.bincount(rows, minlength=n)
        filled = np.bincount(rows, around, minlength=n) / np.maximum(times, 1)
        mean = np.where(np.isnan(mean) & (times > 0), filled, mean)
    return np.repeat(np.nan_to_num(mean)[:, None], 3, axis=1)


def _texture(image: NDArray[np.uint8]) -> Any:
    import pyvista

    texture = pyvista.Texture(np.ascontiguousarray(image[::-1]))  # its first row is the upper one
    texture.interpolate = True
    return texture


def write(source: Path, output: Path, film: Film) -> None:
    """Draw a recording to a file: .gif, .mp4, or .png of one moment."""
    kind = output.suffix[1:].lower()
    with read_recording(source) as recording:
        numbers, rate = _chosen(recording, film, kind)
        model = model_of_recording(recording)
        moments = [moment_of_frame(model, recording[k]) for k in numbers]
        studio = Studio(model, moments, film)
        images = (studio.picture(moment, k / max(1, len(moments) - 1)) for k, moment in enumerate(moments))
        if kind == "png":
            from PIL import Image

            Image.fromarray(next(images)).save(output, format="PNG")
        elif kind == "gif":
            _write_gif(images, output, rate)
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


def _write_gif(images: Iterator[NDArray[np.uint8]], output: Path, rate: float) -> None:
    """One palette for all pages, from a page of several moments: one for each page would flicker."""
    from PIL import Image

    pages = [Image.fromarray(image) for image in images]
    some = [pages[i] for i in evenly(len(pages), 6)]
    sheet = Image.new("RGB", (some[0].width, some[0].height * len(some)))
    for k, page in enumerate(some):
        sheet.paste(page, (0, k * page.height))
    palette = sheet.quantize(255, method=Image.Quantize.MAXCOVERAGE, kmeans=4)
    drawn = [page.quantize(palette=palette, dither=Image.Dither.NONE) for page in pages]
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
        output_params=["-f", "mp4", "-movflags", "+faststart"],
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


def _fail(reason: str) -> int:
    print(f"video: {' '.join(reason.split())}", file=sys.stderr)
    return 2


def main(arguments: list[str]) -> int:
    source, output, film = arguments
    try:
        write(Path(source), Path(output), Film(**json.loads(film)))
    except SuppleError as error:
        return _fail(str(error))
    except OSError as error:
        return _fail(f"cannot be written: {error.strerror or error}; choose another place or make room there")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
