"""Checkpoints with right checksums and wrong content end in an error that names the place, on all ranks alike."""

import json

import h5py
import numpy as np
import pytest
from partitions import all_by_id, sliding_slope

import mpm_core as mpm


def placed(name, row, value):
    def change(file):
        file[name][row] = value

    return change


def swapped(name):
    """The first and the last row change places."""

    def change(file):
        rows = file[name][()]
        rows[[0, -1]] = rows[[-1, 0]]
        file[name][...] = rows

    return change


def describe(file, text):
    del file["description"]
    file["description"] = np.array([text])


def described(**entries):
    def change(file):
        describe(file, json.dumps({**json.loads(file["description"][0]), **entries}).encode())

    return change


def replaced(name, shape, dtype=np.int64, fill=None):
    """A dataset that claims a size, and holds nothing unless there is something to fill it with."""

    def change(file):
        del file[name]
        file.create_dataset(name, shape=shape, dtype=dtype, data=None if fill is None else np.full(shape, fill))

    return change


def not_utf8(file):
    describe(file, b'{"program": "\xff\xfe"}')


def without(name):
    def change(file):
        del file[name]

    return change


CONTACT = {
    "surface": {"kind": "Plane"}, "friction": 0.0, "adhesion": 0.0, "penalty": 1.0, "bonded": False,
    "body": {"start": 0, "mass": 0, "speed": 0, "velocity": [[], []], "spin": [[], []], "force": [[], []], "centre": [0, 0],
             "inertia": [], "drive": [], "rotates": False},
}  # fmt: skip
WATER = {
    "unit_weight": 1e4, "modulus": "much", "suction_limit": "inf", "kozeny_carman": False, "drained_surface": False, "standing": [],
    "rain": [], "retention": [], "anisotropy": [], "conditions": [],
}  # fmt: skip

