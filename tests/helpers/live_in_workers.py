"""Prints, as JSON, checksums of live pairs by index, epoch by epoch, with a DataLoader of its own kind:
python live_in_workers.py CONFIG.yaml METHOD WORKERS PERSISTENT USES_OPENCL_BEFORE."""

import json
import sys
import zlib

from data_gen.torch import DataLoader, LivePairs

EPOCHS, BATCH = 3, 4


def checksums(batch: dict) -> dict[int, int]:
    """Of both frames of each sample, by its number."""
    frames = zip(batch["index"].tolist(), batch["noisy"], batch["clean"], strict=True)
    return {index: zlib.crc32(clean.numpy().tobytes(), zlib.crc32(noisy.numpy().tobytes())) for index, noisy, clean in frames}


def main() -> None:
    """Iterate epoch by epoch; before it, break off an epoch, as one who looks at a first batch does."""
    config, method, workers, persistent, before = sys.argv[1], sys.argv[2], *map(int, sys.argv[3:])
    pairs = LivePairs(config)
    if before:
        pairs[0]
    several = {"multiprocessing_context": method, "persistent_workers": bool(persistent)} if workers else {}
    loader = DataLoader(pairs, BATCH, num_workers=workers, **several)
    next(iter(loader))
    found = []
    for epoch in range(EPOCHS):
        pairs.set_epoch(epoch)
        found.append({index: code for batch in loader for index, code in checksums(batch).items()})
    print(json.dumps(found))


if __name__ == "__main__":
    main()
