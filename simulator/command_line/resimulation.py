"""`photosite resimulate`."""

from pathlib import Path

import typer

from simulator import __version__
from simulator.command_line.screen import show_progress, tell
from simulator.raw.save import save
from simulator.studies.resimulation import differing_codes, provenance_of, resimulate


def resimulate_file(path: Path, out: Path | None, device: str | None) -> None:
    """Take the shot of a DNG again and compare; with `out`, write its files there, paths to stdout.

    Raises PhotositeError; typer.Exit(1) when a code differs.
    """
    provenance = provenance_of(path)
    if provenance.version != __version__:
        tell(f"note: {path} was made by Photosite {provenance.version}; this is {__version__}")
    with show_progress(path.name, prefix=f"{path.name}: ", is_long=False) as progress:
        raw = resimulate(path, device=device, progress=progress)
        # Compared first: --out may be the folder of the file itself.
        different = differing_codes(path, raw)
        files = None if out is None else save(raw, out)
    for file in () if files is None else files.there():
        print(file)
    if different:
        tell(f"error: {path}: {different} of {raw.dn.size} codes differ from the file's")
        raise typer.Exit(1)
    print(f"{path}: the same {raw.dn.size} codes again, shot {provenance.config_sha256[:12]}")
