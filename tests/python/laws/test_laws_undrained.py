"""Undrained soil under a strip load: pore pressures by closed form, and without oscillation when strains are averaged."""

import numpy as np
import pytest
from core_cases import box, rollers

import mpm_core as mpm

PRESSURE, SIDE, HALF_WIDTH = 10e3, 8.0, 1.0
WATER = {"water_modulus": 2e9, "porosity": 0.4}  # 500 times as stiff as the skeleton: next to incompressible
SKELETONS = {
    "elastic": mpm.LinearElastic(young=10e6, poisson=0.3),
    "Mohr-Coulomb": mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=3e3, friction_angle=20.0),
}


def strip(law):
    """A strip load on one half of a block without weight, symmetric about x = 0."""
    whole = box([16, 16], [SIDE, SIDE])  # diagonals all one way: the mesh that oscillates most
    x, y = whole.points[whole.facets].mean(axis=1).T
    tags = np.select([x < 1e-9, x > SIDE - 1e-9, y < 1e-9, x < HALF_WIDTH], [1, 2, 3, 5], 4).astype(np.int32)
    model = mpm.Model(mpm.Mesh(whole.points, whole.cells, facets=whole.facets, facet_tags=tags), law)
    model.seed(density=2000.0, per_cell=3)
    rollers(model, [0])
    model.fix(3)
    model.traction(5, (0, -PRESSURE))
    return model


def cell_pressures(model):
    """Excess pore pressure of each cell: the mean of its particles."""
    cell = model.particles.cell
    return np.bincount(cell, model.state("excess_pore_pressure")) / np.bincount(cell)


def jump(mesh, values):
    """Root mean square of the jumps between cells with a common side."""
    sides = {}
    for number, cell in enumerate(mesh.cells):
        for corner in range(3):
            sides.setdefault(tuple(sorted(np.delete(cell, corner))), []).append(number)
    pairs = np.array([pair for pair in sides.values() if len(pair) == 2])
    return np.sqrt(np.mean(np.diff(values[pairs], axis=1) ** 2))


def half_space(mesh):
    """u = p alpha / pi under a strip on a half-space without change of volume, alpha the angle at which the strip is seen.

    The mean of the stresses in the plane; sigma_zz is that too. Source: Poulos, Davis (1974), Elastic Solutions for Soil and
    Rock Mechanics, section 3.1.
    """
    x, y = mesh.points[mesh.cells].mean(axis=1).T
    depth = SIDE - y
    return PRESSURE / np.pi * (np.arctan((x + HALF_WIDTH) / depth) - np.arctan((x - HALF_WIDTH) / depth))


@pytest.fixture(scope="module")
def found():
    results = {}
    for name, skeleton in SKELETONS.items():
        for nmd in (False, True):
            model = strip(mpm.Undrained(skeleton, **WATER))
            list(model.implicit(1.0, dt=0.25, quasi_static=True, nmd=nmd))
            results[name, nmd] = model.mesh, cell_pressures(model), model.particles.plastic_strain
    return results


@pytest.mark.parametrize("skeleton", SKELETONS)
def test_averaged_strains_leave_no_oscillation_of_the_pore_pressure(found, skeleton):
    mesh, smooth, plastic = found[skeleton, True]
    _, rough, _ = found[skeleton, False]
    assert (plastic.max() > 0) == (skeleton != "elastic")
    of_the_solution = jump(mesh, half_space(mesh))  # cells of some size jump by the gradient
    assert jump(mesh, smooth) < 2.5 * of_the_solution
    assert jump(mesh, rough) > 20 * jump(mesh, smooth)


def test_averaged_pore_pressures_are_those_of_the_half_space(found):
    mesh, pressure, _ = found["elastic", True]
    x, y = mesh.points[mesh.cells].mean(axis=1).T
    near = (x < 3) & (y > SIDE - 3)  # the walls are farther away
    error = np.sqrt(np.mean((pressure - half_space(mesh))[near] ** 2))
    assert error < 0.07 * PRESSURE
    without = np.sqrt(np.mean((found["elastic", False][1] - half_space(mesh))[near] ** 2))
    assert without > PRESSURE
