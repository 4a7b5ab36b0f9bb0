"""Sides that absorb waves, and waves that come in through them, against waves in one dimension."""

import numpy as np
import pytest
from core_cases import box, by_id, moduli, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
LAME, SHEAR, MODULUS = moduli(YOUNG, POISSON)
SPEEDS = {0: np.sqrt(MODULUS / DENSITY), 1: np.sqrt(SHEAR / DENSITY)}
AMPLITUDE = 1e-5


def column(count=60, *, law=ELASTIC, size=1.0, resting=False, along=0):
    """A bar of one cell's width along x that moves only along x or, in shear, along y."""
    model = mpm.Model(box((count, 1), (size, size / count)), law)
    model.seed(density=DENSITY, per_cell=10)
    for tag in range(1, 5):
        model.roller(tag, np.eye(2)[1 - along])
    if resting:
        model.rest(where=None if resting is True else resting)
    return model


@pytest.mark.parametrize("along", [0, 1])
@pytest.mark.parametrize("resting", [False, True])
def test_less_than_a_hundredth_of_a_wave_comes_back_at_normal_incidence(along, resting):
    # Pulses of 40 cells come in through both ends, cross the bar, and leave it at the other end.
    model = column(80, along=along, resting=resting)
    across = 1.0 / SPEEDS[along]
    time = np.linspace(0.0, 0.5 * across, 201)
    model.absorb((1, 2))
    model.shake(mpm.Motion(time, AMPLITUDE * np.sin(2 * np.pi * time / across) ** 2), np.eye(2)[along])
    report = run(model, 0.75 * across, conversion=None)
    middle = np.abs(model.mesh.points[:, 0] - 0.5).argmin()
    assert model.nodal("velocity")[middle, along] == pytest.approx(
        2 * AMPLITUDE, rel=0.03
    )  # both pulses, one upon the other
    highest = report.kinetic_energy
    report = run(model, 1.8 * across, conversion=None)
    assert np.abs(model.nodal("velocity")[:, along]).max() < 0.01 * AMPLITUDE
    assert report.kinetic_energy < 3e-4 * highest
    # what the dashpots took is work done on the bar: nothing is lost in the balance
    assert abs(report.unexplained_energy) < 1e-4 * highest


def velocities_behind_a_pulse(dim, along, per_wave, length, resting):
    """Means over the sections of a bar after a pulse of unit length has travelled 1.5; its middle was at x = 1."""
    count = round(length * per_wave)
    lengths = (length, *(1.0 / per_wave,) * (dim - 1))
    model = mpm.Model(box((count, *(1,) * (dim - 1)), lengths, diagonals="alternating"), ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 10, 3: 8}[dim])
    p = model.particles
    of_cell = np.bincount(p.cell, pulse(p.position[:, 0])) / np.bincount(p.cell)
    stress = np.zeros_like(p.stress)
    stress[:, 3 if along else 0] = -AMPLITUDE * DENSITY * SPEEDS[along] * of_cell[p.cell]
    if not along:
        stress[:, 1:3] = LAME / MODULUS * stress[:, :1]
    p.set("stress", stress)
    p.set("velocity", AMPLITUDE * pulse(p.position[:, :1]) * np.eye(dim)[along])
    for tag in range(1, 2 * dim + 1):
        for axis in set(range(dim)) - {along}:
            model.roller(tag, np.eye(dim)[axis])
    if resting:
        model.rest()
    model.absorb((1, 2))
    run(model, 1.5 / SPEEDS[along], conversion=None, energy_limit=None)
    section = np.rint(model.mesh.points[:, 0] * per_wave).astype(int)
    return np.bincount(section, model.nodal("velocity")[:, along]) / np.bincount(section) / AMPLITUDE


def pulse(x):
    return np.where(np.abs(x - 1.0) < 0.5, np.cos(np.pi * (x - 1.0)) ** 2, 0.0)


@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize("along", [0, 1])
@pytest.mark.parametrize("dim", [2, 3])
def test_what_comes_back_is_less_than_a_hundredth_and_of_second_order(dim, along, resting):
    """Reflected is what a bar that goes on does not have at the same places: dispersion is in both, and cancels."""
    reflected = []
    for per_wave in (20, 40):
        ends, goes_on = (
            velocities_behind_a_pulse(dim, along, per_wave, length, resting)[: int(1.7 * per_wave)]
            for length in (1.75, 3.25)
        )
        reflected.append(np.abs(ends - goes_on).max())
    assert reflected[0] < 0.01 and reflected[0] / reflected[1] > 3


