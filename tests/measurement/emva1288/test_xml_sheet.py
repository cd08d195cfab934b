"""Data sheets in XML: sections and elements as the reference implementation writes them, numbers to the last digit."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest

from simulator.measurement.emva1288.xml_sheet import QUANTITIES, DataSheet, derived_values, sheet_rows, write_xml_sheet

VALUES = {
    "K": 0.365,
    "QE": 62.5,
    "sigma_y_dark": 0.89,
    "u_e_sat": 10500.0,
    "pixel_size": 4.5,
    "DSNU1288": 0.84,
    "PRNU1288": math.nan,
}


def read(path):
    """Section -> quantity -> column -> text, with the standard library."""
    root = ElementTree.parse(path).getroot()
    return root, {part.tag: {one.tag: {each.tag: each.text for each in one} for one in part} for part in root}


def test_a_sheet_has_the_elements_of_the_schema(tmp_path):
    write_xml_sheet(DataSheet({"vendor": 'A & "B"'}, derived_values(VALUES)), tmp_path / "sheet.xml")
    root, found = read(tmp_path / "sheet.xml")
    assert root.tag == "results" and root.get("vendor") == 'A & "B"' and root.get("standard") == "EMVA 1288 Release 4.0 Linear"
    assert set(found) == {"info", "sensitivity", "spatial"}  # no empty section
    assert set(found["spatial"]) == {"DSNU1288", "DSNU1288_DN"}  # nan is left out
    assert found["sensitivity"]["K"] == {"Short": "Overall system gain", "Symbol": "K", "Value": "0.365", "Unit": "DN/e-"}


def test_numbers_are_those_of_the_rows_to_the_last_digit(tmp_path):
    sheet = DataSheet({}, derived_values(VALUES))
    write_xml_sheet(sheet, tmp_path / "sheet.xml")
    _, found = read(tmp_path / "sheet.xml")
    rows = {(section, name): (unit, value) for section, name, _, unit, value in sheet_rows(sheet)}
    assert rows == {
        (section, name): (each["Unit"] or "", float(each["Value"]))
        for section, part in found.items()
        for name, each in part.items()
    }
    assert rows["sensitivity", "u_p_min"][1] == pytest.approx((0.89 / 0.365 + 0.5) / 0.625)


def test_curves_are_data_of_one_element(tmp_path):
    curves = {"wavelength": np.array([400.0, 410.0]), "red": np.array([1.5, 2.25])}
    write_xml_sheet(DataSheet({}, {}, curves), tmp_path / "sheet.xml")
    data = ElementTree.parse(tmp_path / "sheet.xml").find("sensitivity/QE_spectral/Data")
    assert {each.tag: each.text for each in data} == {"wavelength": "400.0 410.0", "red": "1.5 2.25"}


def test_every_quantity_has_one_name():
    names = [name for part in QUANTITIES.values() for name in part]
    assert len(names) == len(set(names))
