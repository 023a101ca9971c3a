"""Runs on many machines, with datasets in object stores; see docs/reference/cluster.md."""
