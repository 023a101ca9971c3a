"""Exports of datasets to the forms that other people's programs read: see docs/export.md."""
