"""Meshes that several tests of stages share."""

import pytest
from stage_cases import mesh_of


@pytest.fixture(scope="module")
def pit(tmp_path_factory):
    return mesh_of("pit", tmp_path_factory.mktemp("pit"))


@pytest.fixture(scope="module")
def column(tmp_path_factory):
    return mesh_of("column", tmp_path_factory.mktemp("column"))