@pytest.mark.parametrize("resting", [False, True])
def test_springs_carry_a_load_that_comes_later_as_a_layer_of_their_thickness(resting):
    # Weight along the bar after the side began to absorb: stiffness M / thickness under the whole bar's weight.
    model = column(10, along=0)
    if resting:
        model.rest()
    model.absorb(2, thickness=3.0)
    model.set_gravity((1e-3, 0.0))
    run(model, 3.0, damping=0.7, conversion=None)
    at_side = model.particles.displacement[model.particles.position[:, 0] > 0.9, 0].mean()
    weight = DENSITY * 1e-3 * 1.0
    compression = weight / MODULUS * 0.05  # of the last tenth of the bar, at most
    assert at_side == pytest.approx(weight * 3.0 / MODULUS, abs=1.2 * compression)


def test_what_holds_a_side_in_equilibrium_goes_on_to_hold_it():
    model = column(20, along=0)
    model.fix(1)
    x = model.particles.position[:, 0]
    stress = np.zeros_like(model.particles.stress)
    cells = np.bincount(model.particles.cell, x) / np.bincount(model.particles.cell)
    stress[:, 0] = DENSITY * 9.81 * (1.0 - cells[model.particles.cell])
    model.particles.set("stress", stress)
    model.set_gravity((9.81, 0.0))
    model.release(1)
    model.absorb(1)
    report = run(model, 0.2, conversion=None)
    scale = 9.81 * 0.2  # free fall
    assert np.abs(model.particles.velocity).max() < 0.01 * scale and report.mass > 0


@pytest.mark.parametrize("resting", [False, True])
def test_energy_that_has_left_is_what_an_error_is_compared_with(resting):
    # A pulse comes in through one end, and has left there again: the work that it did, rho c times the integral of v^2, which is
    # 3/8 A^2 T for A sin^2, is gone from the balance. Runs that report once, or go on from another, know of it all the same.
    model = column(80, along=1, resting=resting)
    across = 1.0 / SPEEDS[1]
    time = np.linspace(0.0, 0.5 * across, 201)
    model.absorb(1)
    model.shake(mpm.Motion(time, AMPLITUDE * np.sin(2 * np.pi * time / across) ** 2), (0.0, 1.0))
    came_in = DENSITY * SPEEDS[1] * 0.375 * AMPLITUDE**2 * 0.5 * across / 80
    for until in (3.5 * across, 4.0 * across):
        report = run(model, until, conversion=None)
        assert report.external_work < 1e-3 * came_in
        assert report.energy_scale == pytest.approx(came_in, rel=0.01)


@pytest.mark.parametrize("resting", [False, True])
@pytest.mark.parametrize("frequency", [0.6, 1.0, 1.5])
def test_a_layer_over_a_half_space_amplifies_as_in_closed_form(frequency, resting):
    # Surface over outcrop: 1 / sqrt(cos^2 kH + (alpha sin kH)^2), alpha = rho c of the layer over that of the rock;
    # `frequency` in units of the layer's own, c / 4H.
    height, alpha, count = 1.0, 0.25, 24
    model = column(count, size=height, along=1, resting=resting)
    own = DENSITY * SPEEDS[1]
    model.absorb(1, impedances=(DENSITY * SPEEDS[0] / alpha, own / alpha))
    omega = 2 * np.pi * frequency * SPEEDS[1] / (4 * height)
    periods, steps = 14, 400
    time = np.linspace(0.0, periods * 2 * np.pi / omega, periods * steps + 1)
    grows = np.clip(time * omega / (2 * np.pi) / 3, 0, 1)
    model.shake(mpm.Motion(time, 1e-6 * grows * np.sin(omega * time)), (0.0, 1.0))
    surface = model.mesh.points[:, 0] > height * (1 - 1e-9)
    end, samples = time[-1], []
    for report in model.explicit(until=end, every=end / (periods * 24), conversion=None, energy_limit=None):
        if report.time > 0.75 * end:
            samples.append((report.time, model.nodal("velocity")[surface, 1].mean()))
    t, v = np.array(samples).T
    amplitude = np.hypot(*np.linalg.lstsq(np.column_stack([np.sin(omega * t), np.cos(omega * t)]), v, rcond=None)[0])
    phase = 0.5 * np.pi * frequency
    expected = 1 / np.hypot(np.cos(phase), alpha * np.sin(phase))
    assert amplitude / 2e-6 == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("dim", [2, 3])
