"""The studies of laws: element tests from the command line, the slope of other soils, and retrogression, all small."""

import importlib
import json

import numpy as np
import pytest
from study_main import ended


def summary(folder):
    return json.loads((folder / "summary.json").read_text())


def test_drained_triaxial_test_ends_at_the_strength(tmp_path):
    # sigma_1 = N sigma_3 + 2 c sqrt(N), N = (1 + sin phi) / (1 - sin phi) = 3 for 30 degrees
    result = ended("element_test", tmp_path, "--test", "drained", "--friction-angle", "30", "--cohesion", "5e3",
                   "--pressure", "20e3", "--young", "2e6")  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert summary(tmp_path)["q_Pa"] == pytest.approx(2 * 20e3 + 2 * 5e3 * 3**0.5, rel=1e-9)
    assert all((tmp_path / name).stat().st_size > 0 for name in ("stress_path.png", "history.csv"))


def test_an_oedometer_test_gives_the_modulus_and_the_stresses(tmp_path):
    """In elastic soil E (1 - nu) / ((1 + nu) (1 - 2 nu)) = 1.2 E and nu / (1 - nu) = 1/3 of nu = 1/4: from 10 kPa by 12 and 4 kPa at 1 %."""
    options = "--test oedometer --material elastic --young 1e6 --poisson 0.25 --pressure 10e3 --strain 0.01 --steps 4"
    result = ended("element_test", tmp_path, *options.split())
    assert result.returncode == 0, result.stderr
    found = summary(tmp_path)
    assert found["tangent_oedometer_modulus_Pa"] == pytest.approx(1.2e6, rel=1e-9)
    assert found["axial_stress_Pa"] == pytest.approx(22e3, rel=1e-9)
    assert found["lateral_stress_Pa"] == pytest.approx(14e3, rel=1e-9)
    assert found["lateral_over_axial_stress"] == pytest.approx(14 / 22, rel=1e-9)
    assert "axial stress 22 kPa, lateral 14 kPa, tangent modulus 1.2 MPa" in result.stdout


def test_the_shear_strength_of_clay_is_said_after_simple_shear(tmp_path):
    result = ended("element_test", tmp_path, *"--test shear --material tresca --cohesion 20e3 --young 20e6".split())
    assert result.returncode == 0 and "largest shear stress 20 kPa" in result.stdout


@pytest.mark.parametrize(
    "options, said",
    [
        # q = 3 G x 0.2 = 3 x 75.2 kPa x 0.2 = 45.1 kPa, below the strength of 6 (50 kPa sin phi + c cos phi) / (3 - sin phi) = 63 kPa
        ("--test undrained --pressure 50e3 --friction-angle 30 --cohesion 1e3", "raise --strain or --young, 200000 Pa"),
        ("--test undrained --pressure 50e3 --friction-angle 30 --cohesion 1e3 --strain 0.3", ""),  # 68 kPa
        ("--material cam-clay --preconsolidation 200e3 --strain 1e-3", "raise --strain"),
        ("--material elastic", ""),
    ],
)
def test_a_test_that_ends_before_the_soil_yields_is_said(options, said, tmp_path):
    result = ended("element_test", tmp_path, "--steps", "20", *options.split())
    assert result.returncode == 0, result.stderr
    assert ("the soil has not yielded" in result.stderr) == bool(said) and said in result.stderr
    assert ("--young" in result.stderr) == ("--young" in said)


@pytest.mark.parametrize(
    "options, refused",
    [
        # without shear stress, Cam-Clay yields at p = p_c
        ("--material cam-clay --pressure 20.1e3", "--preconsolidation is 20000 Pa, raise it to 20100 Pa or more"),
        ("--material cam-clay --pressure 200e3 --undrained", "--preconsolidation is 20000 Pa, raise it to 200000 Pa"),
        ("--material cam-clay --pressure 20e3", ""),
        # NorSand at e times the image pressure, both with the attraction: 21 kPa e - 1 kPa = 56.1 kPa
        ("--material nor-sand --pressure 56.2e3", "--image-pressure is 20000 Pa, raise it to 20043 Pa or more"),
        ("--material nor-sand --pressure 56e3", ""),
        ("--material nor-sand --pressure 56.2e3 --image-pressure 20043", ""),
    ],
)
def test_pressures_outside_of_the_yield_surface_are_refused(options, refused, tmp_path):
    result = ended("element_test", tmp_path / "out", "--steps", "5", *options.split())
    assert (result.returncode != 0) == bool(refused)
    assert refused in result.stderr and ("inside of the yield surface" in result.stderr) == bool(refused)


