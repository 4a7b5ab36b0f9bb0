"""Parameters of a study from a TOML file, and back to one."""

import pytest

from studies.common.options import add_choice, add_count, add_flag, add_number, add_switch, formerly, study_parser
from studies.common.parameters import unknown_key, write_parameters


def parser():
    p = study_parser("A study.")
    p.prog = "studies/run slope"
    add_number(p, "--cell-size", 0.1, "m", "side of the squares", above=0)
    add_number(p, "--dt", None, "s", "time step (default: half of the critical one)", above=0)
    add_count(p, "--frames", 120, "times at which particles are stored")
    add_choice(p, "--initial", "fem", ("fem", "zero"), "initial stresses")
    add_switch(p, "--nmd", False, "average volumetric strains over nodes")
    add_flag(p, "--paper", "the paper exactly")
    return p


def parse(tmp_path, text, *arguments):
    path = tmp_path / "given.toml"
    path.write_text(text)
    return parser().parse_args(["--parameters", str(path), *arguments])


def test_the_file_gives_values_of_every_kind(tmp_path):
    options = parse(tmp_path, "cell-size = 1\ndt = 1e-4\nframes = 3\ninitial = 'zero'\nnmd = true\npaper = true")
    assert (options.cell_size, options.dt, options.frames) == (1.0, 1e-4, 3)
    assert (options.initial, options.nmd, options.paper) == ("zero", True, True)


def test_names_may_be_those_of_the_summary(tmp_path):
    assert parse(tmp_path, "cell_size = 1").cell_size == 1.0


def test_the_command_line_wins_over_the_file(tmp_path):
    options = parse(tmp_path, "frames = 3\nnmd = true\ndt = 0.5", "--frames", "7", "--no-nmd")
    assert (options.frames, options.nmd, options.dt) == (7, False, 0.5)


def test_what_was_written_is_read_back_to_the_last_bit(tmp_path):
    first = parser().parse_args(["--cell-size", "0.30000000000000004", "--initial", "zero", "--output", "elsewhere"])
    write_parameters(tmp_path / "parameters.toml", first.parameters(), first.study)
    second = parser().parse_args(["--parameters", str(tmp_path / "parameters.toml")])
    different = {name for name, value in vars(second).items() if value != getattr(first, name)}
    assert different == {"output", "parameters_file"}
    text = (tmp_path / "parameters.toml").read_text()
    assert "studies/run slope --parameters" in text
    assert "cell-size = 0.30000000000000004  # side of the squares [m]" in text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("cel-size = 1", "given.toml: unknown key 'cel-size'; did you mean cell-size?"),
        ("cell-size = 1\ncell_size = 2", "given.toml: cell-size is given twice, as cell-size and as cell_size"),
        ("output = 'x'", "unknown key 'output', expected some of cell-size, dt,"),
        ("cell-size = 'big'", "given.toml: cell-size is 'big', expected a number"),
        ("cell-size = -1", "given.toml: cell-size is '-1', expected a number above 0 m"),
        ("cell-size = [1]", "given.toml: cell-size is [1], expected a number"),
        ("cell-size = true", "given.toml: cell-size is True, expected a number"),
        ("frames = 2.5", "given.toml: frames is '2.5', expected a whole number from 1 on"),
        ("initial = 'all'", "given.toml: initial is 'all', expected one of fem, zero"),
        ("nmd = 1", "given.toml: nmd is 1, expected true or false"),
        ("cell-size 1", "given.toml is not TOML"),
    ],
)
def test_mistakes_name_file_key_and_what_was_expected(tmp_path, capsys, text, message):
    with pytest.raises(SystemExit) as ended:
        parse(tmp_path, text)
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


def test_a_file_that_is_not_there(tmp_path, capsys):
    with pytest.raises(SystemExit):
        parser().parse_args(["--parameters", str(tmp_path / "none.toml")])
    assert "cannot read --parameters" in capsys.readouterr().err


def test_an_option_that_is_not_there_names_its_neighbour(capsys):
    with pytest.raises(SystemExit):
        parser().parse_args(["--cell-siez", "1"])
    assert "unrecognized arguments: --cell-siez 1; did you mean --cell-size?" in capsys.readouterr().err


def test_an_option_goes_by_its_former_name_with_a_warning(tmp_path):
    p = parser()
    formerly(p, "mesh-width", "--cell-size")
    (tmp_path / "given.toml").write_text("mesh-width = 2")
    for arguments in (["--mesh-width", "2"], ["--mesh-width=2"], ["--parameters", str(tmp_path / "given.toml")]):
        with pytest.warns(FutureWarning, match="the option --mesh-width is now called --cell-size"):
            assert p.parse_args(arguments).cell_size == 2
    assert "mesh-width" not in p.format_help()


def test_the_first_word_of_a_key_names_the_key():
    known = ["compressibility", "compression_slope", "swelling_slope", "cohesion"]
    assert unknown_key("compression", known) == "unknown key 'compression'; did you mean compression_slope?"
    assert unknown_key("swelling", known) == "unknown key 'swelling'; did you mean swelling_slope?"
    assert "expected some of" in unknown_key("c", known)
