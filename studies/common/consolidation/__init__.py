"""Consolidation of a site."""
