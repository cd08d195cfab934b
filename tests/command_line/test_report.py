"""`photosite report`: files where they were asked for, and one line for an error."""

import pytest
from helpers.study_folder import write_study_folder

from simulator.command_line.main import main


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["report", *arguments])
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def test_the_page_lies_in_the_folder_of_the_study(capsys, tmp_path):
    folder = write_study_folder(tmp_path / "s")
    code, out, _ = run(capsys, str(folder))
    assert code == 0 and out.split() == [str(folder / "report.html")]
    assert "<title>Study iso_and_aperture</title>" in (folder / "report.html").read_text()


def test_a_folder_without_a_study_is_said(capsys, tmp_path):
    code, _, err = run(capsys, str(tmp_path))
    assert code == 1 and "holds no results of a study" in err and err.count("\n") == 1


def test_a_pdf_without_a_browser_is_refused_before_the_work(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("PHOTOSITE_BROWSER", str(tmp_path / "none"))
    folder = write_study_folder(tmp_path / "s")
    code, _, err = run(capsys, str(folder), "--pdf", str(tmp_path / "r.pdf"))
    assert code == 1 and "needs Chromium" in err and not (folder / "report.html").exists()
