"""Data sets on disk: shards, manifest, reading."""
