"""Stages of construction of a site."""
