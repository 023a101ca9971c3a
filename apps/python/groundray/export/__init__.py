"""Exports of datasets to third-party formats; see docs/reference/export.md."""
