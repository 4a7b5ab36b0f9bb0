"""What the study earthquake compares with: sliding blocks, yield accelerations, layers over a half-space, and its motions."""

import importlib
import json
import warnings
from argparse import Namespace

import numpy as np
import pytest
from common import figures
from common.earthquake.motions import accelerations, as_motion, band_limited_noise, ricker
from common.earthquake.newmark import pulse_slip, sliding_block, yield_acceleration
from common.earthquake.plots import save_record
from common.earthquake.response import amplification, spectral_ratio
from common.earthquake.site import outcrop_motion
from study_main import ended

import fenics_bridge as bridge
import mpm_core as mpm


@pytest.mark.parametrize("samples", [6, 7, 101])
def test_a_rectangular_pulse_moves_the_block_by_newmarks_formula(samples):
    # The ground accelerates uphill with A for 0.5 s, then keeps its speed; however the times are sampled, if 0.5 s is among them.
    acceleration, begins = 4.0, 1.5
    time = np.unique(np.append(np.linspace(0.0, 3.0, samples), 0.5))
    ground = -acceleration * np.minimum(time, 0.5)
    velocity, moved = sliding_block(time, ground, begins)
    assert moved[-1] == pytest.approx(pulse_slip(2.0, acceleration, begins), rel=1e-12)
    assert velocity[-1] == 0.0
    assert sliding_block(time, -ground, begins)[1][-1] == 0.0  # downhill it does not leave the ground behind
    assert sliding_block(time, -ground, np.inf, begins)[1][-1] == pytest.approx(-moved[-1], rel=1e-12)


@pytest.mark.parametrize("angle, friction, cohesion", [(30, 20, 30e3), (45, 25, 20e3), (70, 30, 40e3)])
def test_a_slope_with_its_strength_over_its_factor_of_safety_yields_at_once(angle, friction, cohesion):
    # Both come from logarithmic spirals through the toe: by limit analysis under weight alone, and under inertia.
    factor = bridge.log_spiral_safety(10.0, angle, cohesion, friction, 19e3)
    assert factor > 1.1
    reduced = np.degrees(np.arctan(np.tan(np.radians(friction)) / factor))
    assert yield_acceleration(10.0, angle, cohesion / factor, reduced, 19e3) == pytest.approx(0.0, abs=2e-3)
    assert yield_acceleration(10.0, angle, cohesion, friction, 19e3, depth=10.0) > 0.5
    assert yield_acceleration(10.0, angle, 0.8 * cohesion / factor, reduced, 19e3) < 0


@pytest.mark.parametrize(
    "slope", [(10.0, 35.0, 30e3, 3.0, 19e3), (1.0, 45.0, 5e3, 25.0, 20e3), (10.0, 20.0, 30e3, 10.0, 20e3)]
)
def test_deeper_soil_yields_earlier_and_never_before_it_slides_as_a_whole(slope):
    # Spirals in deeper soil include those in shallower soil. A layer of any depth holds tan(phi) of gravity.
    height, _, _, friction, _ = slope
    whole = 9.81 * np.tan(np.radians(friction))
    depths = height * np.array([0.0, 4.0, 8.0, 50.0])
    yields = np.array([yield_acceleration(*slope, 9.81, depth) for depth in depths])
    assert np.all(np.diff(yields) < 1e-6 * yields[:-1])
    assert yields[0] > 1.4 * yields[-1] > 1.4 * whole
    with pytest.raises(mpm.InputError, match=f"depth is inf, expected the depth of the soil .* = {whole:.3g} m/s2"):
        yield_acceleration(*slope)


def test_a_stiff_layer_below_the_worst_spiral_changes_nothing():
    steep = 10.0, 45.0, 20e3, 25.0, 19e3
    assert yield_acceleration(*steep, 9.81, 5.0) == pytest.approx(yield_acceleration(*steep), abs=1e-6)


@pytest.mark.parametrize(
    "slope", [(10.0, 30.0, 15e3, 30.0, 18e3), (1.0, 45.0, 1e3, 25.0, 20e3), (10.0, 60.0, 30e3, 20.0, 20e3), (10.0, 22.0, 3e3, 35.0, 19e3)]
)  # fmt: skip
def test_yield_accelerations_are_those_of_limit_analysis_with_a_seismic_coefficient(slope):
    assert yield_acceleration(*slope) / 9.81 == pytest.approx(bridge.log_spiral_seismic(*slope), rel=1e-3)


