"""A tar archive that WebDataset's convention reads, with headers that tell nothing of the machine."""

import io
import json
import tarfile
from itertools import groupby

import numpy as np
from helpers.toy_samples import toy_sample

from data_gen.samples.packing import pack
from data_gen.storage.writers.webdataset import WRITER
from data_gen.storage.writers.writer import WriterOptions


def test_members_of_a_sample_stand_together_under_one_key(tmp_path):
    wanted = [toy_sample(index) for index in (11, 12)]
    WRITER.write(tmp_path / "a.tar", wanted, WriterOptions("rggb"))
    with tarfile.open(tmp_path / "a.tar") as archive:
        contents = [(member.name, archive.extractfile(member).read()) for member in archive]
    # What webdataset's group_by_keys does: the key ends at the first dot of the base name.
    samples = [
        {name.partition(".")[2]: content for name, content in group}
        for _, group in groupby(contents, key=lambda item: item[0].partition(".")[0])
    ]
    assert [list(sample) for sample in samples] == [["clean.npy", "json", "noisy.npy", "variance.npy"]] * 2
    for found, sample in zip(samples, wanted, strict=True):
        noisy = np.load(io.BytesIO(found["noisy.npy"]))
        assert noisy.dtype == np.uint16
        np.testing.assert_array_equal(noisy, pack(sample.noisy_dn, "RGGB", "rggb"))
        facts = json.loads(found["json"])
        assert facts["iso"] == sample.iso and facts["cfa"] == "RGGB" and facts["channels"] == "rggb"
        assert facts["gain_dn_per_e"] == sample.gain_dn_per_e and facts["exposure_ratios"] == list(sample.exposure_ratios)


def test_headers_tell_no_time_and_no_owner(tmp_path):
    WRITER.write(tmp_path / "a.tar", [toy_sample(0)], WriterOptions())
    with tarfile.open(tmp_path / "a.tar") as archive:
        headers = {(m.mtime, m.uid, m.gid, m.uname, m.gname, m.mode, m.type) for m in archive}
    assert headers == {(0, 0, 0, "", "", 0o644, tarfile.REGTYPE)}


def test_a_file_that_changed_is_read_anew(tmp_path):
    for index in (3, 4):
        WRITER.write(tmp_path / "a.tar", [toy_sample(index, width=32 + 2 * index)], WriterOptions())
        assert next(WRITER.read(tmp_path / "a.tar", [0])).index == index
