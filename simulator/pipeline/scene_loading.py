"""Reading of a shot's scene; the last one is kept, so that another frame or window of it does not read it again."""

import os
from collections.abc import Hashable
from dataclasses import replace
from threading import Lock

from simulator.errors import PhotositeError
from simulator.optics.geometry.surroundings import surround
from simulator.pipeline.shot import SceneSource, Shot
from simulator.scene.alpha import cover_light
from simulator.scene.content_keys import freeze, is_ours
from simulator.scene.scene import Scene

LARGEST_BYTES = 2**29  # of a scene that is kept
_kept: tuple[Hashable, Scene] | None = None
_lock = Lock()


def load_scene(source: SceneSource) -> Scene:
    """Return the scene of a source, all light of its layers with some coverage (`cover_light`).

    That of the simulator's own sources cannot be written to.

    The last scene is kept while its source and files are the same and it takes at most LARGEST_BYTES, and let go before another
    is read; a source that is a `Scene` itself reads nothing. Raises PhotositeError and OSError as the source does.
    """
    global _kept
    if isinstance(source, Scene):
        return _cover_light(source.load())
    key = _key_of(source)
    with _lock:
        if key is not None and _kept is not None and _kept[0] == key:
            return _kept[1]
        _kept = None
    scene = _cover_light(source.load())
    if key is None:
        return scene
    for array in scene.arrays():
        array.setflags(write=False)
    if sum(array.nbytes for array in scene.arrays()) <= LARGEST_BYTES:
        with _lock:
            _kept = key, scene
    return scene


def load_seen(shot: Shot) -> Scene:
    """Return the scene of a shot, filled as it asks for where the camera sees past its edge.

    Raises PhotositeError as `load_scene` does, and for things that move in a scene that had to be filled.
    """
    scene = load_scene(shot.scene)
    seen = surround(scene, shot.lens, shot.camera)
    if seen is not scene and shot.motion is not None and (shot.motion.layers or shot.motion.vectors is not None):
        rule = "things that move are told in the pixels of the scene alone; make the pictures larger than what the camera sees"
        raise PhotositeError(rule, key="scene.outside", value=scene.outside)
    return seen


def _cover_light(scene: Scene) -> Scene:
    """Return the scene with coverage of at least LEAST_COVERAGE where a layer has light; the scene itself where it has that."""
    if all(layer.coverage is None for layer in scene.layers):
        return scene

    def make() -> Scene | None:
        covered = []
        for layer in scene.layers:
            coverage = cover_light(layer.planes, layer.coverage)
            if coverage is not None and coverage is not layer.coverage:
                coverage.setflags(write=False)  # so that plans are kept with a scene that cannot be written to
            covered.append(replace(layer, coverage=coverage))
        is_same = all(one.coverage is layer.coverage for one, layer in zip(covered, scene.layers, strict=True))
        return None if is_same else scene.with_layers(covered)  # a scene that kept itself would not be let go

    made = scene.remember("covered light", make)
    return scene if made is None else made


def _key_of(source: SceneSource) -> Hashable | None:
    """Return the key of a source in this process; None where nothing tells whether it gives the same scene again."""
    if not is_ours(source):
        return None
    try:
        return os.getpid(), freeze(source)
    except OSError:  # a file has gone: the source says so
        return None
