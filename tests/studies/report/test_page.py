"""The report of a study: every number is the table's, nothing comes from elsewhere, and a browser shows it as it should."""

import csv
import math
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from helpers.browser import WIDTHS, look_at
from helpers.small_study import small_study
from helpers.study_folder import FIGURES, ISOS, STOPS, write_study_folder

from simulator.errors import PhotositeError
from simulator.studies.report.page import report_page
from simulator.studies.report.pdf import find_browser, print_pdf
from simulator.studies.report.pictures import preview_data
from simulator.studies.report.study_data import StudyFolder
from simulator.studies.report.study_input import open_study
from simulator.studies.study_run import run_study

FAILED = 5
OWN = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}  # names of the languages inside the page


class Page(HTMLParser):
    """Tables of a page by the section and figure that they stand in: rows of texts and of the exact numbers beside them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.section = self.figure = ""
        self.tables: dict[str, list[list[str]]] = {}
        self.exact: dict[str, list[list[float | None]]] = {}
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.tags: set[str] = set()
        self.cell: list[str] | None = None
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        about = {name: value or "" for name, value in attrs}
        self.tags.add(tag)
        self.ids += [about["id"]] if "id" in about else []
        self.addresses += [value for name, value in about.items() if name in ("src", "href", "xlink:href", "action", "data")]
        if tag == "section":
            self.section, self.figure = about["id"], ""
        elif tag == "figure":
            self.figure = about.get("id", "")
        elif tag == "tr":
            self.tables.setdefault(self.place, []).append([])
            self.exact.setdefault(self.place, []).append([])
        elif tag in ("td", "th"):
            self.cell = []
            self.exact[self.place][-1].append(None)
        elif tag == "data":
            self.exact[self.place][-1][-1] = float(about["value"])

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th") and self.cell is not None:
            self.tables[self.place][-1].append("".join(self.cell))
            self.cell = None

    def handle_data(self, data: str) -> None:
        if self.cell is not None:
            self.cell.append(data)

    @property
    def place(self) -> str:
        return self.figure or self.section


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> StudyFolder:
    return open_study(write_study_folder(tmp_path_factory.mktemp("study") / "s", FAILED, " <script>alert(1)</script>"))


@pytest.fixture(scope="module")
def text(study) -> str:
    return report_page(study)


@pytest.fixture(scope="module")
def page(text) -> Page:
    return Page(text)


def rounds_to(text: str, value: float) -> bool:
    """Whether a text of a number is a value rounded to five digits, or to a whole number of more."""
    return float(text) == float(f"{value:.5g}") or (abs(value) >= 1e4 and float(text) == round(value))


def test_every_number_of_every_point_is_the_tables(study, page):
    head, *rows = page.tables["points"]
    exact = page.exact["points"][1:]
    assert len(rows) == len(study.table.rows)
    columns = ["exposure.iso", "lens.f_number", *FIGURES, "seconds", "predicted_error_sigma", "predicted_seconds"]
    assert len(head) == 2 + len(columns) and head[2:4] == ["ISO", "f-number"]
    for cells, numbers, row in zip(rows, exact, study.table.rows, strict=True):
        assert cells[:2] == [row["name"], row["state"]]
        for cell, number, column in zip(cells[2:], numbers[2:], columns, strict=True):
            value = row[column]
            assert (cell, number) == ("", None) if value is None else number == value and rounds_to(cell, value)


def test_the_summary_has_the_extremes_and_medians_of_the_table(study, page):
    rows = {cells[0]: numbers for cells, numbers in zip(page.tables["summary"], page.exact["summary"], strict=True)}
    assert rows["exposure.iso"][2] == len(ISOS) and rows["lens.f_number"][2] == len(STOPS)
    for column in FIGURES:
        values = [row[column] for row in study.done()]
        wanted = [min(values), float(np.median(values)), max(values), len(values)]
        assert rows[study.title(column)][2:] == wanted


def test_every_number_of_a_plot_is_one_of_the_table(study, page):
    """Of each figure over an axis; curves have no numbers, and depth of field is the lens's."""
    checked = 0
    for column in FIGURES:
        for axis in ("exposure.iso", "lens.f_number"):
            known = {(row[axis], row[column]) for row in study.done()}
            for _, x, y in page.exact.get(f"plot-{column}_{axis}", [])[1:]:
                assert (x, y) in known
                checked += 1
    both = {(row["exposure.iso"], row[name]) for row in study.done() for name in ("range.range_ev", "pdr.range_ev")}
    assert {(x, y) for _, x, y in page.exact["plot-range_exposure.iso"][1:]} == both
    transfer = {(x, y) for _, x, y in page.exact["plot-transfer_grey"][1:]}
    assert transfer == {(row["grey.mean_dn"], row["grey.noise_dn"]) for row in study.done()}
    times = {(x, y) for _, x, y in page.exact["plot-time_error"][1:]}
    assert times == {(row["predicted_error_sigma"], row["seconds"]) for row in study.done()}
    assert checked == 3 * 11 + 2 * 3  # figures of the patch over the ISO; MTF and blur, alike at all ISOs, over three stops


