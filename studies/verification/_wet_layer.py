"""A layer of particles with pore water that is compressed by a large part of its height: Xie and Leo's closed form."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
WEIGHT, MODULUS, CONDUCTIVITY, HEIGHT = 9810.0, 1e6, 1e-6, 1.0
"""Unit weight of water [N/m3], oedometric modulus [Pa], conductivity [m/s], height [m]"""
GHOST = mpm.GhostPenalty(stiffness=1.0)
"""Ten times the default: where the loaded particles have just come to the bottom of a cell, their load would crush it"""


def large_layer(cells, ratio, per_cell=12):
    """A weightless layer under a mesh twice as high; ratio: of the load, on its uppermost particles, to the modulus."""
    width = 4.0 / cells
    domain = bridge.box_mesh(comm, (width, 2.0), (4, 2 * cells), body=((0.0, 0.0), (width, HEIGHT)))
    model = mpm.Model(bridge.background_mesh(*domain), mpm.LinearElastic(young=MODULUS, poisson=0.0))
    model.seed(density=2000.0, per_cell=per_cell, cell_tag=bridge.BODY)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(3)
    model.add_water(porosity=0.6, conductivity=CONDUCTIVITY, modulus=np.inf, drained_surface=True)
    model.add_field("initial_volume", unit="m3", meaning="Volume at the beginning")
    model.particles.set("initial_volume", model.particles.volume)
    y = model.particles.position[:, 1]
    loaded = y > comm.allreduce(float(y.max(initial=-np.inf)), MPI.MAX) - 1e-9
    force = np.zeros((len(y), 2))
    force[loaded, 1] = -ratio * MODULUS * width / comm.allreduce(int(loaded.sum()))
    model.particles.set("traction", force)
    return model


def follow(model, factors, steps=40):
    """Settlement over the height, and pressure at the base over the load, at time factors; k = k0 stretch^2."""
    period, p = HEIGHT**2 * WEIGHT / (CONDUCTIVITY * MODULUS), model.particles
    load = -comm.allreduce(p.traction[:, 1].sum()) / (comm.allreduce(p.volume.sum()) / HEIGHT)
    whole = comm.allreduce(p.volume.sum())

    def watch():
        p = model.particles
        p.set("conductivity", CONDUCTIVITY * (p.volume / p.initial_volume) ** 2)
        return False

    found, time = [], 0.0
    for factor in factors:
        dt = (factor * period - time) / steps
        for _ in model.implicit(
            factor * period, dt=dt, quasi_static=True, watch=watch, integration=mpm.Integration.MIXED, ghost=GHOST
        ):
            pass
        time, p = factor * period, model.particles
        at_base = p.pore_pressure - p.pressure_gradient[:, 1] * p.position[:, 1]
        height, number = p.position[:, 1], p.id
        lowest = min(
            comm.allgather(min(zip(height.tolist(), number.tolist(), at_base.tolist()), default=(np.inf, 0, 0.0)))
        )
        found.append((1 - comm.allreduce(p.volume.sum()) / whole, lowest[2] / load))
    return np.array(found).T


def closed_form(ratio, factors):
    """Settlement over the height and pressure at the base over the load (Xie and Leo 2004).

    sigma' = -M ln(stretch) and k = k0 stretch^2 make the stretch obey a linear diffusion equation in material coordinates, so
    that S/H = (1 - e^(-q/M)) U(T) and p = M ln[1 + (e^(q/M) - 1) sum 2/m sin(m) e^(-m^2 T)] at the base.
    """
    m, t = np.pi * (np.arange(200) + 0.5)[:, None], np.asarray(factors)
    decay = np.exp(-(m**2) * t)
    degree, base = 1 - np.sum(2 / m**2 * decay, axis=0), np.sum(2 / m * np.sin(m) * decay, axis=0)
    return (1 - np.exp(-ratio)) * degree, np.log(1 + (np.exp(ratio) - 1) * base) / ratio