@pytest.mark.parametrize("depth", [2.0, 10.0])
def test_a_slope_at_its_factor_of_safety_above_a_stiff_layer_does_not_hold_any_acceleration(depth):
    # The factor of safety has the spirals through the toe and those that end before it, so that the former alone yield later.
    height, angle, cohesion, friction, weight = 10.0, 20.0, 15e3, 10.0, 19e3
    factor = bridge.log_spiral_safety(height, angle, cohesion, friction, weight, depth=depth)
    reduced = np.degrees(np.arctan(np.tan(np.radians(friction)) / factor))
    assert 0 <= yield_acceleration(height, angle, cohesion / factor, reduced, weight, 9.81, depth) < 0.1


def test_layers_amplify_as_one_layer_where_they_are_of_one_soil():
    # 1 / sqrt(cos^2 kH + (a sin kH)^2) without damping; with it the peak at kH = pi/2 of a rigid half-space is 2 / (pi xi).
    height, modulus, density, rock = 20.0, 80e6, 2000.0, 3e6
    frequency = np.linspace(0.2, 10, 50)
    phase = 2 * np.pi * frequency * height * np.sqrt(density / modulus)
    exact = 1 / np.sqrt(np.cos(phase) ** 2 + (np.sqrt(modulus * density) / rock * np.sin(phase)) ** 2)
    for parts in (1, 3):
        layers = parts * [(height / parts, modulus, density)]
        np.testing.assert_allclose(abs(amplification(frequency, layers, rock)), exact, rtol=1e-12)
    own, ratio = np.sqrt(modulus / density) / (4 * height), 0.01
    damped = abs(
        amplification(np.array([own]), [(height, modulus, density)], 1e15, mpm.Rayleigh.of_ratio(ratio, (own, own)))
    )
    assert damped[0] == pytest.approx(2 / (np.pi * ratio), rel=1e-3)


def test_a_linear_column_amplifies_as_layers_do_at_second_order_in_the_cells_however_little_it_is_damped():
    """Spectra of a column that still vibrated at their end were off by a quarter on any cells, as if its waves were wrong."""
    study, errors = importlib.import_module("earthquake"), []
    for size in (0.5, 0.25):
        a = study.parse(["--cell-size", str(size), *"--height 5 --soil-depth 2.5 --stiff-depth 5 --young 30e6".split(),
                         *"--stiff-young 30e6 --poisson 0.4 --damping-ratio 0.01 --motion ricker --frequency 3".split()])  # fmt: skip
        record = outcrop_motion(a)
        names = ("crest_velocity_m_per_s", "crest_level_velocity_m_per_s")
        history = {"time_s": record[2].time, **{name: record[2].velocity for name in names}}
        exact, found = study.amplified(a, record[2], history)
        errors.append(np.abs(found["linear column of resting cells"][1] / exact[1] - 1).max())
    assert errors[1] < 0.03
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


def test_a_spectral_ratio_is_that_of_the_filter():
    # A motion and itself, later by one half: the ratio is |1 + exp(-i w d) / 2|.
    time = np.linspace(0, 20, 2001)
    pulse = ricker(2.0, 1.0, 20.0, 0.01)[1]
    later = np.interp(time - 0.1, time, pulse, left=0)
    frequency, ratio = spectral_ratio(time, pulse + 0.5 * later, pulse, (1.0, 4.0))
    np.testing.assert_allclose(ratio, abs(1 + 0.5 * np.exp(-2j * np.pi * frequency * 0.1)), rtol=1e-6)


