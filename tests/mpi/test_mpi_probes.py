"""Probes: forces and states that are known beforehand, on any number of ranks."""

import csv

import numpy as np
import pytest
from mpi4py import MPI
from mpm_core.probes import ParticleProbe, PointProbe, ProbeFile, SectionProbe, TotalsProbe, nearest_particle
from partitions import all_by_id, bands, one_does_all, scattered, sliding_slope, spread_box

import mpm_core as mpm

DENSITY, G = 2000.0, 10.0


def column(comm, dim, owners_of=bands):
    """Soil up to half the height of a box, with the stresses of its own weight; it moves with a constant velocity."""
    counts, lengths = ([4, 8], [1.0, 2.0]) if dim == 2 else ([2, 2, 8], [1.0, 0.5, 2.0])
    mesh = spread_box(counts, lengths, comm, owners_of, body=([0.0] * dim, [*lengths[:-1], 1.0]))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=DENSITY, per_cell=3 if dim == 2 else 4, cell_tag=1)
    p = model.particles
    stress = np.zeros_like(p.stress)
    stress[:, dim - 1] = -DENSITY * G * (1.0 - p.position[:, -1])
    stress[:, dim if dim == 2 else 5] = 0.0
    p.set("stress", stress)
    p.set("velocity", np.tile(0.1 * (1 + np.arange(dim)), (len(p), 1)))
    return model, lengths


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_section_carries_the_weight_above_it(comm, dim, owners_of):
    model, lengths = column(comm, dim, owners_of)
    area = np.prod(lengths[:-1])
    # Stresses are linear over the row of cells that is cut, so their mean is that at its middle.
    for height, middle in ((0.3, 0.375), (0.6, 0.625), (0.875, 0.875)):
        section = SectionProbe(model, point=[0.0] * (dim - 1) + [height], normal=[0.0] * (dim - 1) + [2.0]).values()
        weight = DENSITY * G * (1.0 - middle) * area
        assert section["force_normal_N"] == pytest.approx(-weight, rel=1e-12)
        assert section[f"force_{'xyz'[dim - 1]}_N"] == pytest.approx(-weight, rel=1e-12)
        assert abs(section["force_x_N"]) < 1e-12 * weight
    half = SectionProbe(model, point=[0.0] * (dim - 1) + [0.6], normal=[0.0] * (dim - 1) + [1.0],
                        box=([0.0] * dim, [0.5, *lengths[1:]])).values()  # fmt: skip
    assert half["force_normal_N"] == pytest.approx(-DENSITY * G * 0.375 * area / 2, rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_points_see_what_is_there(comm, dim):
    model, lengths = column(comm, dim)
    middle = [0.37] if dim == 2 else [0.37, 0.17]
    found = PointProbe(model, [[*middle, 0.3], [*middle, 1.7]]).values()
    assert found["filled_0_fraction"] == pytest.approx(1.0) and found["filled_1_fraction"] == 0.0
    assert found["velocity_y_0_m/s"] == pytest.approx(0.2) and np.isnan(found["velocity_y_1_m/s"])
    vertical = "yy" if dim == 2 else "zz"
    assert (
        -DENSITY * G * 0.75 < found[f"stress_{vertical}_0_Pa"] < -DENSITY * G * 0.5
    )  # that cell reaches from 0.25 to 0.5
    with pytest.raises(mpm.InputError, match="points has .* outside of the mesh"):
        PointProbe(model, [[*middle, 2.7]])


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_of_several_nearest_particles_the_one_with_the_highest_number_is_followed(comm, owners_of):
    model = sliding_slope(comm, owners_of)
    points = [(0.6, 0.4), (0.35, 0.2), (0.1, 0.0)]
    start = all_by_id(model, ("initial_position",))
    for point, number in zip(points, ParticleProbe(model, points).ids):
        distance = np.hypot(*(start["initial_position"] - point).T)
        ties = start["id"][np.isclose(distance, distance.min(), rtol=1e-9, atol=0)]
        assert number == ties.max() == nearest_particle(model, point)
        assert point != points[1] or len(ties) > 1


@pytest.mark.parametrize("owners_of", [bands, one_does_all])
def test_a_particle_is_followed_over_ranks(comm, owners_of):
    model, alone = sliding_slope(comm, owners_of), sliding_slope(MPI.COMM_SELF)
    looks = []
    for each in (model, alone):
        probe = ParticleProbe(each, [(0.6, 0.4), (0.1, 0.0)])
        first = probe.values()
        assert np.hypot(first["position_x_0_m"] - 0.6, first["position_y_0_m"] - 0.4) < 0.1
        list(each.explicit(1.0, pic=0.01, dt=1e-3))
        looks.append((probe.ids, probe.values()))
    (ids, here), (same, there) = looks
    assert ids == same and here["displacement_x_0_m"] > 0.5
    for name, value in there.items():
        assert here[name] == pytest.approx(
            value, rel=1e-6, abs=1e-6 * abs(there["stress_yy_0_Pa"] if "Pa" in name else 1)
        ), name


def test_a_file_goes_on_after_a_restart(comm, shared_path):
    model = sliding_slope(comm)
    with ProbeFile(shared_path / "totals.csv", TotalsProbe(model)) as totals:
        for report in model.explicit(0.3, every=0.1):
            totals.record()
            if report.time < 0.25:
                model.save(shared_path / "state.h5")
    again = sliding_slope(comm)
    again.restore(shared_path / "state.h5")
    with ProbeFile(shared_path / "totals.csv", TotalsProbe(again), keep=True) as totals:
        totals.record()
        for _ in again.explicit(0.3, every=0.1, since=0.0):
            totals.record()
    comm.barrier()
    with open(shared_path / "totals.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["time_s"]) for row in rows] == pytest.approx([0.1, 0.2, 0.3])
    last = again.report()
    assert float(rows[-1]["kinetic_energy_J"]) == pytest.approx(last.kinetic_energy, rel=1e-8)
    assert float(rows[-1]["momentum_x_N.s"]) == pytest.approx(last.momentum[0], rel=1e-8)
    assert float(rows[-1]["particles"]) == last.particles


def test_errors_are_raised_on_all_ranks(comm, shared_path):
    model = sliding_slope(comm)
    with pytest.raises(mpm.InputError, match="No such file or directory"):
        ProbeFile(shared_path / "none" / "a.csv", TotalsProbe(model))
    with pytest.raises(mpm.InputError, match="normal of the section has no length"):
        SectionProbe(model, point=(0, 0), normal=(0, 0))
    if comm.rank == 0:
        (shared_path / "other.csv").write_text("a,b\n")
    comm.barrier()
    with pytest.raises(mpm.InputError, match="has the columns a, b"):
        ProbeFile(shared_path / "other.csv", TotalsProbe(model), keep=True)
