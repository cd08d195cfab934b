"""Programs that a command will need, built on a thread while it imports its modules, reads its files and plans.

A driver takes 20 to 50 ms for a program that it has compiled before, without Python. Which ones a command needs is only known
late, but they are mostly those of its last process.
"""

import hashlib
import json
import warnings
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from types import TracebackType
from typing import Self

from simulator import __version__
from simulator.atomic_files import atomic_write, cache_folder
from simulator.device.device import CompilerWarning, Device, ProgramKey, find_device
from simulator.errors import PhotositeError, reading

ENDING = ".programs.json"
MOST_PROGRAMS = 64  # that are remembered of a command
MOST_FILES = 256  # of a few kB


class ProgramsAhead:
    """Builds the programs that the last command of the same kind used, from now to the end of the block.

    After a block that raises nothing, those that it used are remembered, unless the process had used others before. What is
    remembered changes the time that a command takes, never a bit: a file that is missing, damaged or cannot be written means
    that each program is built when it is needed.
    kind: of the command; commands of the same kind use mostly the same programs. device: as of `open_device`.
    most_files: that are kept, of one kind each; those written longest ago are removed.
    """

    def __init__(self, kind: str, device: str | None = None, most_files: int = MOST_FILES) -> None:
        warnings.filterwarnings("ignore", category=CompilerWarning)  # filters are those of all threads
        self._kind, self._name, self._most_files = kind, device, most_files
        self._ended = Event()
        self._device: Device | None = None
        self._is_first = False
        self._remembered: list[ProgramKey] = []
        self._thread = Thread(target=self._build, name="programs ahead")
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._ended.set()
        self._thread.join()
        if kind is None and self._is_first and self._device is not None:
            self._remember(self._device)

    def _build(self) -> None:
        with suppress(PhotositeError, OSError):  # whoever needs the device or a program is told
            self._device = find_device(self._name)
            self._is_first = not self._device.used_programs()
            self._remembered = read_programs(programs_file(self._kind, self._device.info.label))
            for program in self._remembered:
                if self._ended.is_set():
                    return
                self._device.build_program(program)

    def _remember(self, device: Device) -> None:
        used, file = device.used_programs()[:MOST_PROGRAMS], programs_file(self._kind, device.info.label)
        if set(used) == set(self._remembered):
            return
        with suppress(PhotositeError, OSError):
            with atomic_write(file, durable=False) as path:
                path.write_text(json.dumps(used), encoding="utf-8")
            written = sorted(file.parent.glob(f"*{ENDING}"), key=lambda path: path.stat().st_mtime_ns)
            for old in written[: -self._most_files]:
                old.unlink(missing_ok=True)


def programs_file(kind: str, label: str) -> Path:
    """Return the path of the file of the programs that a kind of command uses on the device of this label."""
    key = hashlib.sha256(json.dumps([__version__, label, kind]).encode()).hexdigest()
    return cache_folder("programs") / f"{key[:32]}{ENDING}"


def read_programs(file: Path) -> list[ProgramKey]:
    """Return the programs of a file; none where it is missing or damaged."""
    try:
        with reading(file, "delete it; the next command writes it again"):
            listed = json.loads(file.read_bytes())
            return [(str(name), tuple((str(macro), str(value)) for macro, value in macros)) for name, macros in listed]
    except PhotositeError:
        return []