def test_noise_has_its_peak_its_band_and_its_seed():
    time, acceleration = band_limited_noise((1.0, 5.0), 3.0, 10.0, 0.01, seed=4)
    assert np.abs(acceleration).max() == pytest.approx(3.0, rel=1e-12)
    spectrum, frequency = np.abs(np.fft.rfft(acceleration)) ** 2, np.fft.rfftfreq(len(time), 0.01)
    outside = (frequency < 0.5) | (frequency > 5.5)  # the envelope widens the band by some tenths of a hertz
    assert spectrum[outside].sum() < 0.01 * spectrum.sum()
    np.testing.assert_array_equal(acceleration, band_limited_noise((1.0, 5.0), 3.0, 10.0, 0.01, seed=4)[1])
    assert np.abs(acceleration - band_limited_noise((1.0, 5.0), 3.0, 10.0, 0.01, seed=5)[1]).max() > 0.5


def test_a_motion_ends_at_rest():
    time, acceleration = band_limited_noise((1.0, 5.0), 3.0, 10.0, 0.01, seed=4)
    motion = as_motion(time, acceleration + 0.05)  # an error of the record's zero
    assert motion.velocity[-1] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(motion.velocity, as_motion(time, acceleration).velocity, atol=1e-12)


def test_a_recorded_motion_keeps_its_high_frequencies(tmp_path):
    # A record of 8 Hz in steps of 0.02 s: it is read as it is, and its velocity is the sum of trapezia, with an envelope and a
    # duration of whole periods so that there is neither a trend nor an end to fade.
    time = 0.02 * np.arange(1001)
    acceleration = np.sin(16 * np.pi * time) * np.sin(0.05 * np.pi * time) ** 4
    path = tmp_path / "record.txt"
    np.savetxt(path, np.column_stack([time, 100 * acceleration]), fmt="%.12g")
    read, found, motion = outcrop_motion(Namespace(accelerogram=path, unit="cm/s2"))
    np.testing.assert_allclose(read, time, rtol=1e-12)
    np.testing.assert_allclose(found, acceleration, atol=1e-10)
    exact = np.append(0.0, np.cumsum(0.01 * (acceleration[1:] + acceleration[:-1])))
    np.testing.assert_allclose(motion.velocity, exact, atol=0.01 * abs(exact).max())


def test_a_record_without_unit_is_in_that_of_its_file_or_in_si(tmp_path):
    values = 2 * np.sin(np.arange(40.0))
    np.savetxt(tmp_path / "record.txt", np.column_stack([0.01 * np.arange(40), values]))
    rows = "\n".join(f"{value:.7E}" for value in values)
    (tmp_path / "record.AT2").write_text(
        f"PEER\nEvent\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 40, DT= .01 SEC\n{rows}\n"
    )
    for name, factor in (("record.txt", 1.0), ("record.AT2", 9.80665)):
        time, found, _ = outcrop_motion(Namespace(accelerogram=tmp_path / name, unit=None))
        np.testing.assert_allclose(found, factor * values, rtol=1e-6)
        np.testing.assert_allclose(time, 0.01 * np.arange(40), atol=1e-12)


def warnings_of(path, unit, time, acceleration):
    """What is said of a record with these columns."""
    np.savetxt(path, np.column_stack([time, acceleration]), fmt="%.9g")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        outcrop_motion(Namespace(accelerogram=path, unit=unit))
    return [str(one.message) for one in said]


def test_a_record_with_a_gap_or_without_its_unit_is_doubted(tmp_path):
    """Both were computed without a word: a motion that is linear over a second, and one of a tenth of the acceleration."""
    path, time = tmp_path / "record.txt", 0.01 * np.arange(1001)
    acceleration = 0.25 * np.sin(3 * np.pi * time) * np.sin(0.1 * np.pi * time) ** 2
    assert warnings_of(path, "g", time, acceleration) == []
    assert warnings_of(path, "m/s2", time, acceleration) == []
    assert warnings_of(path, None, time, 9.81 * acceleration) == []
    kept = (time < 2.995) | (time > 4.195)
    (gap,) = warnings_of(path, "g", time[kept], acceleration[kept])
    assert f"--accelerogram {path} has no values from 2.99 to 4.2 s, between steps of 0.01 s" in gap
    (unit,) = warnings_of(path, None, time, acceleration)
    assert f"{path} is {np.abs(acceleration).max():.3g} m/s2, as its values are taken in m/s2 without --unit" in unit
    uneven = np.cumsum(np.tile([0.01, 0.03], 250))  # as digitised by hand
    assert warnings_of(path, "g", uneven, np.interp(uneven, time, acceleration)) == []


