"""The child process that draws a .gif or .mp4: `python -m supple.results.export.video_worker RECORDING OUTPUT`."""

from __future__ import annotations

import errno
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SuppleError
from supple.results.drawing import evenly, obstacle_pictures, pictures, vertex_normals, view_of
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording, read_recording

_ANGLE = 30.0  # of the camera, upwards [degrees]
_SIZES = {"gif": (480, 360), "mp4": (960, 720)}
_RATES = {"gif": 20.0, "mp4": 60.0}  # most frames per second
_MOST_FRAMES = {"gif": 400, "mp4": 10_000}


def draw(recording: Recording, frames: list[RecordedFrame], size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    """Each frame as a picture (height, width, 3), from one viewpoint that shows the whole recording."""
    import pyvista

    view = view_of(recording)
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="three lights")
    plotter.set_background("#eef1f5", top="#ffffff")  # pyright: ignore[reportArgumentType]
    moving = []
    for picture in pictures(recording):
        mesh = _polydata(pyvista, picture.at(frames[0]), picture.triangles)
        color = [c / 255.0 for c in picture.color]
        actor = plotter.add_mesh(mesh, color=color, specular=0.4, specular_power=25, ambient=0.15)
        actor.prop.interpolation = "phong"  # uses the normals that are set for each frame below
        moving.append((mesh, picture, True))
    for obstacle in obstacle_pictures(recording.obstacles, view):
        mesh = _polydata(pyvista, obstacle.at(frames[0]), obstacle.triangles)
        plotter.add_mesh(mesh, color=[c / 255.0 for c in obstacle.color], opacity=obstacle.opacity, ambient=0.3)
        moving.append((mesh, obstacle, False))
    camera = plotter.camera
    camera.position, camera.focal_point, camera.up = tuple(view.eye(_ANGLE)), tuple(view.center), tuple(view.up)
    camera.view_angle = _ANGLE
    plotter.reset_camera_clipping_range()
    for frame in frames:
        for mesh, picture, smooth in moving:
            x = picture.at(frame)
            mesh.points = x.astype(np.float32)
            if smooth:
                mesh.point_data["Normals"] = vertex_normals(x, picture.triangles).astype(np.float32)
                mesh.GetPointData().SetActiveNormals("Normals")
        plotter.reset_camera_clipping_range()
        plotter.render()
        image = np.asarray(plotter.screenshot(None, return_img=True))
        yield np.ascontiguousarray(image[..., :3])
    plotter.close()


def _polydata(pyvista: Any, x: NDArray[np.float64], triangles: NDArray[np.int32]) -> Any:
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    return pyvista.PolyData(x.astype(np.float32), faces)


def write(source: Path, output: Path) -> None:
    """Draw a recording to a file, .gif or .mp4."""
    kind = output.suffix[1:].lower()
    with read_recording(source) as recording:
        duration = max(float(recording.times[-1] - recording.times[0]), recording.dt)
        count = min(_MOST_FRAMES[kind], max(2, round(duration * _RATES[kind]) + 1))
        frames = evenly(recording, count)
        rate = max((len(frames) - 1) / duration, 1.0)
        images = draw(recording, frames, _SIZES[kind])
        if kind == "gif":
            _write_gif(images, output, rate)
        else:
            _write_mp4(images, output, rate, _SIZES[kind])


def _write_gif(images: Iterator[NDArray[np.uint8]], output: Path, rate: float) -> None:
    from PIL import Image

    pages = [Image.fromarray(image).quantize(128, dither=Image.Dither.NONE) for image in images]
    # GIF has a time unit of a hundredth of a second.
    duration = max(20, round(100.0 / rate) * 10)
    pages[0].save(output, format="GIF", save_all=True, append_images=pages[1:], duration=duration, loop=0)


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
    source, output = arguments
    try:
        write(Path(source), Path(output))
    except SuppleError as error:
        return _fail(str(error))
    except OSError as error:
        return _fail(f"cannot be written: {error.strerror or error}; choose another place or make room there")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
