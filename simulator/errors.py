"""The exception for faults that a user can correct, and the door through which files are read that may be damaged."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self


class PhotositeError(Exception):
    """A fault that the user can correct.

    Its fields are data, for programs that show an error beside what it is about. `str(error)` makes the message, in the order
    of the list below, leaving out what is None: `file:line: key = value: rule`, `file: rule`, `key = value: rule`, `--option
    value: rule`, `key: rule`, `rule`. No program reads the message.

    within: what read or made the file or the part, outermost first, such as a frame of a sweep.
    file: path of the file at fault, or the setting as it was given, such as `--set lens.f_number=2`.
    line: of the file, from 1.
    via: what took the value from that line to where it is wrong: `sweep`.
    part: of the file or of the work, such as the name of a frame or the number of a sample.
    key: dotted key of the file, command-line option, or argument of a function.
    value: of the key, as the message shows it: a number, a path, or text with a unit.
    joint: what stands between key and rule, a space where the rule is the rest of a sentence: `lens.f_number is missing`.
    rule: what is wrong, and what to do.
    """

    def __init__(
        self,
        rule: str,
        *,
        file: str | os.PathLike | None = None,
        line: int | None = None,
        via: str | None = None,
        part: str | None = None,
        key: str | None = None,
        value: object = None,
        joint: str = ": ",
        within: tuple[str, ...] = (),
    ) -> None:
        super().__init__(rule)  # pickle and copy call the class with it, and then set the attributes
        self.rule, self.file, self.line, self.via, self.part = rule, file, line, via, part
        self.key, self.value, self.joint, self.within = key, value, joint, within

    def __str__(self) -> str:
        before = [*self.within]
        if self.file is not None:
            before.append(place_text(self.file, self.line, self.via))
        if self.part is not None:
            before.append(self.part)
        text = ": ".join([*before, f"{self._about()}{self.rule}"])
        # Names and texts in a damaged file may hold anything, also what would steer a terminal.
        return "".join(letter if letter.isprintable() or letter == "\n" else ascii(letter)[1:-1] for letter in text)

    def _about(self) -> str:
        """Key, value, and what joins them to the rule."""
        if self.key is None:
            return ""
        if self.value is None:
            return f"{self.key}{self.joint}"
        equals = " " if self.key.startswith("--") else " = "
        return f"{self.key}{equals}{self.value}{self.joint}"

    @property
    def names_a_value(self) -> bool:
        """Whether it names the value of a dotted key but no file or part where it was written: `key = value: rule`."""
        has_place = self.file is not None or self.part is not None or bool(self.within)
        return not has_place and self.value is not None and re.fullmatch(r"[\w.]+", self.key or "") is not None

    def replace(self, **fields: Any) -> Self:
        """Return the same error with other fields."""
        return type(self)(**{name: getattr(self, name) for name in FIELDS} | fields)

    def with_file(
        self, file: str | os.PathLike, line: int | None = None, via: str | None = None, part: str | None = None
    ) -> Self:
        """Return the same error with the place where the fault was written.

        An error that knows a file, or a part where one is given, keeps it: the place becomes what it is within.
        """
        if self.file is None and not self.within and (part is None or self.part is None):
            return self.replace(file=file, line=line, via=via, part=self.part if part is None else part)
        return self.inside(place_text(file, line, via), *([] if part is None else [part]))

    def inside(self, *names: str) -> Self:
        """Return the same error within something else, which the message names first."""
        return self.replace(within=(*names, *self.within))


FIELDS = ("rule", "file", "line", "via", "part", "key", "value", "joint", "within")


def place_text(file: str | os.PathLike, line: int | None = None, via: str | None = None) -> str:
    """Return how a message names a place: `file`, `file:line` or `file:line (via)`."""
    return f"{file}" + ("" if line is None else f":{line}") + ("" if via is None else f" ({via})")


def require(
    condition: bool, key: str, value: object, rule: str, *, file: str | os.PathLike | None = None, part: str | None = None
) -> None:
    """Raise PhotositeError `key = value: rule`, after the file and the part it is of, unless the condition holds."""
    if not condition:
        raise PhotositeError(rule, file=file, part=part, key=key, value="None" if value is None else value)


@contextmanager
def reading(file: str | os.PathLike, fix: str, *, key: str | None = None) -> Iterator[None]:
    """Turn whatever a library raises in the block, which reads a user's file, into PhotositeError.

    All files that others made are read inside such a block: libraries document few of the exceptions that damaged bytes cause.
    file: named by the message, as the value of `key` where one is given. fix: what helps, such as "export it again".
    The block holds the reading and no more, since a fault of our own code inside it would be called one of the file.
    """
    try:
        yield
    except PhotositeError:
        raise
    except MemoryError as error:
        detail = f" ({_one_line(error)})" if str(error) else ""
        raise file_error(f"does not fit into memory{detail}; scale it down or end other programs", file, key) from error
    except Exception as error:
        raise file_error(f"cannot be read ({_one_line(error)}); {fix}", file, key) from error


def file_error(rule: str, file: str | os.PathLike, key: str | None = None) -> PhotositeError:
    """Return an error about a file, which is the value of `key` where one is given."""
    return PhotositeError(rule, file=file) if key is None else PhotositeError(rule, key=key, value=file)


def check_file(file: str | os.PathLike, key: str | None = None) -> None:
    """Raise PhotositeError where no file is there, or a folder is. file: named by the message as `reading` does."""
    if not os.path.isfile(file):
        raise file_error(f"{why_no_file(file)}; check the path", file, key)


def why_no_file(path: str | os.PathLike) -> str:
    """Return what is wrong with a path that names no file."""
    if os.path.isdir(path):
        return "is a folder, not a file"
    return "is no plain file" if os.path.exists(path) else "no such file"


def _one_line(error: Exception) -> str:
    """Return what a library says, one line that can be printed."""
    if isinstance(error, UnicodeEncodeError):
        return "its path is no UTF-8 text: rename it"
    if isinstance(error, UnicodeError):
        return "text in it is damaged"  # the error's own text has neither the file nor the place
    if isinstance(error, RecursionError):
        return "nested too deeply"
    told = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return first_line(told) or type(error).__name__


def first_line(text: str) -> str:
    """Return the first line of what a library says, without blanks at its ends."""
    return (text.strip().splitlines() or [""])[0][:300]
