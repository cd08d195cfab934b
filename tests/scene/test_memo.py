"""What was computed from a scene is kept with it, as long as nothing can change the scene."""

import copy
import pickle

import numpy as np
import pytest

from simulator.scene.memo import KEPT, Memo
from simulator.scene.scene import Scene


def grey_scene(*, read_only: bool) -> Scene:
    planes = np.ones((4, 6, 1), np.float32)
    planes.setflags(write=not read_only)
    return Scene(planes, np.ones((1, 2)), np.array([400.0, 700.0]), np.ones(2))


def test_a_result_is_made_once_for_each_key():
    memo, made = Memo(), []
    for key in ("a", "b", "a", "a", "b"):
        assert memo.get(key, lambda key=key: made.append(key) or key.upper()) == key.upper()
    assert made == ["a", "b"]


def test_only_the_last_results_are_kept():
    memo, made = Memo(), []
    for key in [*range(KEPT + 1), KEPT, 1, 0]:
        memo.get(key, lambda key=key: made.append(key))
    assert made == [*range(KEPT + 1), 0]  # the first one gave way to the last


@pytest.mark.parametrize("read_only", [True, False])
def test_a_scene_that_can_be_written_to_keeps_nothing(read_only):
    scene = grey_scene(read_only=read_only)
    sums = []
    for _ in range(2):
        sums.append(scene.remember("sum", lambda: float(scene.planes.sum())))
        if not read_only:
            scene.planes[0, 0] = 3.0
    assert sums == ([24.0, 24.0] if read_only else [24.0, 26.0])


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda scene: pickle.loads(pickle.dumps(scene))])
def test_a_copy_is_a_scene_as_any(copied):
    scene = grey_scene(read_only=True)
    scene.remember("key", lambda: 1)
    again = copied(scene)
    assert again.remember("key", lambda: 1) == 1 and np.array_equal(again.planes, scene.planes)