@pytest.mark.parametrize("first", [-20.0, 100.0])
def test_a_recorded_motion_begins_with_the_run_whatever_its_first_time(tmp_path, first):
    """Records count time from midnight, or from the trigger: what lay before 0 was left out, and up to it nothing moved."""
    time = 0.02 * np.arange(501)
    acceleration = np.sin(4 * np.pi * time) * np.sin(0.1 * np.pi * time) ** 2
    path = tmp_path / "record.txt"
    np.savetxt(path, np.column_stack([first + time, acceleration]), fmt="%.12g")
    read, _, motion = outcrop_motion(Namespace(accelerogram=path, unit="m/s2"))
    np.testing.assert_allclose(read, time, atol=1e-9)
    np.testing.assert_allclose(motion.velocity, as_motion(time, acceleration).velocity, atol=1e-9)


def test_ground_that_moves_far_without_failing_stays_in_resting_cells(tmp_path):
    """A wavelet that moves the outcrop by 0.4 m, a quarter of a cell: all ground turned into particles, which left the mesh."""
    small = (
        "--cell-size 2.5 --level 10 --soil-depth 5 --stiff-depth 5 --particles-per-cell 1 --cohesion 2e5 --no-pictures"
    )
    result = ended(
        "earthquake",
        tmp_path,
        *small.split(),
        *"--motion ricker --frequency 0.6 --peak 3 --duration 5 --rest 0".split(),
    )
    assert result.returncode == 0, result.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["converted_fraction"] == 0
    assert abs(summary["slope_displacement_m"]) < 0.01