HOSTILE = {
    "not UTF-8": (not_utf8, "description is damaged"),
    "no table": (lambda file: describe(file, b"[1]"), "description is no table"),
    "a number for a text": (lambda file: describe(file, 3.0), "description"),
    "time": (described(time="soon"), "time in its description"),
    "ranks": (described(ranks=0), "ranks in its description"),
    "gravity": (described(gravity=[1e400, 0]), "gravity in its description"),
    "supports": (described(supports=[[1, True]]), "supports in its description"),
    "prescribed": (described(prescribed={"2": 99}), "prescribed in its description"),
    "geometry": (described(geometry=["PLANE_STRAIN"]), "geometry in its description"),
    "contacts": (described(contacts=[{"surface": {"kind": ["Box"]}}]), "contacts in its description"),
    "implicit": (described(implicit={"pace": 1}), "implicit in its description"),
    "huge number of particles": (replaced("particles/id", (2**40,)), "/particles/id"),
    "particles that are not stored": (replaced("particles/id", (2**30,)), "/particles/id"),
    "huge number of ranks": (replaced("ranks/rows_of_particles", (2**40,)), "/ranks/rows_of_particles"),
    "material": (placed("particles/material", 3, 7), "/particles/material in .* the number 7"),
    "negative material": (placed("particles/material", 0, -1), "/particles/material in .* the number -1"),
    "cell": (placed("particles/cell", 5, 10**9), "in cell 1000000000, which no rank has"),
    "negative cell": (placed("particles/cell", 5, -4), "in cell -4, which no rank has"),
    "position": (placed("particles/position", 2, np.nan), "/particles/position in .* nan"),
    "mass": (placed("particles/mass", 2, 0.0), "/particles/mass in .* 0.0"),
    "negative rows": (placed("ranks/rows_of_particles", 0, -5), "/ranks/rows_of_particles"),
    "too many rows": (placed("ranks/rows_of_particles", 0, 2**60), "/ranks/rows_of_particles"),
    "a cell of sums": (placed("cells/moments", (0, 0), 1e9), "/cells/moments in .* cell 1000000000"),
    "a sum": (placed("cells/moments", (0, 1), np.inf), "/cells/moments in .* inf"),
    "steps that overflow": (placed("ranks/steps", 0, 8e18), "/ranks/steps in .* value 8000"),
    "steps below zero": (placed("ranks/steps", 0, -1.0), "/ranks/steps in .* -1.0"),
    "half a step": (placed("ranks/steps", 0, 1.5), "/ranks/steps in .* 1.5"),
    "a count beyond its type": (placed("ranks/order_changes", 0, 2.0**31), "/ranks/order_changes in .* 2147483648"),
    "a place far off": (
        placed("particles/position", 4, 1e3),
        "/particles/position in .* place .1000.* not in that particle's cell",
    ),
    "a place in another cell": (swapped("particles/position"), "/particles/position in .* not in that particle's cell"),
    "cells of others": (swapped("particles/cell"), "/particles/position in .* not in that particle's cell"),
    "total": (placed("ranks/steps", 0, np.nan), "/ranks/steps in .* nan"),
    "the same particle twice": (
        lambda file: file["particles/id"].__setitem__(7, file["particles/id"][2]),
        "/particles/id in .* the number .* twice, expected each number once",
    ),
    "a particle that was never seeded": (
        placed("particles/id", 7, 10**6),
        "/particles/id in .* number 1000000, expected one below",
    ),
    "a negative particle": (placed("particles/id", 7, -3), "/particles/id in .* number -3, expected one below"),
    "no step": (
        placed("ranks/last_dt", 0, 0.0),
        "/ranks/last_dt in .* value 0.0 after .* steps, expected a number above 0",
    ),
    "a negative step": (
        placed("ranks/last_dt", 0, -1e-3),
        "/ranks/last_dt in .* -0.001000, expected a number from 0 on",
    ),
    "a step that is no number": (placed("ranks/last_dt", 0, np.nan), "/ranks/last_dt in .* nan, expected"),
    "a step of another length": (
        placed("ranks/last_dt", 0, 7.0),
        "/ranks/last_dt in .* sum over ranks is .*, expected",
    ),
    "an energy that is no number": (
        placed("ranks/energy_stress_work", 0, np.nan),
        "/ranks/energy_stress_work in .* nan, exp",
    ),
    "an unknown energy": (
        placed("ranks/energy_outflow_stored", 0, np.nan),
        "/ranks/energy_outflow_stored in .* nan, exp",
    ),
    "an arbitrary energy": (
        placed("ranks/external_work", 0, 1e15),
        "/ranks/external_work in .* sum over ranks is 1.*, expected",
    ),
    "a negative energy": (
        placed("ranks/energy_start_kinetic", 0, -5.0),
        "/ranks/energy_start_kinetic in .* from 0 on",
    ),
    "another time": (
        placed("ranks/time", 0, 3.0),
        "/ranks/time in .* value 3.0, expected .*description says",
    ),
    "another time in the description": (described(time=3.0), "/ranks/time in .* expected 3.0, as its description says"),
    "another number of ranks": (
        described(ranks=10**9),
        "rows_of_particles in .* one for each of the 1000000000 ranks",
    ),
    "a velocity without a square": (
        placed("particles/velocity", 0, 1e300),
        "/particles/velocity in .* expected finite",
    ),
    "a field that is longer": (
        replaced("particles/mass", (500,), float, fill=1.0),
        "/particles/mass in .* 500 rows, expected",
    ),
    "no description": (replaced("description", (0,), "S3"), "state.h5"),
    "gravity in space": (described(gravity=[0, 0, -9.81]), "gravity in its description .* vectors of 2 numbers"),
    "supports in space": (
        described(supports=[[1, True, [0, 0, 0]]]),
        "supports in its description .* vectors of 2 numbers",
    ),
    "a surface without a place": (described(contacts=[CONTACT]), "description cannot be used .*missing .* arguments"),
    "collisions": (described(collisions=[{"a": 1}]), "collisions in its description"),
    "absorbing": (described(absorbing={"a": 1}), "absorbing in its description"),
    "water": (described(water=WATER), "description cannot be used .*could not convert string to float: 'much'"),
    "no length of implicit steps": (described(implicit={"longest": 0, "length": 0}), "implicit in its description"),
    "another mass": (placed("particles/mass", 3, 1e9), "/particles/mass in .* kg, as were seeded"),
    "another mass of a cell": (placed("cells/moments", (1, 2), 1e9), "/cells/moments in .* kg, as its particles have"),
    "sums": (described(sums={"time": "soon"}), "sums in its description .* expected a table of numbers"),
    "a field that is missing": (without("particles/stress"), "/particles/stress"),
}


@pytest.mark.parametrize("change, message", HOSTILE.values(), ids=HOSTILE)
def test_wrong_content_is_named(comm, shared_path, change, message):
    path = shared_path / "state.h5"
    model = sliding_slope(comm)
    list(model.explicit(0.01))
    model.save(path)
    if comm.rank == 0:
        with h5py.File(path, "r+") as file:
            change(file)
    comm.barrier()
    before = all_by_id(model)["position"]
    with pytest.raises(mpm.RunError, match=message) as raised:
        model.restore(path)
    assert len(set(comm.allgather(str(raised.value)))) == 1 and "state.h5" in str(raised.value)
    np.testing.assert_array_equal(all_by_id(model)["position"], before)


@pytest.mark.parametrize("cell", [-1.0, 1e9, np.nan, 0.0])
def test_a_partition_that_is_none_is_refused(comm, shared_path, cell):
    path = shared_path / "state.h5"
    model = sliding_slope(comm)
    list(model.explicit(0.01))
    model.repartitions = 1  # as after the mesh was partitioned anew
    model.save(path)
    if comm.rank == 0:
        with h5py.File(path, "r+") as file:
            file["cells/owned_cells"][1:3] = cell
    comm.barrier()
    with pytest.raises(mpm.RunError, match="/cells/owned_cells"):
        model.restore(path)


def test_a_long_path_can_be_read_too(comm, shared_path):
    folder = shared_path
    while len(str(folder)) < 450:
        folder = folder / ("x" * 60)
    if comm.rank == 0:
        folder.mkdir(parents=True)
    comm.barrier()
    model = sliding_slope(comm)
    model.save(folder / "state.h5")
    model.restore(folder / "state.h5")
    assert mpm.checkpoint_description(folder / "state.h5", comm)["ranks"] == comm.size