@pytest.mark.parametrize("ratio, said", [(2.0, True), (0.4, False)])
def test_a_stress_ratio_above_the_strength_is_said(ratio, said, tmp_path):
    # q / (2 p) = 0.54 at the strength, by q = 6 (p sin phi + c cos phi) / (3 - sin phi) with 20 kPa, 25 degrees and 1 kPa
    cyclic = ["--test", "cyclic-triaxial", "--young", "20e6", "--strain", "0.02", "--cycles", "1"]
    result = ended("element_test", tmp_path, *cyclic, "--stress-ratio", str(ratio))
    assert result.returncode == 0, result.stderr
    assert (f"--stress-ratio is {ratio:g}, more than the soil carries" in result.stderr) == said


def test_undrained_triaxial_test_of_cam_clay_ends_at_the_critical_state(tmp_path):
    # By water that is stiff, and by constant volume: q = M p', p' = p_c/2 (2 p_0/p_c)^(kappa/lambda) from p_0 = p_c
    for k, options in enumerate((["--test", "undrained"], ["--undrained", "--water-modulus", "2e9"])):
        clay = ["--material", "cam-clay", "--attraction", "0", "--preconsolidation", "20e3", "--pressure", "20e3"]
        result = ended("element_test", tmp_path / str(k), *clay, *options)
        assert result.returncode == 0, result.stderr
        end = summary(tmp_path / str(k))
        assert end["p_Pa"] == pytest.approx(10e3 * 2 ** (0.02 / 0.1), rel=1e-2)
        assert end["q_Pa"] == pytest.approx(end["p_Pa"], rel=1e-2)


def test_undrained_triaxial_test_of_loose_nor_sand_ends_at_its_residual_strength(tmp_path):
    # e = 0.99 at 20 kPa, above the critical 1 - 0.03 ln 20 = 0.910: p = exp((1 - e) / 0.03) kPa and q = M p, after a larger q
    sand = [
        "--material",
        "nor-sand",
        "--void-ratio",
        "0.99",
        "--attraction",
        "0",
        "--hardening",
        "400",
        "--critical-slope",
        "1.2",
    ]
    options = ["--test", "undrained", "--strain", "1", "--steps", "2000"]
    result = ended("element_test", tmp_path, *sand, *options)
    assert result.returncode == 0, result.stderr
    end, history = summary(tmp_path), np.genfromtxt(tmp_path / "history.csv", delimiter=",", names=True)
    residual = 1e3 * np.exp((1.0 - 0.99) / 0.03)
    assert end["p_Pa"] == pytest.approx(residual, rel=0.01) and end["q_Pa"] == pytest.approx(1.2 * residual, rel=0.01)
    assert history["q_Pa"].max() > 5 * end["q_Pa"]


def test_viscous_soil_in_simple_shear_has_the_stress_of_its_rate(tmp_path):
    # Bingham's fluid: tau = c + viscosity times rate, once the overstress has grown over many times viscosity / G
    mud = [
        "--material",
        "viscoplastic",
        "--test",
        "shear",
        "--cohesion",
        "2e3",
        "--friction-angle",
        "0",
        "--viscosity",
        "5e3",
    ]
    for rate in (0.01, 1.0):
        result = ended("element_test", tmp_path / str(rate), *mud, "--strain", "2", "--rate", str(rate))
        assert result.returncode == 0, result.stderr
        assert summary(tmp_path / str(rate))["shear_stress_Pa"] == pytest.approx(2e3 + 5e3 * rate, rel=1e-6)


def test_a_law_of_ones_own(tmp_path):
    (tmp_path / "mine.py").write_text(
        "class Spring:\n"
        "    n_state, p_wave_modulus = 1, 1e6\n"
        "    def update(self, strain_increment, stress, state, tangent):\n"
        "        stress += 1e6 * strain_increment\n"
        "        if tangent is not None:\n"
        "            for k in range(stress.shape[1]):\n"
        "                tangent[:, k, k] = 1e6\n"
    )
    result = ended(
        "element_test", tmp_path / "out", "--python-law", f"{tmp_path / 'mine.py'}:Spring", "--pressure", "0"
    )
    assert result.returncode == 0, result.stderr
    assert summary(tmp_path / "out")["q_Pa"] == pytest.approx(1e6 * 0.2)