def test_the_acceleration_of_a_motion_is_that_between_its_samples():
    # The motion rises by 3 m/s2 over a single interval: the gradient at the samples would be half of it.
    middle, found = accelerations(np.array([0.0, 0.1, 0.2, 0.4]), np.array([0.0, 0.3, 0.3, 0.3]))
    np.testing.assert_allclose(middle, [0.05, 0.15, 0.3])
    np.testing.assert_allclose(found, [3.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("smoothing", [0.0, 0.5])
def test_a_motion_is_not_amplified_at_frequencies_that_the_reference_lacks(smoothing):
    # A reference of 8 Hz under an envelope of 20 s, twice of which moves, with a little of a motion of 3 Hz
    time = 0.01 * np.arange(2001)
    envelope = np.sin(0.05 * np.pi * time) ** 4
    reference = envelope * np.sin(16 * np.pi * time)
    moved = 2 * reference + 1e-2 * envelope * np.sin(6 * np.pi * time)
    frequency, ratio = spectral_ratio(time, moved, reference, (7.95, 8.05), smoothing)
    np.testing.assert_allclose(ratio, 2.0, rtol=1e-3)
    frequency, ratio = spectral_ratio(time, moved, reference, (1.0, 6.0), smoothing)
    assert len(frequency) > 100 and np.isnan(ratio).all()


def test_the_names_of_curves_lie_beside_those_of_a_record_wherever_its_peak_is(tmp_path, monkeypatch):
    boxes = []

    def save(figure, _):
        figure.canvas.draw()
        panel = figure.axes[0]
        boxes.extend([panel.get_legend().get_window_extent(), panel.get_window_extent()])

    monkeypatch.setattr(figures, "save_figure", save)
    time = np.linspace(0.0, 10.0, 1001)
    acceleration = np.exp(time - 10.0) * np.sin(20 * time)  # the peak is at the end
    save_record(tmp_path / "record.png", time, acceleration, as_motion(time, acceleration).velocity)
    legend, panel = boxes
    assert not legend.overlaps(panel)


def test_a_ricker_wavelet_needs_no_baseline_correction():
    """It ends at rest, where it began; a correction moved it by up to 38 mm."""
    peak, frequency = 3.0, 1.0
    motion = as_motion(*ricker(frequency, peak, 3.0, 0.01))
    displacement = np.append(0.0, np.cumsum(0.5 * np.diff(motion.time) * (motion.velocity[1:] + motion.velocity[:-1])))
    largest = peak / (2 * np.pi**2 * frequency**2)  # its displacement at the peak
    assert abs(displacement[-1]) < 1e-6 * largest
    assert np.abs(displacement).max() == pytest.approx(largest, rel=1e-3)
    assert np.abs(accelerations(motion.time, motion.velocity)[1]).max() == pytest.approx(peak, rel=0.01)


def test_a_slope_that_does_not_stand_is_refused_before_the_earthquake_is_computed(tmp_path):
    """Finite elements on coarse cells carry it, so that its run went to the end, and then had no yield acceleration and no results."""
    result = ended("earthquake", tmp_path / "out", *"--height 6 --angle 40 --cohesion 4.5e3 --friction-angle 24".split(),
                   *"--unit-weight 18e3 --soil-depth 4".split())  # fmt: skip
    assert result.returncode != 0 and not (tmp_path / "out").exists()
    angle = np.radians(24.0)  # Davis (1968) without dilation: c cos(phi), and a tangent of sin(phi)
    reduced = 4.5e3 * np.cos(angle), np.degrees(np.arctan(np.sin(angle)))
    factor = bridge.log_spiral_safety(6.0, 40.0, *reduced, 18e3, depth=4.0)
    assert 0.95 < factor < 1
    assert f"--cohesion is 4500 Pa and --friction-angle 24 degrees, of which limit analysis finds a factor of safety of {factor:.2f}" in result.stderr  # fmt: skip


@pytest.mark.parametrize(
    "motion, highest", [("--highest-frequency 12", 12), ("--motion ricker --frequency 4 --duration 1", 8)]
)
def test_cells_that_are_too_coarse_for_the_waves_of_a_motion_are_doubted(motion, highest):
    """Waves of 8 Hz and more did not pass cells of 2 m, and nothing was said but that the linear column is wrong by 238 %."""
    study = importlib.import_module("earthquake")
    soil = "--height 6 --soil-depth 4 --stiff-depth 6 --young 20e6 --stiff-young 60e6 --unit-weight 18e3".split()
    eighth = np.sqrt(20e6 / 2.6 * 9.81 / 18e3) / highest / 8
    with pytest.warns(
        RuntimeWarning, match=f"--cell-size is 2 m, expected {eighth:.3g} m at most, an eighth .* of {highest} Hz"
    ):
        study.parse([*soil, *motion.split(), "--cell-size", "2"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        study.parse([*soil, *motion.split(), "--cell-size", "0.5"])


def test_the_linear_column_of_resting_cells_says_nothing_of_particles_that_cross_cells():
    """On coarse cells it spoke of noise of cell crossings, on each rank, and named particles that move with their cells as a remedy."""
    study = importlib.import_module("earthquake")
    options = (
        "--height 6 --soil-depth 4 --stiff-depth 6 --young 20e6 --stiff-young 60e6 --unit-weight 18e3 --cell-size 2"
    )
    with pytest.warns(RuntimeWarning, match="an eighth of a shear wave"):
        a = study.parse([*options.split(), "--highest-frequency", "12"])
    motion = mpm.motion_of_acceleration(*ricker(12.0, 0.1, 3.0, 0.002))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, velocity = study.linear_column(a, motion, 5.0)
    assert np.abs(velocity).max() > 0


def test_a_slope_that_still_vibrates_at_the_end_is_said_to():
    """A slope was displaced uphill, by 6.5 mm, in the middle of a free vibration."""
    study = importlib.import_module("earthquake")
    a, time = study.parse([]), np.linspace(0.0, 10.0, 1001)
    slip = 0.05 + 0.02 * np.sin(2 * np.pi * study.first_frequency(a) * time)
    still = study.still_moving(a, {"time_s": time, "slope_displacement_m": slip, "free_field_displacement_m": 0 * time})
    assert "the slope still moves, by 0.04 m in the last 0.3 s: raise --rest" in still
    for quiet in (0.05 + 0.1 * (slip - 0.05), 1e-3 * slip):
        columns = {"time_s": time, "slope_displacement_m": quiet, "free_field_displacement_m": 0 * time}
        assert study.still_moving(a, columns) == ""
