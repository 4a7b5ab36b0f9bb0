"""What laws get of an increment: time, duration, size of the cell, deformation gradient; for particles and elements."""

import subprocess

import numpy as np
import pytest
from core_cases import box, run
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

RECORDING = """
void umat_(double* stress, double* statev, double* ddsdde, double* sse, double* spd, double* scd, double* rpl,
           double* ddsddt, double* drplde, double* drpldt, const double* stran, const double* dstran,
           const double* time, const double* dtime, const double* temp, const double* dtemp, const double* predef,
           const double* dpred, const char* cmname, const int* ndi, const int* nshr, const int* ntens,
           const int* nstatv, const double* props, const int* nprops, const double* coords, const double* drot,
           double* pnewdt, const double* celent, const double* dfgrd0, const double* dfgrd1)
{
  for (int k = 0; k < *ntens; ++k)
  {
    stress[k] += 1e5 * dstran[k];
    ddsdde[k * (*ntens + 1)] = 1e5;
  }
  statev[0] = time[1];
  statev[1] = *dtime;
  statev[2] = *celent;
  for (int k = 0; k < 9; ++k)
  {
    statev[3 + k] = dfgrd0[k];
    statev[12 + k] = dfgrd1[k];
  }
}
"""


@pytest.fixture(scope="module")
def law(tmp_path_factory):
    """A UMAT that records what it is given: time, duration, cell size, and both deformation gradients by columns."""
    place = tmp_path_factory.mktemp("recording")
    (place / "umat.c").write_text(RECORDING)
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", place / "umat.so", place / "umat.c"], check=True)
    return mpm.Umat(str(place / "umat.so"), properties=[0.0], n_variables=21, p_wave_modulus=1e5)


def recorded(state, law):
    """(time, duration, cell size, DFGRD0, DFGRD1) of points, the gradients as (n, 3, 3)."""
    first = law.state_names.index("statev_1")
    values = state[:, first : first + 21]
    gradients = np.swapaxes(values[:, 3:].reshape(-1, 2, 3, 3), 2, 3)  # Fortran
    return *values[:, :3].T, gradients[:, 0], gradients[:, 1]


def test_deformation_of_a_point_multiplies_up(law):
    test_state, stress = np.zeros((1, law.n_state)), np.zeros((1, 6))
    random, total = np.random.default_rng(1), np.eye(3)
    for k in range(5):
        f = np.eye(3) + random.normal(0, 0.1, (3, 3))
        e = 0.5 * (f + f.T) - np.eye(3)
        strain = np.array([[e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[0, 2]]])
        law.update(strain, stress, test_state, time=0.5 * k, dt=0.5, cell_size=np.array([0.2]), deformation=f[None])
        time, dt, size, before, after = recorded(test_state, law)
        assert (time[0], dt[0], size[0]) == (0.5 * k, 0.5, 0.2)
        assert before[0] == pytest.approx(total, abs=1e-14)
        total = f @ total
        assert after[0] == pytest.approx(total, abs=1e-14)