def test_clay_that_creeps_has_the_strength_of_its_rate(tmp_path):
    """Ten times as fast, q and p with the attraction are larger by 10^(mu / lambda), in the critical state q = M p."""
    clay = "--material cam-clay --test undrained --pressure 50e3 --preconsolidation 50e3 --attraction 1e3 --creep 0.005 --strain 0.3".split()
    strengths = []
    for rate in ("1e-7", "1e-6"):
        assert ended("element_test", tmp_path / rate, *clay, "--rate", rate).returncode == 0
        strengths.append(summary(tmp_path / rate)["q_Pa"])
    assert strengths[1] / strengths[0] == pytest.approx(10 ** (0.005 / 0.1), rel=1e-3)


@pytest.mark.parametrize(
    "options, named",
    [(["--material", "marble"], "--material is 'marble', expected one of"), (["--poisson", "0.6"], "--poisson is '0.6'"),
     (["--material", "cam-clay", "--swelling-slope", "0.2"], "compression = 0.1"), (["--python-law", "no.py:X"], "no.py:X"),
     (["--umat", "no.so"], "no.so"), (["--material", "viscoplastic"], "--material is viscoplastic, expected --rate with it"),
     (["--rate", "1"], "--rate is given, expected --material viscoplastic")],
)  # fmt: skip
def test_bad_options_are_named(tmp_path, options, named):
    result = ended("element_test", tmp_path, *options)
    assert result.returncode == 2
    assert named in result.stderr


SMALL_BANK = (
    "--cell-size 1 --crest 8 --runout-length 6 --height 4 --angle 45 --mesh crossed --unit-weight 24e3 --cohesion 24e3 "
    "--reference-length 1 --disturbed 2 --time 3 --frames 3"
).split()


def test_retrogression_starts_in_equilibrium_and_yields_on_two_meshes(tmp_path):
    result = ended("retrogression", tmp_path, *SMALL_BANK, "--meshes", "two")
    assert result.returncode == 0, result.stderr
    found = summary(tmp_path)["cells"]
    assert set(found) == {"1_m", "0.5_m"}
    for size, run in found.items():
        assert run["initial_out_of_balance_ratio"] < 1e-6
        assert run["time_s"] == 3 or run["at_rest"]
        last = (tmp_path / f"history_{size.removesuffix('_m')}.csv").read_text().splitlines()[-1]
        assert float(last.split(",")[5]) > 0  # fraction of particles that yield
        assert float(last.split(",")[3]) > 0
    for name in ("history.png", "history_0.5.csv", "displacement_1.png"):
        assert (tmp_path / name).stat().st_size > 0


def test_a_bank_of_resting_cells_fails_back_as_one_of_particles(tmp_path):
    # The damping keeps apart how the bank begins to fail from the noise of its foremost particle, by which run-outs differ.
    damped, found = ("--pic", "0.1", "--damping", "0.05"), []
    for name, more in (("particles", []), ("coupled", ["--coupled"])):
        result = ended(
            "retrogression", tmp_path / name, *SMALL_BANK, *more, *damped, "--meshes", "one", "--no-pictures"
        )
        assert result.returncode == 0, result.stderr
        found.append(summary(tmp_path / name)["cells"]["1_m"])
        rows = np.loadtxt(tmp_path / name / "history_1.csv", delimiter=",", skiprows=1)
    particles, coupled = found
    assert rows[0, 7] > rows[-1, 7] > 0  # resting cells, of which some have turned into particles
    assert coupled["initial_out_of_balance_ratio"] < 1e-6
    assert abs(coupled["runout_m"] - particles["runout_m"]) < 0.2  # two tenths of a cell
    assert coupled["work_of_stresses_J_per_m"] == pytest.approx(particles["work_of_stresses_J_per_m"], rel=0.03)


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(
    "options, words",
    [
        (["--strain", "20"], "warning: --strain is 20, a fraction: 20 % are 0.2"),
        (["--pressure", "100"], "warning: --pressure is 100 Pa, less than under 0.1 m of soil: 100 kPa are 100e3"),
        (["--test", "shear", "--strain", "20"], "warning: --strain is 20, a fraction"),
        (["--young", "9000"], "under a pressure of 20000 Pa: moduli are in Pa"),  # in kPa
        (["--young", "9", "--pressure", "0"], "under a pressure of 0 Pa: moduli are in Pa"),  # in MPa
        (["--friction-angle", "0.5"], "0.5 rad are 28.6 degrees"),
        (["--test", "shear", "--strain", "2"], ""),
    ],
)
def test_quantities_in_other_units_are_warned_of(tmp_path, options, words):
    result = ended("element_test", tmp_path, "--steps", "5", *options)
    assert result.returncode == 0 and words in result.stderr
    assert result.stderr.count("warning: ") == bool(words)


