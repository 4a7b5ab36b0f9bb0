"""A checkpoint is refused by a model whose law is another one, also when Python or a shared library holds its code."""

import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from core_cases import box
from mpm_core.fingerprint import fingerprint
from mpm_core.law_text import law_text

import mpm_core as mpm

LAW = """
import numpy as np
import helper

FACTOR = 1.0

def stiffness(young, s):
    return young * FACTOR * np.eye(s)

class Law:
    n_state = 1
    p_wave_modulus = 1e6

    def __init__(self, young=1e6, table=(1.0, 2.0)):
        self.young, self.table, self._calls = young, np.array(table), 0

    def update(self, strain_increment, stress, state, tangent):
        self._calls += 1
        stress += strain_increment @ stiffness(self.young, stress.shape[1]) * helper.SCALE
"""
SCRIPT = """
import sys
sys.path[:0] = [{tests!r}, {place!r}]
import law
import mpm_core as mpm
from core_cases import box
model = mpm.Model(box((2, 2)), mpm.Undrained(mpm.PythonLaw(law.Law({arguments})), water_modulus=1e7, porosity=0.4))
model.seed(density=2000.0, per_cell=3)
if {save}:
    list(model.explicit(0.01))
    model.save({place!r} + "/state.h5")
else:
    model.restore({place!r} + "/state.h5")
"""


def run(place, save, arguments="", law=LAW, helper="SCALE = 1.0"):
    (place / "law.py").write_text(law)
    (place / "helper.py").write_text(helper)
    script = SCRIPT.format(tests=str(Path(__file__).parents[1]), place=str(place), arguments=arguments, save=save)
    return subprocess.run([sys.executable, "-B", "-c", script], capture_output=True, text=True, timeout=60)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a checkpoint of a law written in Python."""
    place = tmp_path_factory.mktemp("law")
    assert run(place, True).returncode == 0
    return place


CHANGES = {
    "parameter": {"arguments": "young=2e5"},
    "array": {"arguments": "table=(1.0, 2.5)"},
    "method": {"law": LAW.replace("stress +=", "stress -=")},
    "constant": {"law": LAW.replace("FACTOR = 1.0", "FACTOR = 0.2")},
    "function": {"law": LAW.replace("young * FACTOR", "young / 5")},
    "module": {"helper": "SCALE = 0.2"},
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_a_law_in_python_that_changed_is_refused(place, change):
    result = run(place, False, **change)
    assert result.returncode != 0 and "is of another materials" in result.stderr


def test_a_law_in_python_that_is_the_same_is_taken(place):
    comment = LAW.replace("self._calls += 1", "self._calls += 2 - 1  # counted\n        # and told")
    for law in (LAW, comment.replace("2 - 1", "1")):
        result = run(place, False, law=law)
        assert result.returncode == 0, result.stderr


def test_a_class_without_a_file_has_a_fingerprint():
    places = [{"__name__": "__main__"} for _ in range(3)]
    for names, code in zip(places, (LAW, LAW, LAW.replace("+=", "-="))):
        exec(code.replace("import helper", "").replace("* helper.SCALE", ""), names)
    first, same, other = (fingerprint(names["Law"]()) for names in places)
    assert first == same != other


UMAT = textwrap.dedent(
    """
    void umat_(double* stress, double* statev, double* ddsdde, double* sse, double* spd, double* scd, double* rpl,
               double* ddsddt, double* drplde, double* drpldt, const double* stran, const double* dstran)
    {{
      for (int k = 0; k < 6; ++k)
        stress[k] += {young} * dstran[k];
    }}
    """
)


def umat(place, young, **changes):
    (place / "umat.c").write_text(UMAT.format(young=young))
    library = place / f"umat_{len(list(place.glob('*.so')))}.so"  # of another name, since what is loaded stays
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, place / "umat.c"], check=True)
    values = {"properties": [1.0], "n_variables": 0, "p_wave_modulus": 1e6}
    return mpm.Umat(str(library), **{**values, **changes})


def test_another_library_under_a_umat_is_refused(tmp_path):
    def model(law):
        made = mpm.Model(box((2, 2)), law)
        made.seed(density=2000.0, per_cell=3)
        return made

    model(umat(tmp_path, 1e6)).save(tmp_path / "state.h5")
    model(umat(tmp_path, 1e6)).restore(tmp_path / "state.h5")
    for law in (umat(tmp_path, 2e5), umat(tmp_path, 1e6, properties=[2.0]), umat(tmp_path, 1e6, p_wave_modulus=2e6)):
        with pytest.raises(mpm.InputError, match="is of another materials"):
            model(law).restore(tmp_path / "state.h5")
    assert np.isfinite(model(umat(tmp_path, 1e6)).particles.stress).all()


def test_a_law_is_described_as_in_older_checkpoints():
    # As version 0.1.0 wrote it before laws declared what they need, with the separation, which is new; recorded, for old files
    # cannot be written any more.
    law = mpm.MohrCoulomb(young=2e5, poisson=0.3, cohesion=500.0, friction_angle=25.0, dilation_angle=5.0)
    assert law_text(law) == (
        "MohrCoulomb(cohesion=500.0, dilation_angle=5.0, friction_angle=25.0, n_state=2, name='MohrCoulomb', "
        "p_wave_modulus=269230.76923076925, poisson=0.3, shear_modulus=76923.07692307692, state_names=['plastic_strain', "
        "'separation'], tension_cutoff=inf, young=200000.0)"
    )
