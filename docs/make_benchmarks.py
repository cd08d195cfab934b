"""Writes docs/benchmarks.md from the figures that `make bench` left in build/benchmarks, and keeps those beside it.
The pages in docs/stages get the price of their stage.

python docs/make_benchmarks.py [FOLDER]

A section that was not measured keeps the figures that stand in docs/images/benchmarks; one without figures is left out and
named.
"""

import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent / "benchmarks"))

from bench import SECTIONS  # noqa: E402
from measuring.record import SHAPE, table_of  # noqa: E402

PAGE, FIGURES = DOCS / "benchmarks.md", DOCS / "images" / "benchmarks"
INTRODUCTION = """\
# Benchmarks

How long a photograph takes here and in other programs, and how wrong each is in that time: a program that is fast and wrong
is no use.

![Million photosites per second of Photosite and its peers](images/benchmarks/sensor.png)

Made by `python docs/make_benchmarks.py` from what `make bench` measured; the figures of a section are those of one run, at the
commit and load that it names, in `docs/images/benchmarks/*.json`. Run it on your machine: ratios differ with processor
and load.

- Contestants take turns in one process, so that other programs disturb all of them alike. The time is the best of the run;
  processor time is the median over all cores and hardly depends on other programs. On free cores the ratio of times to a peer
  that uses one core is the ratio of processor times multiplied by the number of cores.
- NumPy, SciPy, getframes and GalSim use one core, as they do for their users; PyTorch, Mitsuba and Photosite use all.
- Charts of run time against error are logarithmic; lower left is better. Defaults of Photosite are ringed. A setting is
  dominated, and hollow in the chart and starred in the table, where another program is neither slower nor more wrong, and
  is better in one by more than a twentieth, or another setting of Photosite takes and errs less than nine tenths of it.
"""


def chapter(record: dict[str, Any], is_drawn: bool) -> str:
    """A section of the page: text, chart, table, verdicts."""
    commit, machine = record["commit"], record["machine"]
    where = f"{machine['cores']} cores of {machine['processor']}, load {machine['load'][0]:.1f} at the end"
    of = f"commit {commit['hash'][:8]}{' with changes' if commit['is_changed'] else ''}"
    parts = [f"## {record['heading']}", record["text"].format(**record["facts"]).strip()]
    parts.append(f"{where}; {record['size']} size, {of}.")
    if is_drawn:
        parts.append(f"![{record['heading']}](images/benchmarks/{record['section']}.png)")
    if record["columns"]:
        parts.append(table(table_of(record)))
    words = {True: "reached", False: "**missed**"}
    judged = [[one["what"], one["figure"], one["asked"], words[one["reached"]]] for one in record["verdicts"]]
    judged += [[note, "left out", "", ""] for note in record["notes"]]
    if judged:
        parts.append(table([["what", "measured", "asked", ""], *judged]))
    return "\n\n".join(parts)


def table(lines: list[list[str]]) -> str:
    """Markdown of cells, headings first."""
    headings, *rest = lines
    texts = [headings, ["---"] * len(headings), *rest]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in texts)


def record_of(path: Path) -> dict[str, Any] | None:
    """What a file holds; None where there is none, or one of another shape."""
    if not path.exists():
        return None
    record = json.loads(path.read_text(encoding="utf-8"))
    return record if record.get("shape") == SHAPE else None


def write_page(folder: Path, figures: Path, page: Path) -> list[str]:
    """Copy the figures of a folder beside the page, and write it; returns the sections that have none."""
    figures.mkdir(parents=True, exist_ok=True)
    chapters, missing = [], []
    for section in SECTIONS:
        if record_of(folder / f"{section}.json") is not None:
            for path in folder.glob(f"{section}.*"):
                shutil.copyfile(path, figures / path.name)
        record = record_of(figures / f"{section}.json")
        if record is None:
            missing.append(section)
            continue
        chapters.append(chapter(record, bool(record["chart"]) and (figures / f"{section}.png").exists()))
    page.write_text("\n\n".join([INTRODUCTION.strip(), *chapters]) + "\n", encoding="utf-8")
    return missing


def write_stage_costs(figures: Path, folder: Path) -> None:
    """State in the pages of a folder, one for each stage, how many times the kernel's processor time is with the stage."""
    record = record_of(figures / "stages.json")
    for row in record["rows"] if record else []:
        page = folder / f"{row['name']}.md"
        if page.exists():
            text = page.read_text(encoding="utf-8")
            stated = re.sub(r"[\d.]+(?= times the kernel of shot noise)", f"{row['cpu_ratio']:.2f}", text)
            page.write_text(stated, encoding="utf-8")


def main() -> None:
    """Write the pages."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS.parent / "build" / "benchmarks"
    missing = write_page(folder, FIGURES, PAGE)
    write_stage_costs(FIGURES, DOCS / "stages")
    print(f"wrote {PAGE}")
    if missing:
        print(f"left out, since they were not measured: {', '.join(missing)}")


if __name__ == "__main__":
    main()