def test_cycles_of_sand_between_two_stresses(tmp_path):
    sand = ["--material", "sanisand", "--sanisand", "void_ratio=0.85", "attraction=0", "--pressure", "100e3"]
    result = ended("element_test", tmp_path, "--test", "cyclic-shear", *sand, "--stress-ratio", "0.15", "--cycles", "8")
    assert result.returncode == 0, result.stderr
    end, history = summary(tmp_path), np.genfromtxt(tmp_path / "history.csv", delimiter=",", names=True)
    largest, pressure = history["shear_stress_Pa"], history["p_Pa"]
    assert (largest.max(), largest.min()) == pytest.approx((15e3, -15e3), rel=5e-3)
    turns = np.flatnonzero(np.diff(history["cycles"]) > 0) + 1
    assert abs(largest[turns]) == pytest.approx(15e3, rel=5e-3) and len(turns) == 16
    assert history["cycles"][turns] == pytest.approx(0.25 + 0.5 * np.arange(16)) and end["cycles"] == 7.75
    liquefied = end["cycles_to_excess_pore_pressure_ratio_0.9"]
    assert 2 < liquefied < 8 and (pressure[history["cycles"] < liquefied] > 10e3).all()
    assert (tmp_path / "stress_path.png").stat().st_size > 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--sanisand", "void_ratio"], "--sanisand has 'void_ratio', expected NAME=VALUE such as void_ratio=0.75"),
        (["--sanisand", "voidratio=0.7"], "no parameter of the law; did you mean void_ratio?"),
        (["--sanisand", "porosity=0.4"], "no parameter of the law, expected one of rigidity, poisson, "),
        (["--sanisand", "void_ratio=-1"], "void_ratio = -1, but it must be positive"),
        (["--test", "cyclic-shear", "--steps", "100"], "--steps is given, expected a test without cycles"),
        (["--test", "cyclic-shear", "--pressure", "0"], "--pressure is 0 Pa, expected above 0 for cycles"),
        (["--cycles", "10"], "--cycles is given, expected --test cyclic-shear or cyclic-triaxial with it"),
        (["--poisson", "0.3"], "--poisson is given, expected --material "),
    ],
)
def test_wrong_options_of_sand_and_cycles_are_named(tmp_path, options, message):
    result = ended("element_test", tmp_path, "--material", "sanisand", *options)
    assert result.returncode == 2 and message in result.stderr, result.stderr


@pytest.mark.parametrize(
    "energies, at_rest",
    [
        ([0.0, 1e3, 10.0, 5.0, 4.0], False),  # above a thousandth of the largest
        ([0.0, 1e3, 0.9, 0.8, 0.7], True),
        ([0.0, 4e-3, 3e-3, 3e-3, 3e-3], True),  # of 10 t: less than 1 mm/s, 5e-3 J, all the time
        ([0.0, 1e-3, 2e-3, 3e-3, 4e-3], False),  # begins to fail
    ],
)
def test_retrogression_is_at_rest_where_nothing_moves(energies, at_rest):
    study = importlib.import_module("retrogression")
    history = {"time_s": np.arange(5.0), "kinetic_energy_J_per_m": np.array(energies)}
    assert study.is_at_rest(history, 10e3) == at_rest


def test_a_law_that_is_in_no_file_of_python_is_refused(tmp_path):
    (tmp_path / "mine.txt").write_text("class Spring: ...")
    text = f"{tmp_path / 'mine.txt'}:Spring"
    result = ended("element_test", tmp_path / "out", "--python-law", text)
    assert result.returncode == 2
    assert f"--python-law is '{text}', expected a file of Python, whose name ends in .py" in result.stderr