def test_corner_nodes_have_the_dashpots_of_all_their_sides(dim):
    # A block in free flight towards its corner, absorbing there: d(m v)/dt = -C v summed over all nodes; each side, of
    # area 1, resists motion along its normal by rho c_p and across it by rho c_s.
    model = mpm.Model(box((4,) * dim), ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 10, 3: 8}[dim])
    velocity = 1e-6 * np.arange(1.0, dim + 1)
    model.particles.set("velocity", np.tile(velocity, (len(model.particles), 1)))
    model.absorb(tuple(2 * axis + 2 for axis in range(dim)))
    dt, before = 1e-7, np.array(model.report().momentum[:dim])
    model.explicit(dt, dt=dt, energy_limit=None).last()
    force = (np.array(model.report().momentum[:dim]) - before) / dt
    resistance = DENSITY * (SPEEDS[0] + (dim - 1) * SPEEDS[1])
    np.testing.assert_allclose(force, -resistance * velocity, rtol=1e-3)  # nodes slow down by 0.04 % within the step


def test_a_run_with_absorbing_sides_goes_on_from_a_checkpoint(tmp_path):
    motion = mpm.Motion([0.0, 0.01, 0.02, 0.03], [0.0, 1e-4, -1e-4, 0.0])
    models = []
    for way in ("whole", "resumed"):
        model = column(20, along=1, resting=lambda x: x[:, 0] > 0.5)
        model.absorb(1, thickness=5.0)
        model.shake(motion, (0.0, 1.0))
        run(model, 0.012, conversion=None)
        if way == "resumed":
            model.save(tmp_path / "sides.h5")
            model = column(20, along=1)
            model.restore(tmp_path / "sides.h5")
        run(model, 0.05, conversion=None)
        models.append(model)
    assert np.abs(models[0].particles.velocity).max() > 0
    for name in ("velocity", "stress", "displacement"):
        np.testing.assert_array_equal(by_id(models[0], name), by_id(models[1], name))


@pytest.mark.parametrize(
    "use, message",
    [
        (lambda model: model.absorb(9), "facet_tag"),
        (lambda model: model.absorb(2, thickness=0.0), "thickness is 0.0 m, expected a positive number"),
        (lambda model: model.absorb(2, impedances=(1.0, -1.0)), r"impedances\[1\] is -1.0"),
        (lambda model: model.absorb(2, impedances=(1.0, 2.0)), r"impedances is \(1.0, 2.0\) kg/\(m2 s\), expected that of the compression"),
        (lambda model: model.shake(mpm.Motion([0, 1], [0, 1]), (1, 0)), "no side absorbs"),
        (lambda model: model.absorb(2, free_field="no"), "free_field is 'no', expected True or False"),
        (lambda model: model.absorb(2) or model.shake(3.0, (1, 0)), "motion is 3.0, expected a Motion"),
        (lambda model: model.absorb(2) or list(model.implicit(1.0, dt=0.1)), "does not support sides that absorb"),
    ],
)  # fmt: skip
def test_bad_input_is_refused(use, message):
    model = column(4)
    with pytest.raises(mpm.InputError, match=message):
        use(model)


def test_a_side_without_soil_is_refused():
    model = mpm.Model(box((4, 4), body=((0, 0), (0.5, 1))), ELASTIC)
    model.seed(density=DENSITY, cell_tag=1)
    with pytest.raises(mpm.InputError, match="facet_tag 2 has no soil at its facets"):
        model.absorb(2)


def test_an_accelerogram_gives_back_its_motion_whatever_the_unit(tmp_path):
    # v = sin^2(pi t) over one second begins and ends at rest: no baseline error but that of the trapezia, and none with it
    time = np.linspace(0.0, 1.0, 501)
    acceleration = np.pi * np.sin(2 * np.pi * time)
    for unit, factor in {"m/s2": 1.0, "cm/s2": 100.0, "g": 1 / 9.80665}.items():
        path = tmp_path / "record.txt"
        rows = "\n".join(f"{t:.17g}, {factor * a:.17g}" for t, a in zip(time, acceleration))
        path.write_text("# time [s], acceleration\n" + rows + "\n")
        motion = mpm.read_accelerogram(path, unit=unit, baseline=None)
        np.testing.assert_allclose(motion.velocity, np.sin(np.pi * time) ** 2, atol=2e-5)
    with pytest.raises(mpm.InputError, match="unit is 'gal'"):
        mpm.read_accelerogram(path, unit="gal")
    path.write_text("0 1 2\n1 2 3\n")
    with pytest.raises(mpm.InputError, match="has 3 columns, expected time and acceleration"):
        mpm.read_accelerogram(path, unit="g")
    with pytest.raises(mpm.InputError, match="cannot be read"):
        mpm.read_accelerogram(tmp_path / "nothing", unit="g")


