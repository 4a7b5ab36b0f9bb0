"""Axisymmetric sites: a falling cylinder, a cavity, and the mistakes that bodies of revolution invite."""

from argparse import Namespace

import numpy as np
import pytest
import study_main
from common.interrupt import Interrupt
from common.site import slides
from common.site.file import read_site
from common.stages.runs import movements
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

YOUNG, POISSON, HEIGHT = 10e6, 0.3, 0.5
SITE = f"""
mesh = "cylinder.geo"
axisymmetric = true
[soils.soil]
unit_weight = 20e3
material = "mohr-coulomb"
young = {YOUNG}
poisson = {POISSON}
cohesion = 1e9
friction_angle = 0
"""
HELD = '[supports]\nbase = "fixed"\naxis = "roller"\n'


def site_in(folder, text, inner=0.0, outer=1.0, below=1.0, cell_size=0.25, sides="axis"):
    """A site of a cylinder, or of a ring, with air below it; sides: name of its inner boundary."""
    lines = ['SetFactory("OpenCASCADE");', f"Rectangle(1) = {{{inner}, 0, 0, {outer - inner}, {below}}};" if below else "",
             f"Rectangle(2) = {{{inner}, {below}, 0, {outer - inner}, {HEIGHT}}};", "Coherence;" if below else "",
             'Physical Surface("air") = {1};' if below else "", 'Physical Surface("soil") = {2};', "e = 1e-6;"]  # fmt: skip
    top = below + HEIGHT
    boxes = {"base": (inner, 0, outer, 0), "top": (inner, top, outer, top), sides: (inner, 0, inner, top), "right": (outer, 0, outer, top)}  # fmt: skip
    for name, (x0, y0, x1, y1) in boxes.items():
        lines.append(f'Physical Curve("{name}") = {{Curve In BoundingBox{{{x0}-e, {y0}-e, -e, {x1}+e, {y1}+e, e}}}};')
    (folder / "cylinder.geo").write_text("\n".join([*lines, f"Mesh.MeshSizeMax = {cell_size};"]) + "\n")
    (folder / "site.toml").write_text(text)
    return folder / "site.toml"


def test_the_energy_of_a_slide_is_that_of_the_whole_body(tmp_path):
    """A cylinder that falls freely has m (g t)^2 / 2 with the mass of the whole cylinder, and v^2 = 2 g h."""
    model = read_site(site_in(tmp_path, SITE + HELD), MPI.COMM_WORLD).particles(per_cell=3)
    a = Namespace(time=0.2, frames=2, damping=0.0, pic=0.0, nmd=True)
    with Interrupt(MPI.COMM_WORLD) as interrupt:
        found, stopped = slides.slide(a, model, tmp_path, interrupt)
    mass, velocity = 20e3 / 9.81 * np.pi * 1.0**2 * HEIGHT, 9.81 * 0.2
    assert stopped is None
    assert found.history["kinetic_energy_J"][-1] == pytest.approx(0.5 * mass * velocity**2, rel=5e-3)
    assert found.history["largest_displacement_m"][-1] == pytest.approx(velocity**2 / (2 * 9.81), rel=1e-2)


def test_a_pressure_widens_a_cavity_as_lame_says(tmp_path):
    """A ring from 1 to 4 m whose outer side is held: u = ((1 - 2 nu) A r + B / r) / 2G with sigma_r = A - B / r^2."""
    text = SITE + '[supports]\nbase = "roller"\ntop = "roller"\nright = "roller"\n[[stages]]\nfill = "soil"\n'
    path = site_in(
        tmp_path, text + "unit_weight = {soil = 0.0}\npressure = {inside = 100e3}\n", 1.0, 4.0, 0.0, 0.2, "inside"
    )
    site = read_site(path, MPI.COMM_WORLD)
    fem = site.finite_elements(2)
    list(bridge.carry_out(bridge.FemSite(fem), site.stages))
    shear, part = YOUNG / 2 / (1 + POISSON), 1 - 2 * POISSON
    inner = -100e3 / (1 + part * 4.0**2)  # from u = 0 at r = 4, and sigma_r = -p at r = 1
    for r in (1.0, 2.0, 3.0):
        u = fem.evaluate_at(np.array([[r, 0.25]]))["displacement"][0, 0]
        assert u == pytest.approx((part * inner * r - part * inner * 4.0**2 / r) / (2 * shear), rel=2e-3)


def test_a_mesh_beyond_the_axis_is_refused(tmp_path):
    with pytest.raises(
        mpm.InputError, match="site.toml: axisymmetric is true, but the mesh begins at x = -1 m; expected x from 0 on"
    ):
        read_site(site_in(tmp_path, SITE + HELD, inner=-1.0), MPI.COMM_WORLD)


@pytest.mark.parametrize(
    ("inner", "name", "supports", "warned"),
    [(0.2, "axis", HELD, True), (0.2, "left", "", True), (0.0, "axis", HELD, False), (0.0, "left", "", False),
     (0.2, "left", '[supports]\nbase = "fixed"\nleft = "roller"\n', False), (0.2, "axis", '[supports]\nbase = "fixed"\n', False)],
)  # fmt: skip
def test_an_axis_that_is_not_at_zero_is_doubted(tmp_path, recwarn, inner, name, supports, warned):
    read_site(site_in(tmp_path, SITE + supports, inner, sides=name), MPI.COMM_WORLD)
    said = f"the boundary '{name}' is at x = 0.2 m, but the axis of an axisymmetric site is at x = 0"
    assert any(said in str(one.message) for one in recwarn) == warned


@pytest.mark.parametrize("option", [["--seismic-coefficient", "0.1"], ["--critical-seismic"]])
def test_no_inertia_along_the_radius(tmp_path, option):
    path = site_in(tmp_path, SITE + HELD)
    result = study_main.ended("safety", tmp_path / "out", "--site", path, *option)
    assert result.returncode == 2 and not (tmp_path / "out").exists()
    assert option[0] in result.stderr and "is axisymmetric: inertia along the radius" in result.stderr
    assert "expected a plane section or a body in three dimensions" in result.stderr


def test_an_axis_without_a_support_is_an_error(tmp_path):
    site = read_site(site_in(tmp_path, SITE + '[supports]\nbase = "fixed"\n', below=0.0), MPI.COMM_WORLD)
    with pytest.raises(
        mpm.InputError, match="nodes lie on the axis and may move along the radius, expected a roller there"
    ):
        site.finite_elements(1)


def test_the_largest_settlement_is_that_of_the_surface(tmp_path):
    """A cylinder between rollers under a pressure: u = p H / M at its top, whatever the cells; a cell's middle moves less."""
    text = SITE + '[supports]\nbase = "fixed"\naxis = "roller"\nright = "roller"\n'
    path = site_in(
        tmp_path,
        text + '[[stages]]\nfill = "soil"\nunit_weight = {soil = 0.0}\npressure = {top = 100e3}\n',
        below=0.0,
        cell_size=0.5,
    )
    site = read_site(path, MPI.COMM_WORLD)
    staged = bridge.FemSite(site.finite_elements(1))
    list(bridge.carry_out(staged, site.stages))
    modulus = YOUNG * (1 - POISSON) / (1 + POISSON) / (1 - 2 * POISSON)
    moved = movements(staged)
    assert moved["settlement_m"] == pytest.approx(100e3 * HEIGHT / modulus, rel=1e-6)
    assert moved["heave_m"] < 1e-12 and moved["sideways_m"] < 1e-9
