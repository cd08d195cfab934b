"""Measurements of EMVA 1288 Release 4.0 Linear, from raw files to a report."""
