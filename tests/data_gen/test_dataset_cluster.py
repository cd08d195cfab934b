"""Data sets made by several processes: the same bytes, also when a worker is killed."""

import os
import signal
import sys

import pytest
from helpers.dataset_folders import TEXT, content, small_config

from data_gen.run import run
from simulator.errors import PhotositeError
from simulator.studies.cluster import cluster


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A data set made by one process: its configuration and folder."""
    folder = tmp_path_factory.mktemp("whole")
    config = small_config(folder)
    run(config, folder / "out")
    return config, folder / "out"


@pytest.mark.slow
def test_two_workers_write_the_bytes_of_one(whole, tmp_path):
    config, folder = whole
    shares = []
    run(config, tmp_path, workers=2, progress=lambda what, share: shares.append(share))
    assert content(tmp_path) == content(folder) and shares == sorted(shares) and shares[-1] == 1.0


@pytest.mark.slow
def test_any_number_of_workers_writes_the_same_hdf5(tmp_path):
    config = small_config(tmp_path, TEXT, "writer.format=hdf5", "variance=true")
    folders = [tmp_path / f"out{index}" for index in range(3)]
    for folder, workers in zip(folders, (1, 2, 3), strict=True):
        run(config, folder, workers=workers)
    assert all(content(folder) == content(folders[0]) for folder in folders[1:])


@pytest.mark.slow
def test_an_error_on_a_worker_is_one_message(tmp_path, capfd):
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "a.png").write_bytes(b"broken")
    leaves = "{procedural: [dead_leaves, text], count: 12, width: 48, height: 40}"
    config = small_config(tmp_path, TEXT.replace(leaves, "{photographs: photos}"))
    with pytest.raises(PhotositeError, match=r"sample \d+: none of 100 pictures .*a.png"):
        run(config, tmp_path / "out", workers=2)
    assert "Traceback" not in "".join(capfd.readouterr()) and not list((tmp_path / "out").glob("shard-*"))


@pytest.mark.slow
def test_a_killed_worker_of_a_running_cluster_loses_nothing(whole, tmp_path):
    config, folder = whole
    with cluster(2, None) as client:
        workers = list(client.run(os.getpid).values())
        assert os.getpid() not in workers

        def kill(what, share):
            if workers and share:
                os.kill(workers.pop(), signal.SIGKILL)
                workers.clear()

        run(config, tmp_path, scheduler=client.scheduler.address, progress=kill)
    assert not workers and content(tmp_path) == content(folder)


def test_a_cluster_that_is_not_there_is_named(whole, tmp_path, monkeypatch):
    config, _ = whole
    monkeypatch.setitem(sys.modules, "dask.distributed", None)
    with pytest.raises(PhotositeError, match=r"pip install 'photosite\[cluster\]'"):
        run(config, tmp_path, workers=2)