PEER = """PEER NGA STRONG MOTION DATABASE RECORD
Imaginary-01, 1/1/2000, Nowhere, 90
ACCELERATION TIME SERIES IN UNITS OF G
{last}
  .1000000E-01 -.2000000E-01  .3000000E+00  .0000000E+00 -.1000000E+00
  .5000000E-01  .2000000E-01
"""


@pytest.mark.parametrize(
    "last",
    [
        "NPTS=     7, DT=   .0050 SEC,",
        "NPTS= 7  DT= 5.0E-03 SEC",
        "NPTS= 7, DT= 5.E-03 SEC",
        "    7    0.0050    NPTS, DT",
        "    7    5.E-3    NPTS, DT",
    ],
)
def test_a_file_of_the_peer_database_is_read(tmp_path, last):
    path = tmp_path / "RSN1.AT2"
    path.write_text(PEER.format(last=last))
    time, acceleration = mpm.read_acceleration(path)
    np.testing.assert_allclose(time, 0.005 * np.arange(7), rtol=1e-12)
    np.testing.assert_allclose(acceleration, 9.80665 * np.array([0.01, -0.02, 0.3, 0, -0.1, 0.05, 0.02]), rtol=1e-12)
    np.testing.assert_array_equal(mpm.read_acceleration(path, unit="g")[1], acceleration)


@pytest.mark.parametrize("change, unit, message", [
    (("NPTS=     7", "NPTS=     8"), None, "has 7 values, expected 8 as its header says"),
    (("ACCELERATION", "VELOCITY"), None, "has velocities or displacements by its header"),
    ((".3000000E+00", "*****"), None, "cannot be read: could not convert"),
    (("IN UNITS OF G", ""), None, "unit is None, expected that of accelerogram .*, whose header does not name it"),
    (("", ""), "m/s2", "unit is 'm/s2', expected 'g' as the header of accelerogram"),
])  # fmt: skip
def test_wrong_files_of_the_peer_database_are_named(tmp_path, change, unit, message):
    path = tmp_path / "RSN1.AT2"
    path.write_text(PEER.format(last="NPTS=     7, DT=   .0050 SEC,").replace(*change))
    with pytest.raises(mpm.InputError, match=message):
        mpm.read_acceleration(path, unit=unit)


def test_headers_of_peer_files_in_other_units_and_encodings(tmp_path):
    text = PEER.format(last="NPTS=     7, DT=   .0050 SEC,").replace("UNITS OF G", "UNITS OF CM/S/S")
    path = tmp_path / "RSN1.AT2"
    path.write_bytes(text.replace("Nowhere", "Erzincan Yöresi").encode("latin-1"))
    assert mpm.read_acceleration(path)[1][2] == pytest.approx(0.01 * 0.3)
    with pytest.raises(mpm.InputError, match="unit is 'g', expected 'cm/s2' as the header of accelerogram"):
        mpm.read_acceleration(path, unit="g")


def test_columns_divided_by_semicolons_may_have_decimal_commas(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("# t; a\n0,00;1,5\n0,01;-2,5\n")
    time, acceleration = mpm.read_acceleration(path, unit="cm/s2")
    np.testing.assert_allclose(time, [0, 0.01])
    np.testing.assert_allclose(acceleration, [0.015, -0.025])
    with pytest.raises(mpm.InputError, match="unit is None, expected that of accelerogram"):
        mpm.read_acceleration(path)


def test_the_baseline_correction_takes_out_an_error_of_the_records_zero():
    # A constant error e of the acceleration is an error e t of the velocity, which lies in the polynomials: the corrected
    # motion does not depend on e.
    time = np.linspace(0.0, 10.0, 2001)
    acceleration = np.sin(3 * time) * np.exp(-((time - 5) ** 2))
    clean = mpm.motion_of_acceleration(time, acceleration)
    wrong = mpm.motion_of_acceleration(time, acceleration + 0.3)
    np.testing.assert_allclose(wrong.velocity, clean.velocity, atol=1e-12)
    assert abs(mpm.motion_of_acceleration(time, acceleration + 0.3, baseline=None).velocity[-1]) > 2.9
    with pytest.raises(mpm.InputError, match="baseline is 9"):
        mpm.motion_of_acceleration(time, acceleration, baseline=9)
    with pytest.raises(mpm.InputError, match="expected rising times"):
        mpm.Motion([0.0, 0.0], [1.0, 1.0])
