"""What the tests of the laws share: random points, derivatives by differences, invariants."""

import numpy as np


class Batch:
    """Points with stress, state, strain increment and tangent."""

    def __init__(self, law, stress, strain, state=None, dt=np.inf):
        self.law, self.strain, self.dt = law, np.ascontiguousarray(strain), dt
        self.start, self.start_state = stress, np.zeros((len(stress), law.n_state)) if state is None else state
        self.update()

    def update(self):
        self.stress, self.state, self.tangent, self.report = self.updated(self.strain)

    def updated(self, strain):
        stress, state = self.start.copy(), self.start_state.copy()
        tangent = np.zeros((*stress.shape, stress.shape[1]))
        report = self.law.update(np.ascontiguousarray(strain), stress, state, tangent, dt=self.dt)
        return stress, state, tangent, report

    def differences(self, step):
        """Derivative of the stress by the strain, by central differences, shape of the tangent."""
        columns = []
        for k in range(self.strain.shape[1]):
            push = np.zeros(self.strain.shape[1])
            push[k] = step
            columns.append((self.updated(self.strain + push)[0] - self.updated(self.strain - push)[0]) / (2 * step))
        return np.stack(columns, axis=2)


def assert_alike_alone_and_among_others(law, stress, strain, start, dt=np.inf):
    """Points have the same stress and state, to the last bit, by themselves, together, and with a tangent."""
    batch, together, state = Batch(law, stress, strain, start, dt), stress.copy(), start.copy()
    report = law.update(strain, together, state, dt=dt)
    assert (report.plastic, report.failed) == (batch.report.plastic, batch.report.failed)
    assert (together == batch.stress).all() and (state == batch.state).all()
    for i in range(len(stress)):
        alone, alone_state = stress[i : i + 1].copy(), start[i : i + 1].copy()
        law.update(strain[i : i + 1], alone, alone_state, dt=dt)
        assert (alone[0] == together[i]).all() and (alone_state[0] == state[i]).all()
    return report


def components(dim):
    return 4 if dim == 2 else 6


def random_points(dim, count, *, pressure, deviator, strain, seed=1):
    """(stress, strain increment): mean stress about -pressure [Pa], and the given sizes; zz is not strained in 2D."""
    rng = np.random.default_rng(seed)
    stress = rng.normal(0.0, deviator, (count, components(dim)))
    stress[:, :3] -= rng.uniform(0.3, 1.7, (count, 1)) * pressure
    increment = rng.normal(0.0, strain, (count, components(dim)))
    if dim == 2:
        increment[:, 2] = 0.0
    return stress, increment


def assert_tangent(batch, step, *, size=None, share=0.8, tolerance=1e-5):
    """The tangent is the derivative wherever two differences agree, which must be at most points (kinks are left out).

    size: of the tangent [Pa], that the tolerance is a share of; by default the law's modulus
    """
    rough, fine = batch.differences(step), batch.differences(step / 4)
    size = batch.law.p_wave_modulus if size is None else size
    smooth = np.abs(rough - fine).max(axis=(1, 2)) < 0.3 * tolerance * size
    assert smooth.mean() > share
    error = np.abs(batch.tangent - fine).max(axis=(1, 2)) / size
    assert error[smooth].max() < tolerance


def walk(law, stress, strain, rounds, seed=2):
    """Update the points again and again with fresh random increments of the given size, shape as the stress."""
    rng = np.random.default_rng(seed)
    stress, state = stress.copy(), np.zeros((len(stress), law.n_state))
    for _ in range(rounds):
        increment = rng.normal(0.0, strain, stress.shape)
        if stress.shape[1] == 4:
            increment[:, 2] = 0.0
        assert law.update(increment, stress, state).failed == 0
    return stress, state


def mean_and_radius(stress):
    """Mean stress p (tension positive) and sqrt(J2)."""
    p = stress[:, :3].mean(axis=1)
    s = stress.copy()
    s[:, :3] -= p[:, None]
    return p, np.sqrt(0.5 * (s[:, :3] ** 2).sum(axis=1) + (s[:, 3:] ** 2).sum(axis=1))


def principal(stress):
    """Principal stresses in falling order, (n, 3)."""
    full = np.zeros((len(stress), 3, 3))
    full[:, [0, 1, 2], [0, 1, 2]] = stress[:, :3]
    full[:, 0, 1] = full[:, 1, 0] = stress[:, 3]
    if stress.shape[1] == 6:
        full[:, 1, 2] = full[:, 2, 1] = stress[:, 4]
        full[:, 0, 2] = full[:, 2, 0] = stress[:, 5]
    return np.linalg.eigvalsh(full)[:, ::-1]


def triaxial(test, axial, steps, *, drained=True):
    """Compress along x to the axial strain given, sides at constant stress, or at constant volume. (strain, stress) rows"""
    rows = []
    for _ in range(steps):
        e = axial / steps
        side = None if drained else -e / 2
        test.step([e, side, side, 0.0, 0.0, 0.0])
        rows.append((test.strain.copy(), test.stress.copy()))
    strain, stress = (np.array(r) for r in zip(*rows, strict=True))
    return strain, stress