def test_depth_of_field_is_that_of_the_lens(page):
    """50 mm at 5 m on 36 x 24 mm: 1/z = 1/5 -+ C N (1/f - 1/5 m) / f."""
    limits = {(line, stop): value for line, stop, value in _rows(page, "plot-depth_of_field")}
    circle_m = 1e-3 * math.hypot(4240 * 8.4e-3, 2832 * 8.4e-3) / 1500.0
    for stop in STOPS:
        reach = circle_m * stop / 0.05 * (1.0 / 0.05 - 1.0 / 5.0)
        assert limits["nearest sharp", stop] == pytest.approx(1.0 / (0.2 + reach), rel=1e-2)
        assert limits["farthest sharp", stop] == pytest.approx(1.0 / (0.2 - reach), rel=1e-2)


def _rows(page: Page, place: str) -> list[tuple[str, float, float]]:
    texts, numbers = page.tables[place][1:], page.exact[place][1:]
    return [(cells[0], x, y) for cells, (_, x, y) in zip(texts, numbers, strict=True)]


def test_worst_points_are_the_extremes_and_link_to_their_rows(study, page):
    rows = {cells[0]: (cells, numbers) for cells, numbers in zip(page.tables["worst"], page.exact["worst"], strict=True)}
    least = min(study.done(), key=lambda row: row["grey.snr"])
    cells, numbers = rows["least grey SNR"]
    assert numbers[1] == least["grey.snr"] and cells[3].startswith(least["name"])
    failed = next(cells for cells, _ in rows.values() if cells[0].startswith("failed"))
    assert "f/0.1: too fast" in failed[0] and "--set exposure.iso=400" in failed[0]
    links = [address for address in page.addresses if address.startswith("#point-")]
    assert links and set(address[1:] for address in links) <= set(page.ids)


def test_all_links_lead_to_a_place_in_the_page_and_no_place_has_two_names(page):
    names = {address[1:] for address in page.addresses if address.startswith("#")}
    places = [name for name in page.ids if name.startswith(("point-", "picture-", "plot-"))]
    assert {name for name in names if name.startswith(("point", "picture", "plots", "summary"))} <= set(page.ids)
    assert len(places) == len(set(places))


def test_nothing_comes_from_elsewhere_and_nothing_runs(text, page):
    assert set(re.findall(r"[a-z]+://[^\"'<> )]+", re.sub(r"base64,[^']*", "", text))) <= OWN
    assert all(address.startswith(("#", "data:image/png;base64,")) for address in page.addresses)
    assert not page.tags & {"script", "link", "iframe", "object", "embed", "base"} and "@import" not in text
    assert all(found.startswith("#") for found in re.findall(r"url\(([^)]*)\)", text))


