"""Every export format, over arms: what it writes it reads back, and played in physics the tool does what it did in the run."""

import pytest

from lab.errors import BadInput
from lab.export import program_formats
from lab.export.play import deviation
from lab.export.program import Options, Program

FORMATS = program_formats()
NEEDS_AXES = {"urscript": 6}


def exported(program: Program, name: str, options: Options) -> dict[str, str]:
    axes = len(program.arm.joints)
    if NEEDS_AXES.get(name, axes) != axes:
        with pytest.raises(BadInput, match=rf"--format {name}: arm '\w+' has {axes} axes; .* with {NEEDS_AXES[name]}$"):
            FORMATS[name].write(program, options)
        return {}
    return FORMATS[name].write(program, options)


@pytest.mark.parametrize("name", FORMATS)
def test_what_is_written_is_read_back_and_plays_as_the_run(program: Program, name: str) -> None:
    files = exported(program, name, Options(any_arm=True))
    if files:
        off = deviation(program, FORMATS[name].read(files, program.arm))
        assert off.near_enough
        assert (off.max_m, off.max_rad) < (6e-4, 0.005)
        assert off.at_rest_m < 1e-4
        assert (off.motions, off.poses > 200) == (4, True)
        assert (off.max_m, off.max_rad) > (0.0, 0.0)  # it was really compared


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_run_gives_the_same_files(program: Program, name: str) -> None:
    assert exported(program, name, Options(any_arm=True)) == exported(program, name, Options(any_arm=True))


@pytest.mark.parametrize("name", FORMATS)
def test_an_empty_folder_is_no_export(up6: Program, name: str) -> None:
    with pytest.raises(BadInput, match="none"):
        FORMATS[name].read({}, up6.arm)


def test_positions_in_pulses_play_as_the_run_where_the_pulses_are_known(program: Program) -> None:
    options = Options(positions="pulse", any_arm=True)
    if program.arm.name == "up6":
        assert deviation(program, FORMATS["jbi"].read(FORMATS["jbi"].write(program, options), program.arm)).near_enough
        return
    with pytest.raises(BadInput, match=rf"--positions pulse: pulses of arm '{program.arm.name}' are not known"):
        FORMATS["jbi"].write(program, options)
