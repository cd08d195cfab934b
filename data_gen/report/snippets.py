"""Python that reads a sample of each format without Photosite; `{shard}` is a shard's name. Each prints the mean noisy code."""

SNIPPETS = {
    "webdataset": """\
import io, json, tarfile
import numpy as np

with tarfile.open("{shard}") as archive:  # or webdataset.WebDataset("{shard}").decode()
    member = next(one for one in archive if one.name.endswith(".noisy.npy"))
    noisy = np.load(io.BytesIO(archive.extractfile(member).read()))
    facts = json.load(archive.extractfile(member.name.replace(".noisy.npy", ".json")))
print(facts["camera"], facts["iso"], noisy.shape, noisy.mean())
""",
    "hdf5": """\
import json
import h5py

with h5py.File("{shard}") as file:
    noisy, clean, facts = file["noisy"][0], file["clean"][0], json.loads(file["facts"][0])
print(facts["camera"], facts["iso"], noisy.shape, noisy.mean())
""",
    "zarr": """\
import zarr

group = zarr.open_group("{shard}", mode="r")
noisy, clean, facts = group["noisy"][0], group["clean"][0], group.attrs["samples"][0]
print(facts["camera"], facts["iso"], noisy.shape, noisy.mean())
""",
    "lmdb": """\
import io, json
import lmdb
import numpy as np

with lmdb.open("{shard}", readonly=True, lock=False) as database, database.begin() as transaction:
    first = next(key for key, _ in transaction.cursor()).split(b".")[0]
    noisy = np.load(io.BytesIO(transaction.get(first + b".noisy.npy")))
    facts = json.loads(transaction.get(first + b".json"))
print(facts["camera"], facts["iso"], noisy.shape, noisy.mean())
""",
    "eld": """\
import json, pickle
import lmdb
import numpy as np

facts = json.loads(open("{shard}/facts.jsonl").readline())
meta = pickle.load(open("{shard}/noisy/meta_info.pkl", "rb"))
with lmdb.open("{shard}/noisy", readonly=True, lock=False) as database, database.begin() as transaction:
    noisy = np.frombuffer(transaction.get(b"00000000"), meta["dtype"]).reshape(meta["shape"])
print(facts["camera"], facts["iso"], noisy.shape, noisy.mean())
""",
    "npz": """\
import json
import numpy as np

noisy, clean = open("{shard}/pairs.txt").readline().split()
with np.load(f"{shard}/{{noisy}}.npz") as archive:
    noisy, facts = archive["im"], json.loads(archive["facts"].item())
print(facts["camera"], facts["iso"], noisy.shape, noisy.mean())
""",
    "dng": """\
import json
import rawpy

noisy, clean = open("{shard}/pairs.txt").readline().split()
facts = json.load(open("{shard}/" + noisy.split("_")[0] + ".json"))
with rawpy.imread("{shard}/" + noisy) as raw:
    noisy = raw.raw_image_visible.copy()
print(facts["camera"], facts["iso"], noisy.shape, noisy.mean())
""",
}


def snippet(name: str, shard: str) -> str:
    """Code that reads the first sample of a shard, run from the data set's folder."""
    return SNIPPETS[name].format(shard=shard)