def test_the_study_file_and_its_provenance_are_there(text, page):
    assert "exposure.iso: [100, 400, 1600, 6400]  # &lt;b&gt;&amp;" in text
    assert ["device.platform", "PoCL"] in page.tables["provenance"] and ["wall_s", "12.5"] in page.tables["provenance"]


def test_a_large_study_names_its_worst_points_and_leaves_pictures_out(tmp_path):
    from simulator.studies.report.page import shown_rows
    from simulator.studies.report.worst_points import WorstPoint

    folder = open_study(write_study_folder(tmp_path / "s"))
    rows = folder.table.rows
    few = shown_rows(folder, [WorstPoint(rows[4], "because")], most=3)
    assert [row["index"] for row in few] == [0, 4, 6, 11]


def test_the_report_of_a_study_that_was_run_has_its_numbers_and_pictures(tmp_path):
    run_study(small_study(tmp_path), tmp_path / "out")
    with (tmp_path / "out" / "points.csv").open() as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    found = open_study(tmp_path / "out")
    page = Page(report_page(found))
    columns = [*found.columns_of("axis"), *found.columns_of("measured"), *found.columns_of("run")]
    for cells, numbers in zip(page.tables["points"][1:], page.exact["points"][1:], strict=True):
        row = rows.pop(cells[0])
        for text, number, column in zip(cells[2:], numbers[2:], columns, strict=False):
            if number is None:
                assert text == row[column]
            else:
                assert number == float(row[column]) or (math.isnan(number) and row[column] == "nan")
    assert not rows
    assert sum(address.startswith("data:image/png") for address in page.addresses) == len(found.done())


def test_a_preview_that_is_no_picture_is_said(tmp_path):
    (tmp_path / "points").mkdir()
    (tmp_path / "points" / "a.png").write_bytes(b"nothing")
    with pytest.raises(PhotositeError, match=r"a\.png: cannot be read \(no PNG file\); take the point again"):
        preview_data(tmp_path, "a")
    assert preview_data(tmp_path, "b") is None


def test_a_pdf_without_a_browser_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv("PHOTOSITE_BROWSER", str(tmp_path / "none"))
    with pytest.raises(PhotositeError, match=r"--pdf .*: needs Chromium.*apt install chromium.*print it"):
        print_pdf("<p>", tmp_path / "r.pdf")
    assert not (tmp_path / "r.pdf").exists()


@pytest.fixture
def browser() -> str:
    found = find_browser()
    if found is None:
        pytest.skip("no Chromium, Chrome or Edge is installed (Debian: apt install chromium)")
    return found


def test_a_browser_shows_it_without_a_network_on_a_desk_and_on_a_phone(browser, text, tmp_path):
    from PIL import Image

    (tmp_path / "report.html").write_text(text, encoding="utf-8")
    for name, seen in look_at(browser, tmp_path / "report.html").items():
        assert seen.errors == [] and seen.broken == 0, name
        assert seen.overflow_px <= 0, name
        assert [one for one in seen.requests if not one.startswith("data:")] == [(tmp_path / "report.html").as_uri()]
        assert "Study iso_and_aperture" in seen.text and "12 points: 11 done, 1 failed." in seen.text
        (tmp_path / f"{name}.png").write_bytes(seen.png)
        with Image.open(tmp_path / f"{name}.png") as picture:
            assert picture.width == WIDTHS[name][0] and picture.height > 2000
            assert len(picture.convert("RGB").resize((100, 400)).getcolors(40000) or []) > 100


def test_it_is_printed_to_a_pdf(browser, text, tmp_path):
    print_pdf(text, tmp_path / "r.pdf")
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF") and (tmp_path / "r.pdf").stat().st_size > 50_000
    assert [path.name for path in tmp_path.iterdir()] == ["r.pdf"]