ROTATING = """
void umat_(double* stress, double* statev, double* ddsdde, double* sse, double* spd, double* scd, double* rpl,
           double* ddsddt, double* drplde, double* drpldt, const double* stran, const double* dstran,
           const double* time, const double* dtime, const double* temp, const double* dtemp, const double* predef,
           const double* dpred, const char* cmname, const int* ndi, const int* nshr, const int* ntens,
           const int* nstatv, const double* props, const int* nprops, const double* coords, const double* drot)
{
  const int row[] = {0, 1, 2, 0, 0, 1}, column[] = {0, 1, 2, 1, 2, 2};
  double before[3][3] = {{0}}, after[3][3] = {{0}};
  for (int k = 0; k < *ntens; ++k)
    before[row[k]][column[k]] = before[column[k]][row[k]] = statev[k];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l)
          after[i][j] += drot[3 * k + i] * before[k][l] * drot[3 * l + j];
  for (int k = 0; k < *ntens; ++k)
  {
    statev[k] = after[row[k]][column[k]];
    statev[6 + k] = stran[k] + dstran[k];
    ddsdde[k * (*ntens + 1)] = 1e5;
  }
}
"""


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("scheme", ["explicit", "dual domains", "implicit"])
def test_tensors_of_a_umat_turn_with_the_material(tmp_path, scheme, dim):
    """Those in STATEV by DROT as the stress, which this law leaves as it is; and STRAN, before each increment adds to it."""
    (tmp_path / "umat.c").write_text(ROTATING)
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", tmp_path / "umat.so", tmp_path / "umat.c"], check=True)
    law = mpm.Umat(str(tmp_path / "umat.so"), properties=[0.0], n_variables=12, p_wave_modulus=1e5)
    model, steps, dt = moving_box(law, dim), 4, 0.5  # shears by 0.02 and shortens by 0.03 in each step
    components = [0, 1, 2, 3] if dim == 2 else [0, 1, 2, 3, 5, 4]  # in Abaqus's order
    first = law.state_names.index("statev_1")
    stress = np.tile([3.0, -1.0, 0.5, 2.0, 0.7, -0.4][: len(components)], (len(model.particles), 1))
    state = np.zeros((len(stress), law.n_state))
    state[:, first : first + len(components)] = stress[:, components]
    model.particles.set("stress", stress)
    model.particles.set("state", state)
    if scheme != "implicit":
        integration = mpm.Integration.DUAL_DOMAIN if scheme == "dual domains" else mpm.Integration.PARTICLES
        run(model, steps * dt, dt=dt, allow_unstable=True, energy_limit=None, integration=integration)
    else:
        list(model.implicit(steps * dt, dt=dt, quasi_static=True))
    p = model.particles
    assert np.abs(p.stress - stress).max() > 0.05
    assert p.state[:, first : first + len(components)] == pytest.approx(p.stress[:, components], abs=1e-12)

    gradient, strain = np.zeros((3, 3)), np.zeros((3, 3))  # of a step
    gradient[range(dim), dim - 1] = dt * np.array([0.02] * (dim - 1) + [-0.03]) / 0.5
    half_spin = 0.25 * (gradient - gradient.T)
    turn = np.linalg.solve(np.eye(3) - half_spin, np.eye(3) + half_spin)
    for _ in range(steps):
        strain = turn @ strain @ turn.T + 0.5 * (gradient + gradient.T)
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    stran = ((strain + strain.T - np.diag(np.diag(strain)))[rows, columns])[: len(components)]
    assert p.state[:, first + 6 : first + 6 + len(components)] == pytest.approx(
        np.tile(stran, (len(stress), 1)), abs=1e-12
    )


def test_without_a_gradient_it_is_that_of_the_strain(law):
    state, stress = np.zeros((1, law.n_state)), np.zeros((1, 4))
    law.update(np.array([[0.01, 0.02, 0.03, 0.04]]), stress, state)
    _, dt, size, _, after = recorded(state, law)
    assert (dt[0], size[0]) == (1.0, 1.0)
    assert after[0] == pytest.approx(np.array([[1.01, 0.02, 0], [0.02, 1.02, 0], [0, 0, 1.03]]))


