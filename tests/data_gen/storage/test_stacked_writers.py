"""HDF5 and Zarr as a user opens them with their own libraries."""

import json

import h5py
import numpy as np
import pytest
import zarr
from helpers.toy_samples import toy_sample

from data_gen.samples.packing import pack
from data_gen.storage.writers.writer import WriterOptions, find_writer
from data_gen.storage.writers.zarr import ZarrWriter
from simulator.errors import PhotositeError

SAMPLES = [toy_sample(index, frame_seeds=(2**63 + index,)) for index in range(5)]
NOISY = np.stack([pack(sample.noisy_dn, "RGGB", "rgbg") for sample in SAMPLES])


def test_hdf5_has_a_dataset_for_each_array_and_number(tmp_path):
    find_writer("hdf5").write(tmp_path / "a.h5", SAMPLES, WriterOptions("rgbg"))
    with h5py.File(tmp_path / "a.h5") as file:
        np.testing.assert_array_equal(file["noisy"], NOISY)
        assert file["noisy"].chunks == (1, *NOISY.shape[1:]) and file["noisy"].attrs["unit"] == "DN"
        assert file["variance"].attrs["unit"] == "DN^2" and file.attrs["channels"] == "rgbg"
        np.testing.assert_array_equal(file["gain_dn_per_e"], [sample.gain_dn_per_e for sample in SAMPLES])
        np.testing.assert_array_equal(file["exposure_ratios"], [sample.exposure_ratios for sample in SAMPLES])
        np.testing.assert_array_equal(file["frame_seeds"], [[2**63 + index] for index in range(5)])
        assert file["color_matrix"].shape == (5, 3, 3) and file["iso"].dtype.kind == "i"
        assert json.loads(file["facts"][3])["source"] == "ramp/0003.png" and "source" not in file


def test_zarr_keeps_each_sample_a_chunk_and_few_files(tmp_path):
    find_writer("zarr").write(tmp_path / "a.zarr", SAMPLES, WriterOptions("rgbg"))
    group = zarr.open_group(str(tmp_path / "a.zarr"), mode="r")
    assert group.metadata.zarr_format == 3
    np.testing.assert_array_equal(group["noisy"][:], NOISY)
    assert group["noisy"].chunks == (1, *NOISY.shape[1:]) and group["noisy"].attrs["unit"] == "DN"
    assert group["noisy"].metadata.dimension_names == ("sample", "frame", "channel", "row", "column")
    assert [facts["iso"] for facts in group.attrs["samples"]] == [sample.iso for sample in SAMPLES]
    assert sum(path.is_file() for path in (tmp_path / "a.zarr").rglob("*")) == 1 + 3 * 2  # metadata and one file an array


def test_zarr_begins_another_file_when_one_is_full(tmp_path):
    ZarrWriter(most_per_file=2).write(tmp_path / "a.zarr", SAMPLES, WriterOptions("rgbg"))
    assert len(list((tmp_path / "a.zarr" / "noisy" / "c").iterdir())) == 3
    np.testing.assert_array_equal(zarr.open_group(str(tmp_path / "a.zarr"), mode="r")["noisy"][:], NOISY)


def test_seeds_on_both_sides_of_2_to_the_63_stay_whole_numbers(tmp_path):
    seeds = [3, 2**63 + 1, 2**64 - 1]
    samples = [toy_sample(index, frame_seeds=(seed,)) for index, seed in enumerate(seeds)]
    find_writer("hdf5").write(tmp_path / "a.h5", samples, WriterOptions())
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["frame_seeds"][:, 0].tolist() == seeds and file["frame_seeds"].dtype == np.uint64


def test_an_old_h5py_whose_files_differ_from_run_to_run_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("h5py.version.version_tuple", (3, 14, 0, "", "", ""))
    with pytest.raises(PhotositeError, match=r"version of h5py = .*differ from run to run; install 3.15"):
        find_writer("hdf5").write(tmp_path / "a.h5", SAMPLES, WriterOptions())
    assert not (tmp_path / "a.h5").exists()
