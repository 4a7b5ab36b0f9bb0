"""Structural members in bodies of finite elements."""