def moving_box(law, dim):
    """A box of one square or cube whose nodes all move: the base rests, the top moves down and along."""
    model = mpm.Model(box([1] * dim, [0.5] * dim, place=lambda x: x), law)
    model.seed(density=2000.0, per_cell=3 if dim == 2 else 4)
    model.fix(2 * dim - 1)
    model.prescribe(2 * dim, [0.02] * (dim - 1) + [-0.03])
    return model


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("nmd", [False, True])  # the volumetric strain is uniform, so that its mean changes nothing
@pytest.mark.parametrize("integration", mpm.Integration.__members__.values())
def test_explicit_particles(law, dim, nmd, integration):
    # In each step F grows by 1 + dt grad v with grad v = (v_top / h) e_y, since the mesh is put back after it
    model, steps, dt = moving_box(law, dim), 10, 0.01
    run(model, steps * dt, dt=dt, allow_unstable=True, nmd=nmd, integration=integration)
    step = np.eye(3)
    axes = np.arange(dim)
    step[axes, dim - 1] += dt * np.array([0.02] * (dim - 1) + [-0.03]) / 0.5
    time, duration, size, before, after = recorded(model.particles.state, law)
    assert time == pytest.approx((steps - 1) * dt) and duration == pytest.approx(dt)
    assert size == pytest.approx(0.5)  # simplices of squares, or cubes, of this side
    assert np.abs(before - np.linalg.matrix_power(step, steps - 1)).max() < 1e-12
    assert np.abs(after - np.linalg.matrix_power(step, steps)).max() < 1e-12


def test_implicit_particles(law):
    model = moving_box(law, 2)
    list(model.implicit(0.1, dt=0.05, quasi_static=True))
    step = np.eye(3)
    step[[0, 1], 1] += 0.05 * np.array([0.02, -0.03]) / 0.5
    time, duration, size, before, after = recorded(model.particles.state, law)
    assert time == pytest.approx(0.05) and duration == pytest.approx(0.05) and size == pytest.approx(0.5)
    assert np.abs(before - step).max() < 1e-12 and np.abs(after - step @ step).max() < 1e-12


def test_finite_elements(law):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [0.5, 0.5], [1, 1])
    fem = bridge.QuasiStatic(domain, law, facet_tags, [bridge.fixed(3), bridge.prescribed(4, (0.01, -0.02))], 1)
    for k in (1, 2):
        assert fem.equilibrate(bridge.Load(displacement=k / 2), duration=0.25).converged
    time, duration, size, _, after = recorded(fem.points.state, law)
    assert (time == 0.25).all() and (duration == 0.25).all() and size == pytest.approx(0.5)
    step = np.array([[1, 0.005, 0], [0.005, 0.98, 0], [0, 0, 1]])  # half of the strain, without rotation
    assert np.abs(after - step @ step).max() < 1e-12


def test_a_python_law_is_told_the_same():
    seen = []

    class Recording:
        n_state, p_wave_modulus = 1, 1e5

        def update(self, strain_increment, stress, state, tangent, increment):
            stress += 1e5 * strain_increment
            seen.append((increment.time, increment.dt, increment.cell_size, increment.deformation))

    model = moving_box(mpm.PythonLaw(Recording()), 2)
    run(model, 0.02, dt=0.01, allow_unstable=True)
    (_, _, _, _), (time, dt, size, deformation) = seen[-2:]
    assert (time, dt) == (0.01, 0.01) and size == pytest.approx(np.full(6, 0.5))
    assert deformation == pytest.approx(np.tile([[1, 0.01 * 0.04], [0, 1 - 0.01 * 0.06]], (6, 1, 1)))


@pytest.mark.parametrize(
    "step, text",
    [
        (lambda: mpm.ElementTest(3.0, [0.0] * 6), r"law is 3.0, expected a constitutive law"),
        (lambda: element().step([0.0] * 5 + ["much"]), "strain_increment is .*, expected numbers, or None"),
        (lambda: element().step([0.0] * 6, dt="1 s"), "dt is '1 s', expected a number"),
        (lambda: element().step([0.0] * 6, dt=-1.0), "dt is -1.0, expected 0 <= dt <= inf"),
        (lambda: element().step([0.0] * 6, dt=np.nan), "dt is nan, expected 0 <= dt <= inf"),
    ],
)
def test_bad_input_of_an_element_test_is_named(step, text):
    with pytest.raises(mpm.InputError, match=text):
        step()


def element():
    return mpm.ElementTest(mpm.LinearElastic(young=1e6, poisson=0.3), [0.0] * 6)
