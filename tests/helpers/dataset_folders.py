"""Data sets on disk for tests: a small configuration, and what a folder holds."""

from pathlib import Path

from data_gen.recipe.dataset_config import DataSet
from simulator.config import load_file

TEXT = """\
count: 22
crop: [16, 24]
pictures:
  leaves: {procedural: [dead_leaves, text], count: 12, width: 48, height: 40}
noise: {cameras: {sony_a7s2: {}, imx385: {}}}
exposure_ratio: {log_uniform: [1, 100]}
writer: {format: webdataset, channels: rggb, samples_per_shard: 3}
"""


def small_config(folder: Path, text: str = TEXT, *settings: str) -> DataSet:
    """A configuration in its own file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "small.yaml"
    path.write_text(text, encoding="utf-8")
    return load_file(DataSet, path, settings)


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a folder, by its path."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
